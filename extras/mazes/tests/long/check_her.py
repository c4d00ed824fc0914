"""Hindsight experience replay with Stable-Baselines3 learns a PointMaze."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "examples"))
import her


def test_point_maze() -> None:
    id = "mazes/PointMaze_UMaze-v3"
    assert her.reached(her.train(id, her.STEPS), id) >= 0.9
