"""A PointMaze can be learnt: with hindsight experience replay of Stable-Baselines3, and with mjenv's learner."""

import sys
from pathlib import Path

import pytest

import mjenv

sys.path.append(str(Path(__file__).parents[2] / "examples"))
import her

ID = "mazes/PointMaze_UMaze-v3"


def test_hindsight() -> None:
    assert her.reached(her.train(ID), ID) >= 0.9


def test_learner() -> None:
    pytest.importorskip("mjenv_learn")
    settings = {"rows": 256, "gamma": 0.99}
    training = mjenv.train(ID, steps=1_000_000, seed=1, settings=settings, continuing_task=False)
    assert mjenv.evaluate(training.policy()).mean_return >= 0.9
