"""Everything that Gymnasium returned in a recording, bit for bit and type for type."""

from pathlib import Path

import numpy as np
import pytest

import golden
import mjenv

TRAJECTORIES = golden.files("trajectories") + golden.files("custom")
STATES = golden.files("state")
RESET, STEP, SET_STATE, SIMULATE = range(4)


def by_name(path: Path) -> str:
    return f"{path.parent.name}/{path.stem}"


def check_trajectory(path: Path, id: str | None = None) -> None:
    """Plays a recording with its own environment, or with another one that must equal it."""
    expected = golden.load(path)
    dtype = expected["action"].dtype
    env = mjenv.make(id or expected.id, **expected.keywords)

    def reset(seed: int | None, episode: int) -> None:
        obs, info = env.reset(seed=seed)
        assert golden.same(obs, expected["reset_obs"][episode])
        golden.check_info(info, expected.reset_info, expected["reset_info"][episode], dtype)

    episodes = expected["reset_at"].tolist()
    assert episodes[0] == 0
    for step, action in enumerate(expected["action"]):
        if step in episodes:
            reset(expected.seed if step == 0 else None, episodes.index(step))
        obs, reward, terminated, truncated, info = env.step(action)
        assert golden.same(obs, expected["obs"][step]), step
        assert np.float64(reward).tobytes() == expected["reward"][step].tobytes(), step
        assert terminated is bool(expected["terminated"][step]), step
        assert truncated is bool(expected["truncated"][step]), step
        golden.check_info(info, expected.info, expected["info"][step], dtype)
        assert golden.same(env.data.qpos, expected["qpos"][step]), step
        assert golden.same(env.data.qvel, expected["qvel"][step]), step


@pytest.mark.parametrize("path", TRAJECTORIES, ids=by_name)
def test_trajectory(path: Path) -> None:
    check_trajectory(path)


@pytest.mark.parametrize("path", STATES, ids=by_name)
def test_state(path: Path) -> None:
    expected = golden.load(path)
    env = mjenv.make(expected.id, **expected.keywords)
    arrays = [name for name in expected.arrays if name.startswith("data.")]
    assert len(arrays) > 30
    for stage, kind in enumerate(expected["stage"]):
        action = expected["action"][stage]
        if kind == RESET:
            env.reset(seed=expected.seed if stage == 0 else None)
        elif kind == STEP:
            obs, reward, _, _, info = env.step(action)
            assert golden.same(obs, expected["obs"][stage]), stage
            assert np.float64(reward).tobytes() == expected["reward"][stage].tobytes(), stage
            golden.check_info(info, expected.info, expected["info"][stage], action.dtype)
        elif kind == SET_STATE:
            env.set_state(expected["set_qpos"][stage], expected["set_qvel"][stage])
        else:
            assert kind == SIMULATE
            env.do_simulation(action, 3)
        for name in arrays:
            value = getattr(env.data, name.removeprefix("data."))
            assert golden.same(value, expected[name][stage]), (stage, name)
    for name in (name for name in expected.arrays if name.startswith("model.")):
        value = env.model
        for part in name.split(".")[1:]:
            value = getattr(value, part)
        assert golden.same(value, expected[name]), name
