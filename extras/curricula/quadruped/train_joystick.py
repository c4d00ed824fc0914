"""Trains the joystick task by mjenv's own learner, and writes the policy and the curve into the folder `trained`.

python train_joystick.py PLUGIN [--out FOLDER] [--steps STEPS]
"""

from __future__ import annotations

import argparse

import mjenv
from joystick_options import ID, OPTIONS
from mjenv_learn.training import Training

STEPS = 1_871_872
SETTINGS = {
    "rows": 64,
    "rollout_steps": 64,
    "epochs": 5,
    "minibatch_size": 512,
    "learning_rate": 5e-4,
    "final_learning_rate": 5e-5,
    "decay_steps": 2_500_000,
    "gamma": 0.98,
    "initial_std": 0.4,
    "hidden": (64, 64),
    "activation": "elu",
}


def report(training: Training) -> None:
    point = training.curve[-1]
    print(f"{point.steps} steps: return {point.mean_return:.0f}, length {point.mean_length:.0f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("plugin")
    parser.add_argument("--out", default="trained")
    parser.add_argument("--steps", type=int, default=STEPS)
    arguments = parser.parse_args()
    mjenv.load_tasks(arguments.plugin)
    out, steps = arguments.out, arguments.steps
    mjenv.train(ID, steps=steps, settings=SETTINGS, out=out, callback=report, every=20, **OPTIONS)


if __name__ == "__main__":
    main()
