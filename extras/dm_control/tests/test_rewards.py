"""Rewards that random actions hardly reach: states in which dm_control's reward is large are written to both sides."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from dm_control import suite as theirs
from test_suite import assert_same_step

from conftest import TASKS, actions
from mjenv_dm_control import suite as ours

STEPS = 8
# Tasks whose sparse rewards random actions do not reach, but random positions do.
SPARSE = {("reacher", "easy"), ("reacher", "hard"), ("finger", "turn_hard"), ("ball_in_cup", "catch")}


def position(model: Any, random: np.random.RandomState) -> np.ndarray:
    """A position of all joints: within their limits, and anywhere without."""
    qpos = np.array(model.qpos0)
    for joint in range(model.njnt):
        at, kind = model.jnt_qposadr[joint], model.jnt_type[joint]
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            quaternion = random.randn(4)
            qpos[at + 3 : at + 7] = quaternion / np.linalg.norm(quaternion)
        else:
            widest = np.pi if kind == mujoco.mjtJoint.mjJNT_HINGE else 0.5
            low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (-widest, widest)
            qpos[at] = random.uniform(low, high)
    return qpos


def ball_near_the_cup(env: Any, random: np.random.RandomState) -> np.ndarray:
    """A position with the ball up to 5 cm from the cup's target, where the string leaves random positions rarely."""
    qpos = np.array(env.physics.model.qpos0)
    write(env, qpos)
    to_target = env.physics.named.data.site_xpos["target"] - env.physics.named.data.xpos["ball"]
    qpos[[2, 3]] += to_target[[0, 2]] + random.uniform(-0.05, 0.05, 2)
    return qpos


def write(env: Any, qpos: np.ndarray) -> None:
    with env.physics.reset_context():
        env.physics.data.qpos[:] = qpos


def best_position(task: tuple[str, str], env: Any, tries: int) -> tuple[float, np.ndarray]:
    """The position with the largest reward among random ones."""
    random, best, qpos = np.random.RandomState(5), -np.inf, np.array(env.physics.data.qpos)
    for _ in range(tries):
        is_cup = task == ("ball_in_cup", "catch")
        tried = ball_near_the_cup(env, random) if is_cup else position(env.physics.model, random)
        with env.physics.suppress_physics_errors():
            write(env, tried)
        reward = float(env.task.get_reward(env.physics))
        if reward > best:
            best, qpos = reward, tried
    return best, qpos


@pytest.mark.parametrize("task", TASKS, ids="-".join)
def test_rewards(task: tuple[str, str], request: pytest.FixtureRequest) -> None:
    got, want = (suite.load(*task, {"random": 3}) for suite in (ours, theirs))
    assert_same_step(got.reset(), want.reset())
    best, qpos = best_position(task, want, 20_000 if request.config.getoption("--long") else 500)
    assert best > 0 or task not in SPARSE
    for env in (got, want):
        write(env, qpos)
    draw, rewarded = actions(want, 2), 0
    for step in range(STEPS):
        action = draw() if step % 2 else np.zeros(want.action_spec().shape)
        steps = got.step(action), want.step(action)
        assert_same_step(*steps)
        rewarded += steps[1].reward > 0
    assert rewarded > 0 or task not in SPARSE
