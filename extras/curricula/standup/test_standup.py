"""Tests of StandupLesson-v0, and of the policy of HumanoidStandup-v5 that was trained with it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import mjenv
from mjenv_learn.policy import Policy

HERE = Path(__file__).resolve().parent
ID, LESSON = "HumanoidStandup-v5", "StandupLesson-v0"


@pytest.fixture(scope="module", autouse=True)
def plugin(load_plugin: Callable[[str], Path]) -> Path:
    return load_plugin("standup")


def test_observations_and_rewards_are_those_of_the_robot() -> None:
    """Without help, from the same states."""
    with mjenv.make(ID, strict=False) as env, mjenv.make(LESSON, strict=False) as lesson:
        env.reset(seed=1)
        lesson.reset(seed=1)
        rng = np.random.default_rng(1)
        for episode in range(3):
            qpos, qvel = env.data.qpos + 0.1 * episode * rng.uniform(-1, 1, 24), rng.uniform(-1, 1, 23)
            env.set_state(qpos, qvel)
            lesson.set_state(qpos, qvel)
            for _ in range(50):
                action = rng.uniform(-0.4, 0.4, 17)
                obs, reward, *_ = env.step(action)
                other, other_reward, *_ = lesson.step(action)
                assert obs.tobytes() == other.tobytes()
                assert reward == other_reward


def test_a_force_lifts_the_torso_for_a_while() -> None:
    with mjenv.make(LESSON, lift=350, strict=False) as env:
        env.reset(seed=1)
        forces = []
        while env.data.time < 1.6:
            env.step(np.zeros(17))
            forces.append(env.data.xfrc_applied[1, 2])
        assert max(forces) == 350
        assert forces[-1] == 0


def test_a_row_can_begin_upright() -> None:
    with mjenv.make(LESSON, upright=1, strict=False) as env:
        env.reset(seed=1)
        assert env.data.qpos[2] == 1.22
        terminated = False
        while not terminated:  # without a policy, it falls
            terminated = env.step(np.zeros(17))[2]
        assert env.data.qpos[2] < 0.85


def test_the_policy_stands_up() -> None:
    """What docs/training.md states: it stands within 3 s, and until the end of the episode."""
    policy = Policy.load(HERE.parent / "policies" / f"{ID}.txt")
    with mjenv.make(ID) as env:
        for seed in range(3):
            obs, _ = env.reset(seed=seed)
            heights = []
            for _ in range(1000):
                obs, *_ = env.step(policy.act(obs))
                heights.append(env.data.qpos[2])
            assert heights[0] < 0.2
            assert min(heights[200:]) > 1.1
