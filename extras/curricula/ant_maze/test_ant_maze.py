"""Tests of AntMazeLesson-v0, and of the policy of AntMaze_UMaze-v5 that was trained with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import dist
from pathlib import Path

import numpy as np
import pytest

import mjenv
from mjenv.gym.env import Environment

ID, LESSON = "mazes/AntMaze_UMaze-v5", "AntMazeLesson-v0"
STILL = np.zeros(8)


@pytest.fixture(scope="module", autouse=True)
def plugin(load_plugin: Callable[[str], Path]) -> Path:
    return load_plugin("ant_maze")


@pytest.fixture
def lesson() -> Iterator[Environment]:
    with mjenv.make(LESSON, xml_string=mjenv.model_xml(ID), strict=False) as env:
        env.reset(seed=1)
        yield env


def test_observations_are_those_of_the_maze(lesson: Environment) -> None:
    """From the same states."""
    rng = np.random.default_rng(1)
    with mjenv.make(ID, strict=False) as env:
        obs, _ = env.reset(seed=1)
        assert list(lesson.observation_space) == list(obs)
        for _ in range(3):
            qpos, qvel = env.data.qpos.copy(), rng.uniform(-1, 1, 14)
            for each in (env, lesson):
                each.data.qacc_warmstart[:] = 0
                each.set_state(qpos, qvel)
            for _ in range(50):
                action = rng.uniform(-1, 1, 8)
                obs, other = env.step(action)[0], lesson.step(action)[0]
                for name in ("observation", "achieved_goal"):
                    assert obs[name].tobytes() == other[name].tobytes()


def test_reward_is_the_velocity_along_the_way(lesson: Environment) -> None:
    rewards = []
    for seed in range(100):
        obs, _ = lesson.reset(seed=seed)
        start, goal = obs["achieved_goal"], obs["desired_goal"]
        obs, reward, *_ = lesson.step(STILL)
        end = obs["achieved_goal"]
        if min(start[1], end[1]) >= 3 and goal[1] <= -3 and max(start[0], end[0], goal[0]) < 3:  # around both corners
            rewards.append((reward, dist(start, (3, 3)) - dist(end, (3, 3))))
        elif min(start[1], end[1], goal[1]) >= 3:  # straight
            rewards.append((reward, dist(start, goal) - dist(end, goal)))
    assert len(rewards) > 20
    for reward, nearer in rewards:
        assert reward == pytest.approx(0.3 + nearer / lesson.dt)


def test_a_goal_that_is_reached_moves(lesson: Environment) -> None:
    qpos = lesson.data.qpos.copy()
    qpos[:2] = goal = lesson.observe()["desired_goal"]
    lesson.set_state(qpos, np.zeros(14))
    obs, reward, terminated, _, info = lesson.step(STILL)
    assert info["success"]
    assert reward > 10
    assert not terminated
    assert dist(obs["desired_goal"], goal) > 1.5


def test_an_ant_that_lies_on_its_back_has_fallen(lesson: Environment) -> None:
    qpos = lesson.data.qpos.copy()
    qpos[3:7] = 0, 1, 0, 0
    lesson.set_state(qpos, np.zeros(14))
    assert lesson.step(STILL)[2]


def test_the_policy_reaches_goals() -> None:
    """What docs/mazes.md states."""
    assert mjenv.evaluate(Path(__file__).with_name("policy.txt"), episodes=100).mean_return >= 0.8
