"""Programs as users of dm_control's suite have them, on both suites: what they observe and earn is equal.

The wrappers are written anew, after what the programs' authors describe.
"""

from __future__ import annotations

from collections import deque
from typing import Any, NamedTuple

import dm_env
import gymnasium
import numpy as np
import pytest
from dm_control import suite as theirs
from dm_control.suite import base
from dm_control.suite.wrappers import action_scale, pixels
from dm_env import specs

from mjenv_dm_control import suite as ours

# ---- DrQ-v2: pictures of repeated actions, stacked ----


class ExtendedTimeStep(NamedTuple):
    step_type: dm_env.StepType
    reward: float
    discount: float
    observation: np.ndarray
    action: np.ndarray

    def last(self) -> bool:
        return self.step_type == dm_env.StepType.LAST


class DrqEnvironment(dm_env.Environment):
    """Float32 actions from -1 to 1, each repeated; the last pictures as channels; time steps with the action."""

    def __init__(self, suite: Any, name: str, stack: int, repeat: int, seed: int, limit: float) -> None:
        domain, task = name.split("_", 1)
        domain = {"cup": "ball_in_cup"}.get(domain, domain)
        assert (domain, task) in suite.ALL_TASKS
        env = suite.load(domain, task, {"random": seed, "time_limit": limit}, visualize_reward=False)
        env = action_scale.Wrapper(env, minimum=-1.0, maximum=1.0)
        camera = 2 if domain == "quadruped" else 0
        self._env = pixels.Wrapper(
            env, pixels_only=True, render_kwargs={"height": 84, "width": 84, "camera_id": camera}
        )
        self._repeat, self._frames = repeat, deque[np.ndarray](maxlen=stack)

    def action_spec(self) -> specs.BoundedArray:
        spec = self._env.action_spec()
        return specs.BoundedArray(spec.shape, np.float32, spec.minimum, spec.maximum, "action")

    def observation_spec(self) -> specs.BoundedArray:
        height, width, channels = self._env.observation_spec()["pixels"].shape
        shape = (channels * (self._frames.maxlen or 0), height, width)
        return specs.BoundedArray(shape, np.uint8, 0, 255, "observation")

    def reset(self) -> ExtendedTimeStep:
        step = self._env.reset()
        self._frames.extend([self._picture(step)] * (self._frames.maxlen or 0))
        return self._extended(step, 0.0, 1.0, np.zeros(self.action_spec().shape, np.float32))

    def step(self, action: np.ndarray) -> ExtendedTimeStep:
        reward, discount = 0.0, 1.0
        for _ in range(self._repeat):
            step = self._env.step(action.astype(self._env.action_spec().dtype))
            reward += (step.reward or 0.0) * discount
            discount *= step.discount
            if step.last():
                break
        self._frames.append(self._picture(step))
        return self._extended(step, reward, discount, action)

    def _extended(self, step: dm_env.TimeStep, reward: float, discount: float, action: np.ndarray) -> ExtendedTimeStep:
        return ExtendedTimeStep(step.step_type, reward, discount, np.concatenate(self._frames), action)

    @staticmethod
    def _picture(step: dm_env.TimeStep) -> np.ndarray:
        return step.observation["pixels"].transpose(2, 0, 1).copy()


@pytest.mark.parametrize("name", ["walker_walk", "cup_catch", "quadruped_walk"])
def test_drq(name: str) -> None:
    """Two episodes, which end in the middle of a repeated action."""
    envs = [DrqEnvironment(suite, name, 3, 2, 1, 0.1) for suite in (ours, theirs)]
    assert envs[0].action_spec() == envs[1].action_spec()
    assert envs[0].observation_spec() == envs[1].observation_spec()
    random, lasts = np.random.RandomState(2), 0
    for _ in range(2):
        steps = [env.reset() for env in envs]
        while not steps[1].last():
            np.testing.assert_array_equal(steps[0].observation, steps[1].observation)
            assert (steps[0].step_type, *steps[0][1:3]) == (steps[1].step_type, *steps[1][1:3])
            action = random.uniform(-1, 1, envs[1].action_spec().shape).astype(np.float32)
            steps = [env.step(action) for env in envs]
        np.testing.assert_array_equal(steps[0].observation, steps[1].observation)
        assert (steps[0].step_type, *steps[0][1:3]) == (steps[1].step_type, *steps[1][1:3])
        lasts += steps[0].last()
    assert lasts == 2


