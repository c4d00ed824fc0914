"""Plays 20 episodes of the joystick task on the hardest ground, and prints how far the robot is from its commands.

python evaluate_joystick.py PLUGIN [POLICY]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import mjenv
from joystick_options import ID, OPTIONS
from mjenv_learn.policy import Policy

HERE = Path(__file__).resolve().parent
EPISODES, STEPS, HARDEST = 20, 500, 5.0


@dataclass(frozen=True)
class Result:
    """The results of 20 episodes."""

    falls: int
    error: float  # m/s, the mean over all steps of all episodes


def evaluate(policy: Policy, level: float = HARDEST, seed: int = 1000, **options: Any) -> Result:
    ground = {"least_level": level, "most_level": level}
    envs = mjenv.make_vec(ID, EPISODES, **{**OPTIONS, **ground, **options}, autoreset_mode="disabled", strict=False)
    obs, _ = envs.reset(seed=seed)
    errors, playing, falls = [], np.ones(EPISODES, bool), 0
    for _ in range(STEPS):
        obs, _, terminated, _, infos = envs.step(policy.act(obs))
        errors += infos["error"][playing].tolist()
        falls += int((terminated & playing).sum())
        playing &= ~terminated
    return Result(falls, float(np.mean(errors)))


def main() -> None:
    mjenv.load_tasks(sys.argv[1])
    result = evaluate(Policy.load(Path(sys.argv[2]) if len(sys.argv) > 2 else HERE / "joystick" / "policy.txt"))
    print(f"{result.falls} of {EPISODES} episodes ended in a fall")
    print(f"mean distance from the commanded velocity {result.error:.3f} m/s")


if __name__ == "__main__":
    main()
