"""Tests of Reach-v0."""

from __future__ import annotations

import copy
import sys
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import mjenv
from mjenv_learn.policy import Policy

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE))

import reach  # noqa: E402
import solve  # noqa: E402


def test_gymnasium_accepts_it() -> None:
    check_env(mjenv.make("Reach-v0"), skip_render_check=True)


def test_goals_can_be_reached() -> None:
    """The formula for the hand gives what MuJoCo computes from the model."""
    env = mjenv.make("Reach-v0")
    env.reset(seed=0)
    for angles in np.random.default_rng(0).uniform([-3, -1, 0.2], [3, 1.5, 2.4], (50, 3)):
        env.set_state(angles, np.zeros(3))
        assert env.data.site("hand").xpos == pytest.approx(reach.hand_at(angles[None])[0], abs=1e-12)


def test_reward() -> None:
    env = mjenv.make("Reach-v0", effort=0.5)
    env.reset(seed=1)
    action = np.array([0.5, -1.0, 0.25])
    observation, reward, terminated, _, info = env.step(action)
    # The observation is the error in another frame, so it is as long.
    assert info["distance"] == pytest.approx(np.linalg.norm(observation[:3]), rel=1e-12)
    assert reward == pytest.approx(-info["distance"] - 0.5 * (0.25 + 1 + 0.0625), rel=1e-12)
    assert not terminated


def test_rows_depend_on_their_seeds_alone() -> None:
    envs = [mjenv.make_vec("Reach-v0", 8, num_threads=threads, max_episode_steps=7) for threads in (1, 2)]
    env = mjenv.make("Reach-v0", max_episode_steps=7)
    observed = [np.array([env.reset(seed=8)[0]] * 8)] + [e.reset(seed=[5, 6, 7, 8, 9, 10, 11, 12])[0] for e in envs]
    assert np.array_equal(observed[1], observed[2])
    assert np.array_equal(observed[0][3], observed[1][3])
    assert len(np.unique(observed[1], axis=0)) == 8
    for action in np.random.default_rng(0).uniform(-1, 1, (30, 8, 3)):
        one, two = (e.step(action) for e in envs)
        for first, second in zip(one[:4], two[:4], strict=True):
            assert np.array_equal(first, second)


def test_a_copy_has_the_goal() -> None:
    env = mjenv.make("Reach-v0")
    env.reset(seed=4)
    other = copy.deepcopy(env)
    for action in np.random.default_rng(0).uniform(-1, 1, (20, 3)):
        one, two = env.step(action), other.step(action)
        assert np.array_equal(one[0], two[0])
        assert one[1] == two[1]


def test_the_policy_reaches() -> None:
    """The committed policy, with goals with which it was not made."""
    policy = Policy.load(HERE / "policy.txt")
    weights = np.array(policy.layers[0].weights)
    envs = mjenv.make_vec("Reach-v0", 100)
    returns, distances = solve.play(envs, np.broadcast_to(weights, (100, *weights.shape)), 2000)
    assert distances.mean() < 0.03
    still, starting = solve.play(envs, np.zeros((100, *weights.shape)), 2000)
    assert starting.mean() > 0.2
    assert returns.mean() > still.mean()