# ---- TD-MPC2: flat states, also of tasks that the program adds to dm_control's ----


class BackwardsTask(base.Task):
    """A walker that has to be fast backwards."""

    def initialize_episode(self, physics: Any) -> None:
        physics.named.data.qpos["rootz"] = self.random.uniform(0.1, 0.2)
        super().initialize_episode(physics)

    def get_observation(self, physics: Any) -> dict[str, np.ndarray]:
        return {"orientations": physics.orientations(), "velocity": physics.velocity()}

    def get_reward(self, physics: Any) -> float:
        return float(-physics.horizontal_velocity())


def backwards(random: Any = None, environment_kwargs: Any = None) -> Any:
    walker = theirs.walker
    physics = walker.Physics.from_xml_string(*walker.get_model_and_assets())
    return theirs.walker.control.Environment(
        physics, BackwardsTask(random), time_limit=25, control_timestep=0.025, **environment_kwargs or {}
    )


class FlatEnvironment(gymnasium.Env):
    """float32 states, and actions that are repeated twice."""

    def __init__(self, suite: Any, domain: str, task: str, seed: int) -> None:
        if (domain, task) not in suite.ALL_TASKS:
            raise ValueError(f"Unknown task: {task}")
        env = suite.load(domain, task, task_kwargs={"random": seed}, visualize_reward=False)
        self.env = action_scale.Wrapper(env, minimum=-1.0, maximum=1.0)
        count = sum(int(np.prod(spec.shape)) for spec in env.observation_spec().values())
        spec = self.env.action_spec()
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (count,), np.float32)
        self.action_space = gymnasium.spaces.Box(spec.minimum, spec.maximum, dtype=spec.dtype)

    def reset(self, **_: Any) -> np.ndarray:
        return self._flat(self.env.reset())

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float]:
        reward = 0.0
        for _ in range(2):
            step = self.env.step(action)
            reward += step.reward
        return self._flat(step), reward

    def _flat(self, step: dm_env.TimeStep) -> np.ndarray:
        return np.concatenate([value.flatten() for value in step.observation.values()], dtype=np.float32)


def test_added_tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A program adds a task to a domain of dm_control, and to the suite's list of tasks."""
    monkeypatch.setitem(theirs.walker.SUITE._tasks, "run_backwards", backwards)
    monkeypatch.setitem(theirs.walker.SUITE._tags, "custom", {"run_backwards": backwards})
    for suite in (ours, theirs):
        # Of mjenv's suite, _get_tasks is dm_control's.
        monkeypatch.setattr(suite, "ALL_TASKS", suite.ALL_TASKS + suite._get_tasks("custom"))
    for domain, task in (("walker", "run_backwards"), ("humanoid", "walk"), ("cartpole", "swingup")):
        envs = [FlatEnvironment(suite, domain, task, 7) for suite in (ours, theirs)]
        assert envs[0].observation_space == envs[1].observation_space
        assert envs[0].action_space == envs[1].action_space
        np.testing.assert_array_equal(*(env.reset() for env in envs))
        envs[1].action_space.seed(1)
        for _ in range(5):
            action = envs[1].action_space.sample()
            (got, reward), (want, wanted) = (env.step(action) for env in envs)
            np.testing.assert_array_equal(got, want)
            assert reward == wanted
    with pytest.raises(ValueError, match="Unknown task: fly"):
        FlatEnvironment(ours, "walker", "fly", 1)
    with pytest.raises(AttributeError, match="has no attribute '_get_task'"):
        ours._get_task  # noqa: B018
