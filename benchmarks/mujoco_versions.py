"""Measures how far mjenv is from Gymnasium on the MuJoCo that is installed beside it; prints a table in Markdown.

Each v5 id is reset with seed 42 and steps under the actions that the action space samples after seed 42, also after the
robot has fallen. Printed is the largest difference in the observation after the reset and after 1, 10 and 100 steps.
"""

from __future__ import annotations

import warnings

import gymnasium
import mujoco
import numpy as np

import mjenv

STEPS = (0, 1, 10, 100)


def distances(id: str) -> list[float]:
    """The largest differences after each of STEPS."""
    theirs = gymnasium.make(id, disable_env_checker=True).unwrapped
    ours = mjenv.make(id, strict=False)
    ours.action_space.seed(42)
    pairs = [(theirs.reset(seed=42)[0], ours.reset(seed=42)[0])]
    for _ in range(STEPS[-1]):
        action = ours.action_space.sample()
        pairs.append((theirs.step(action)[0], ours.step(action)[0]))
    return [float(np.abs(np.subtract(*pairs[step])).max()) for step in STEPS]


def main() -> None:
    warnings.simplefilter("ignore")
    print(f"MuJoCo {mujoco.__version__}, Gymnasium {gymnasium.__version__}, mjenv {mjenv.version()}\n")
    print("| id | first observation | " + " | ".join(f"{step} step{'s' * (step > 1)}" for step in STEPS[1:]) + " |")
    print("|---|" + "---:|" * len(STEPS))
    for id in mjenv.ids():
        if id.endswith("-v5"):
            print(f"| {id} | " + " | ".join(f"{value:.0e}" if value else "0" for value in distances(id)) + " |")


if __name__ == "__main__":
    main()
