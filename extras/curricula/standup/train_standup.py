"""Trains HumanoidStandup-v5 by mjenv's own learner, and writes the policy and the curve into the folder `trained`.

python train_standup.py PLUGIN [--out FOLDER] [--steps STEPS]

PLUGIN: the library that standup.cpp was compiled to. First, all rows learn to keep their balance. Then most rows begin
lying, and a force helps them up, which becomes weaker while enough of these rows stay up without it.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

import mjenv
from mjenv_learn.policy import Policy
from mjenv_learn.training import Training

ID, LESSON = "HumanoidStandup-v5", "StandupLesson-v0"
STEPS, ROWS, UPRIGHT_ROWS = 12_000_000, 64, 16
SETTINGS = {"rows": ROWS, "learning_rate": 5e-4, "final_learning_rate": 5e-4, "window": 64}
SLOWEST, KL = 5e-5, 0.02  # the learning rate follows the distance between the policies before and after an update
LIFT, LESS = 350.0, 2.0  # the force at first, and how much weaker one update makes it, N
BALANCED = 250  # the mean length of episodes, in steps, with which lying begins
OLD, STAND = 3.0, 0.35  # the force becomes weaker if at least this share of the rows is older than 3 s


class Curriculum:
    """The callback of the training: which rows begin upright, the force and the learning rate."""

    def __init__(self) -> None:
        self.lift, self.standing, self.lying = LIFT, 0.0, np.zeros(ROWS, bool)

    def __call__(self, training: Training) -> None:
        point = training.curve[-1]
        if self.lying.any():
            self._weaken(training)
        elif point.mean_length > BALANCED:
            self.lying[UPRIGHT_ROWS:] = True
            training.envs.parameters["upright"][self.lying] = 0
        self._adjust_rate(training)
        if point.updates % 40 == 0:
            print(
                f"{point.steps} steps: return {point.mean_return:.0f}, length {point.mean_length:.0f}, "
                f"force {self.lift:.0f} N, standing {self.standing:.2f}, rate {training.settings.learning_rate:.1e}",
                flush=True,
            )

    def _weaken(self, training: Training) -> None:
        """Episodes that began lying end after 1.5 s unless the robot is up, so that old rows are rows that stand."""
        old = training.envs.data.time.reshape(-1)[self.lying] > OLD
        self.standing += 0.1 * (float(old.mean()) - self.standing)
        if self.standing > STAND:
            self.lift = max(0.0, self.lift - LESS)
            training.envs.parameters["lift"][:] = self.lift

    def _adjust_rate(self, training: Training) -> None:
        kl, rate = training.curve[-1].approx_kl, training.settings.learning_rate
        if kl > 1.5 * KL:
            rate = max(SLOWEST, rate / 1.1)
        elif kl < KL / 1.5:
            rate = min(SETTINGS["learning_rate"], rate * 1.1)
        if rate != training.settings.learning_rate:
            training.set(learning_rate=rate, final_learning_rate=rate)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("plugin")
    parser.add_argument("--out", type=Path, default=Path("trained"))
    parser.add_argument("--steps", type=int, default=STEPS)
    given = parser.parse_args()
    mjenv.load_tasks(given.plugin)
    options = {"upright": 1, "lift": LIFT}
    mjenv.train(LESSON, steps=given.steps, settings=SETTINGS, out=given.out, callback=Curriculum(), **options)
    path = given.out / "policy.txt"
    policy = Policy.load(path)
    replace(policy, id=ID, about={**policy.about, "options": {}}).save(path)  # it plays without the lesson's options


if __name__ == "__main__":
    main()
