"""PixelVectorEnv: the pictures, rewards and ends of dm_control with repeated actions and stacked pictures,
as agents that learn from pixels add them to it."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import pytest
from dm_control import suite

import mjenv
from conftest import actions
from mjenv_dm_control.pixels import PixelVectorEnv

SIZE = (40, 56)
SEEDS = [1, 2, 3]


class Original:
    """A task of dm_control whose observation is its last pictures."""

    def __init__(self, task: str, seed: int, limit: float, repeat: int, stack: int, camera: int) -> None:
        self.env = suite.load(*task.split("-"), {"random": seed, "time_limit": limit})
        self._repeat, self._camera, self._stack = repeat, camera, stack

    def reset(self) -> np.ndarray:
        self.env.reset()
        self._frames = deque([self._picture()] * self._stack, maxlen=self._stack)
        return np.concatenate(self._frames)

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool]:
        reward = 0.0
        for _ in range(self._repeat):
            step = self.env.step(action)
            reward += step.reward
            if step.last():
                break
        self._frames.append(self._picture())
        return np.concatenate(self._frames), reward, step.last()

    def _picture(self) -> np.ndarray:
        return self.env.physics.render(*SIZE, self._camera).transpose(2, 0, 1)


def pair(task: str, mode: str, limit: float = 10.0, **keywords: Any) -> tuple[mjenv.VectorEnv, list[Original]]:
    repeat, stack = keywords.get("action_repeat", 1), keywords.get("frame_stack", 1)
    steps = round(limit / mjenv.make(f"dm_control/{task}-v0").dt)
    envs = PixelVectorEnv(
        f"dm_control/{task}-v0", 3, pixels=SIZE, camera=0, autoreset_mode=mode, max_episode_steps=steps, **keywords
    )
    return envs, [Original(task, seed, limit, repeat, stack, 0) for seed in SEEDS]


@pytest.mark.parametrize("task", ["walker-walk", "reacher-easy"])
def test_pictures(task: str) -> None:
    envs, originals = pair(task, "disabled", action_repeat=2, frame_stack=3)
    assert envs.single_observation_space.shape == (9, *SIZE)
    draw = actions(originals[0].env, 1)
    got, infos = envs.reset(seed=SEEDS)
    np.testing.assert_array_equal(got, [original.reset() for original in originals])
    assert infos["state"].shape == (3, *mjenv.make(f"dm_control/{task}-v0").observation_space.shape)
    for _ in range(5):
        chosen = np.array([draw() for _ in SEEDS])
        want = [original.step(action) for original, action in zip(originals, chosen, strict=True)]
        got, rewards, terminations, truncations, _ = envs.step(chosen)
        np.testing.assert_array_equal(got, [pictures for pictures, _, _ in want])
        np.testing.assert_array_equal(rewards, [float(reward) for _, reward, _ in want])
        assert not terminations.any()
        assert not truncations.any()


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_ends(mode: str) -> None:
    """An episode of five steps ends in the first of two repetitions."""
    envs, originals = pair("pendulum-swingup", mode, 0.1, action_repeat=2, frame_stack=2)
    got, _ = envs.reset(seed=SEEDS)
    np.testing.assert_array_equal(got, [original.reset() for original in originals])
    ends = []
    for _ in range(8):
        began = mode == "next_step" and ends and ends[-1]
        want = [original.reset() if began else original.step(np.ones(1)) for original in originals]
        got, rewards, _, truncations, infos = envs.step(np.ones((3, 1)))
        if began:
            np.testing.assert_array_equal(got, want)
            assert rewards.tolist() == [0, 0, 0]
            ends.append(False)
            continue
        np.testing.assert_array_equal(rewards, [float(reward) for _, reward, _ in want])
        assert truncations.tolist() == [last for _, _, last in want]
        pictures = [drawn for drawn, _, _ in want]
        ends.append(bool(truncations[0]))
        if ends[-1] and mode == "same_step":
            np.testing.assert_array_equal(np.stack(infos["final_obs"]), pictures)
            pictures = [original.reset() for original in originals]
        np.testing.assert_array_equal(got, pictures)
    assert sum(ends) == 2


def test_errors() -> None:
    with pytest.raises(ValueError, match="action_repeat is 0"):
        PixelVectorEnv("dm_control/cheetah-run-v0", pixels=SIZE, action_repeat=0)
    with pytest.raises(ValueError, match="camera_id is -2"):
        PixelVectorEnv("dm_control/cheetah-run-v0", pixels=SIZE, camera=-2).reset()
    with pytest.raises(TypeError, match="unexpected keyword argument 'frame_stacks'"):
        PixelVectorEnv("dm_control/cheetah-run-v0", pixels=SIZE, frame_stacks=3)
