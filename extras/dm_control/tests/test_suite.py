"""mjenv_dm_control.suite in the place of dm_control.suite: values, types, specs, arguments and errors."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import dm_env
import numpy as np
import pytest
from dm_control import suite as theirs

from conftest import ABSENT, TASKS, actions
from mjenv_dm_control import suite as ours


def assert_same_types(got: Any, want: Any) -> None:
    assert type(got) is type(want)
    if isinstance(want, np.ndarray):
        assert (got.shape, got.dtype) == (want.shape, want.dtype)


def assert_same_step(got: dm_env.TimeStep, want: dm_env.TimeStep) -> None:
    assert got.step_type == want.step_type
    assert got.reward == want.reward
    assert got.discount == want.discount
    assert_same_types(got.reward, want.reward)
    assert_same_types(got.discount, want.discount)
    assert type(got.observation) is type(want.observation)
    assert [*got.observation] == [*want.observation]
    for name, value in want.observation.items():
        assert_same_types(got.observation[name], value)
        np.testing.assert_array_equal(got.observation[name], value, name)


def assert_same_episodes(got: Any, want: Any, seed: int, steps: int) -> None:
    draw = actions(want, seed)
    assert_same_step(got.reset(), want.reset())
    for _ in range(steps):
        action = draw()
        assert_same_step(got.step(action), want.step(action))


def pair(task: tuple[str, str], steps: int) -> tuple[Any, Any]:
    """The environments of the library and of dm_control after a reset and some steps."""
    envs = ours.load(*task, {"random": 3}), theirs.load(*task, {"random": 3})
    draw = actions(envs[1], 3)
    for env in envs:
        env.reset()
    for _ in range(steps):
        action = draw()
        for env in envs:
            env.step(action)
    return envs


@pytest.mark.parametrize("task", TASKS, ids="-".join)
def test_environment(task: tuple[str, str]) -> None:
    got, want = (suite.load(*task, task_kwargs={"random": 3}) for suite in (ours, theirs))
    assert got.action_spec() == want.action_spec()
    assert got.observation_spec() == want.observation_spec()
    assert got.reward_spec() == want.reward_spec()
    assert got.discount_spec() == want.discount_spec()
    assert got.control_timestep() == want.control_timestep()
    assert_same_episodes(got, want, 3, 5)
    got.close()


# The second episode begins by itself, in the step after the last one.
@pytest.mark.parametrize(
    ("domain", "task", "task_kwargs", "environment_kwargs"),
    [
        ("cartpole", "swingup", {"time_limit": 0.05}, {"flat_observation": True}),
        ("cartpole", "swingup", {"time_limit": 0.1}, {"n_sub_steps": 3}),
        ("pendulum", "swingup", {"time_limit": 0.5}, {"control_timestep": 0.06}),
        ("cartpole", "three_poles", {"sparse": True, "time_limit": 0.05}, None),
        ("manipulator", "bring_peg", {"fully_observable": False, "time_limit": 0.05}, None),
        ("stacker", "stack_2", {"fully_observable": False, "time_limit": 0.05}, {"flat_observation": True}),
    ],
)
def test_arguments(domain: str, task: str, task_kwargs: dict[str, Any], environment_kwargs: dict[str, Any]) -> None:
    kwargs = {"random": 5, **task_kwargs}
    got, want = (suite.load(domain, task, kwargs, environment_kwargs) for suite in (ours, theirs))
    assert got.control_timestep() == want.control_timestep()
    assert got.observation_spec() == want.observation_spec()
    assert_same_episodes(got, want, 5, 25)
    got.close()


def test_names() -> None:
    # dm_control 1.0.7 does not yet have humanoid_CMU-walk.
    def known(tasks: Any) -> list[tuple[str, str]]:
        return [task for task in tasks if task not in {*ABSENT, ("humanoid_CMU", "walk")}]

    for name in ("ALL_TASKS", "BENCHMARKING", "EASY", "HARD", "EXTRA"):
        assert known(getattr(ours, name)) == known(getattr(theirs, name)), name
    for domain, tasks in ours.TASKS_BY_DOMAIN.items():
        of_domain = [(domain, task) for task in tasks]
        assert known(of_domain) == known((domain, task) for task in theirs.TASKS_BY_DOMAIN[domain])
    assert {*ours.TASKS_BY_DOMAIN} == {*theirs.TASKS_BY_DOMAIN} - {"dog"}


def test_dm_control_has_the_rest() -> None:
    assert (
        type(ours.load("cartpole", "three_poles", {"num_poles": 4, "random": 1})).__module__ == "dm_control.rl.control"
    )


@pytest.mark.parametrize("task", TASKS, ids="-".join)
def test_visualize_reward(task: tuple[str, str]) -> None:
    """The colours of materials after resets, where dm_control has not yet computed the new state, and after steps."""
    got, want = (suite.load(*task, {"random": 4}, visualize_reward=True) for suite in (ours, theirs))
    assert got.task.visualize_reward
    draw = actions(want, 4)
    for _ in range(2):
        assert_same_step(got.reset(), want.reset())
        np.testing.assert_array_equal(got.physics.model.mat_rgba, want.physics.model.mat_rgba)
        for _ in range(2):
            action = draw()
            assert_same_step(got.step(action), want.step(action))
            np.testing.assert_array_equal(got.physics.model.mat_rgba, want.physics.model.mat_rgba)
    got.close()


def test_visualize_reward_later() -> None:
    got, want = (suite.load("cartpole", "balance", {"random": 1}) for suite in (ours, theirs))
    for env in (got, want):
        with pytest.raises(ValueError, match="Expected a boolean"):
            env.task.visualize_reward = 1
        env.reset()
        env.task.visualize_reward = True
        env.step([0.0])
    colours = got.physics.named.model.mat_rgba
    assert colours["self"].tolist() == want.physics.named.model.mat_rgba["self"].tolist()
    assert colours["self"].tolist() != colours["self_default"].tolist()
    for env in (got, want):
        env.task.visualize_reward = False
        env.reset()
    np.testing.assert_array_equal(got.physics.model.mat_rgba, want.physics.model.mat_rgba)


def both_refuse(error: type[Exception], load: Callable[[Any], Any]) -> None:
    messages = []
    for suite in (ours, theirs):
        with pytest.raises(error) as caught:
            load(suite)
        messages.append(str(caught.value))
    assert messages[0] == messages[1]


def test_errors() -> None:
    both_refuse(ValueError, lambda suite: suite.load("cartpole", "swingup", {"random": 2**32}))
    both_refuse(ValueError, lambda suite: suite.load("cartpole", "swingup", {"random": -1}))
    both_refuse(TypeError, lambda suite: suite.load("cartpole", "swingup", {"random": 0.5}))
    both_refuse(ValueError, lambda suite: suite.load("cartpole", "jump"))
    both_refuse(ValueError, lambda suite: suite.load("q", "crawl"))
    both_refuse(ValueError, lambda suite: suite.load("dog", "fly"))
    with pytest.raises(ValueError, match=r"^Domain 'cheeta' does not exist. Did you mean 'cheetah'\?$"):
        ours.load("cheeta", "run")
    with pytest.raises(
        ValueError, match=r"^Level 'swingpu' does not exist in domain 'cartpole'. Did you mean 'swingup'\?$"
    ):
        ours.load("cartpole", "swingpu")
    both_refuse(ValueError, lambda suite: suite.load("cartpole", "swingup", None, {"control_timestep": 0.001}))
    both_refuse(ValueError, lambda suite: suite.load("cartpole", "swingup", None, {"control_timestep": 0.015}))
    both_refuse(ValueError, lambda suite: suite.load("walker", "run", None, {"n_sub_steps": 2}))
    with pytest.raises(
        TypeError, match="unexpected keyword argument 'fully_observed'; it takes fully_observable, random"
    ):
        ours.load("stacker", "stack_2", {"fully_observed": True})
    # Keywords of other tasks, and of the environment in the place of the task's.
    for task_kwargs, environment_kwargs in (
        ({"sparse": True}, None),
        ({"num_poles": 3}, None),
        ({"flat_observation": True}, None),
        (None, {"time_limit": 3}),
        (1, None),
        (None, ["flat_observation"]),
    ):
        for suite in (ours, theirs):
            with pytest.raises((TypeError, ValueError)):
                suite.load("cartpole", "swingup", task_kwargs, environment_kwargs)
    with pytest.raises(TypeError, match="task_kwargs is a mapping of keywords, or None, not 1"):
        ours.load("cartpole", "swingup", 1)
    with pytest.raises(TypeError, match="'time_limit'; it takes control_timestep, flat_observation, n_sub_steps here"):
        ours.load("cartpole", "swingup", None, {"time_limit": 3})
    with pytest.raises(AttributeError, match=r"task has no 'get_reward': the library computes rewards"):
        ours.load("cartpole", "swingup").task.get_reward(None)


@pytest.mark.parametrize("seed", [[1, 2], np.arange(3), np.int64(5), True])
def test_seeds(seed: Any) -> None:
    """Whatever RandomState takes."""
    got, want = (suite.load("cartpole", "swingup", {"random": seed}) for suite in (ours, theirs))
    for _ in range(2):
        assert_same_step(got.reset(), want.reset())


@pytest.mark.parametrize("flat", [False, True])
def test_observation_of_the_task(flat: bool) -> None:
    """task.get_observation, as programs that write a state and look at it use it, also of a copy of the physics."""
    envs = [
        suite.load("walker", "walk", {"random": 2}, {"flat_observation": flat} if flat else None)
        for suite in (ours, theirs)
    ]
    states = []
    for env in envs:
        env.reset()
        copy = env.physics.copy()
        with env.physics.reset_context():
            env.physics.data.qpos[:] = 0.1
        states.append([env.task.get_observation(physics) for physics in (env.physics, copy)])
        assert env.task.action_spec(env.physics) == env.action_spec()
    for got, want in zip(*states, strict=True):
        assert [*got] == [*want]
        for name, value in want.items():
            assert_same_types(got[name], value)
            np.testing.assert_array_equal(got[name], value, name)


def test_errors_without_dm_control(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "dm_control.suite", None)
    with pytest.raises(ValueError, match=r"Domain 'cheeta' does not exist. Did you mean 'cheetah'"):
        ours.load("cheeta", "run")
    with pytest.raises(ValueError, match=r"Level 'walk' does not exist in domain 'cheetah'.*pip install dm_control"):
        ours.load("cheetah", "walk")


def test_without_dm_env_it_says_what_to_install() -> None:
    id = "dm_control/cheetah-run-v0"
    text = f"import sys, gymnasium; sys.modules['dm_env'] = None; gymnasium.make('mjenv_dm_control:{id}')"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=False)
    assert 'mjenv_dm_control needs dm_env: pip install "mjenv[dm_control]"' in done.stderr
