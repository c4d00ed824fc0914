"""gymnasium.make of the suite's ids is Shimmy's environment: spaces, seeds, steps, ends, infos and pictures."""

from __future__ import annotations

import importlib
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from dm_control import suite
from shimmy import DmControlCompatibilityV0
from test_suite import assert_same_types

import mjenv
import mjenv_dm_control
from conftest import TASKS
from mjenv_dm_control import gym

# Shimmy registers the same ids when it is imported. The one that is imported last has them.
importlib.reload(mjenv_dm_control)

SIZE = {"height": 48, "width": 64}


def pair(task: tuple[str, str], **keywords: Any) -> tuple[gymnasium.Env, gymnasium.Env]:
    """The environments of mjenv and of Shimmy, which registers its own in the same way."""
    load = {name: keywords[name] for name in ("task_kwargs", "environment_kwargs") if name in keywords}
    drawn = {name: keywords[name] for name in ("render_mode", "render_kwargs") if name in keywords}
    want = DmControlCompatibilityV0(suite.load(*task, **load), **drawn)
    got = gymnasium.make(f"dm_control/{'-'.join(task)}-v0", **keywords)
    assert isinstance(got.unwrapped, gym.DmControlEnv)
    return got, want


def assert_same(got: Any, want: Any) -> None:
    assert_same_types(got, want)
    if isinstance(want, dict):
        assert [*got] == [*want]
        for name in want:
            assert_same(got[name], want[name])
    elif isinstance(want, tuple):
        for mine, wanted in zip(got, want, strict=True):
            assert_same(mine, wanted)
    else:
        np.testing.assert_array_equal(got, want)


@pytest.mark.parametrize("task", TASKS, ids="-".join)
def test_episodes(task: tuple[str, str]) -> None:
    # The springs of lqr are drawn when Shimmy's environment is built.
    kwargs = {"task_kwargs": {"random": 9}}
    got, want = pair(task, **kwargs)
    assert got.observation_space == want.observation_space
    assert got.action_space == want.action_space
    assert got.unwrapped.dt == want.dt
    for seed in (5, None, 2**32 - 1):
        assert_same(got.reset(seed=seed), want.reset(seed=seed))
        want.action_space.seed(seed)
        for _ in range(5):
            action = np.clip(want.action_space.sample(), -1, 1)
            assert_same(got.step(action), want.step(action))
    got.close()


def test_ends() -> None:
    """Truncation by the limit of time, and what a step after it does."""
    keywords = {"task_kwargs": {"random": 1, "time_limit": 0.04}, "environment_kwargs": {"n_sub_steps": 2}}
    got, want = pair(("cartpole", "swingup"), **keywords)
    assert_same(got.reset(), want.reset())
    flags = []
    for _ in range(5):
        mine, wanted = got.step(np.array([0.5])), want.step(np.array([0.5]))
        assert_same(mine, wanted)
        flags.append(mine[3])
    assert flags == [False, True, False, False, True]


def test_termination() -> None:
    got, want = pair(("lqr", "lqr_2_1"), task_kwargs={"random": 2})
    got.reset()
    want.reset()
    for _ in range(1000):
        mine, wanted = got.step(np.zeros(1)), want.step(np.zeros(1))
        assert mine[2:4] == wanted[2:4]
        if wanted[2]:
            break
        assert_same(mine, wanted)


@pytest.mark.parametrize("mode", ["rgb_array", "depth_array", "multi_camera"])
def test_pictures(mode: str) -> None:
    kwargs = SIZE if mode == "multi_camera" else {**SIZE, "camera_id": 1}
    got, want = pair(("cheetah", "run"), render_mode=mode, render_kwargs=kwargs)
    got.reset(seed=1)
    want.reset(seed=1)
    assert_same(got.render(), np.asarray(want.render()))


def test_random_numbers() -> None:
    got, want = pair(("cartpole", "balance"))
    got.reset(seed=3)
    want.reset(seed=3)
    assert got.unwrapped.np_random.uniform() == want.np_random.uniform()
    assert got.unwrapped.np_random_seed == want.np_random_seed == 3
    assert_same(got.reset(), want.reset())


def test_pickle() -> None:
    env, _ = pair(("walker", "walk"))
    env.reset(seed=4)
    env.step(np.ones(6))
    copy = pickle.loads(pickle.dumps(env.unwrapped))
    for _ in range(3):
        assert_same(copy.step(np.ones(6)), env.unwrapped.step(np.ones(6)))
    assert_same(copy.reset(), env.unwrapped.reset())


def test_registry() -> None:
    spec = gymnasium.spec("dm_control/cheetah-run-v0")
    assert spec.max_episode_steps is None
    assert isinstance(gymnasium.make(spec).unwrapped, gym.DmControlEnv)
    with pytest.raises(ValueError, match="render_mode is one of human, rgb_array"):
        gym.DmControlEnv("cheetah", "run", render_mode="rgb")
    with pytest.raises(ValueError, match="Seed must be between 0 and"):
        gymnasium.make(spec.id).reset(seed=2**32)


def test_vector() -> None:
    """Row i of a vector is Shimmy's environment of the seed 5 + i, with its terms as vectors."""
    envs = gymnasium.make_vec("dm_control/walker-walk-v0", 2)
    assert isinstance(envs.unwrapped, mjenv.VectorEnv)
    originals = [pair(("walker", "walk"))[1] for _ in range(2)]
    got, _ = envs.reset(seed=5)
    want = [original.reset(seed=5 + i)[0] for i, original in enumerate(originals)]
    for _ in range(3):
        assert [*got] == [*want[0]]
        for name in want[0]:
            np.testing.assert_array_equal(got[name], [np.ravel(terms[name]) for terms in want])
        actions = np.array([original.action_space.sample() for original in originals])
        got, rewards, *_ = envs.step(actions)
        steps = [original.step(action) for original, action in zip(originals, actions, strict=True)]
        want = [step[0] for step in steps]
        np.testing.assert_array_equal(rewards, [step[1] for step in steps])
