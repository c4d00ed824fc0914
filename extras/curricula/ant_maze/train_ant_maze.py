"""Trains AntMaze_UMaze-v5 by mjenv's own learner, and writes the policy and the curve into the folder `trained`.

python train_ant_maze.py PLUGIN [--out FOLDER] [--steps STEPS]

PLUGIN: the library that ant_maze.cpp was compiled to.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import mjenv
from mjenv_learn.policy import Policy

ID, LESSON = "mazes/AntMaze_UMaze-v5", "AntMazeLesson-v0"
SETTINGS = {
    "rows": 128,
    "minibatch_size": 2048,
    "hidden": [128, 64],
    "scale_actions": False,
    "final_learning_rate": 1e-4,
    "initial_std": 0.5,
    "entropy_coef": 0.003,
    "window": 100,
}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("plugin")
    parser.add_argument("--out", type=Path, default=Path("trained"))
    parser.add_argument("--steps", type=int, default=16_000_000)
    given = parser.parse_args()
    mjenv.load_tasks(given.plugin)
    mjenv.train(LESSON, steps=given.steps, settings=SETTINGS, out=given.out, xml_string=mjenv.model_xml(ID))
    file = given.out / "policy.txt"
    policy = Policy.load(file)  # it plays in the maze as it is, where an episode ends at the goal
    replace(policy, id=ID, about={**policy.about, "options": {"continuing_task": False}}).save(file)


if __name__ == "__main__":
    main()
