"""Plays 20 episodes in which the robot has to walk forward at 0.5 m/s, and prints how far from that it walks. Then
plays 100 episodes with commands from the whole ranges of the options, and prints their mean return.

python evaluate.py PLUGIN [POLICY]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import mjenv
from mjenv_learn.policy import Policy
from mjenv_learn.training import Evaluation

HERE = Path(__file__).resolve().parent
ID = "QuadrupedVelocity-v0"
COMMANDED = 0.5  # m/s
FORWARD = {"command_forward": (COMMANDED, COMMANDED), "command_left": (0, 0), "command_turn": (0, 0)}
EPISODES, STEPS, STARTING = 20, 500, 50


@dataclass(frozen=True)
class Result:
    """The results of 20 episodes. The errors are means over rows and time of the distance from 0.5 m/s."""

    falls: int
    error: float  # of whole episodes
    error_after_start: float  # without the first second
    mean_speed: float  # after the first second


def evaluate(policy: Policy, seed: int = 1000, **options: Any) -> Result:
    envs = mjenv.make_vec(ID, EPISODES, **FORWARD, **options)
    obs, _ = envs.reset(seed=seed)
    speeds, fallen = [], np.zeros(EPISODES, bool)
    for _ in range(STEPS):
        obs, _, terminated, _, infos = envs.step(policy.act(obs))
        fallen |= terminated
        speeds.append(infos["forward"])
    speed = np.array(speeds)
    error = np.abs(speed - COMMANDED)
    return Result(int(fallen.sum()), error.mean(), error[STARTING:].mean(), speed[STARTING:].mean())


def evaluate_all_commands(policy: Policy) -> Evaluation:
    return mjenv.evaluate(replace(policy, about={}), episodes=100, seed=100)  # the task's commands, not the training's


def main() -> None:
    mjenv.load_tasks(sys.argv[1])
    policy = Policy.load(Path(sys.argv[2]) if len(sys.argv) > 2 else HERE / "policy.txt")
    result, all_commands = evaluate(policy), evaluate_all_commands(policy)
    print(f"{result.falls} of {EPISODES} episodes ended in a fall")
    print(f"mean error {result.error:.3f} m/s; without the first second {result.error_after_start:.3f} m/s")
    print(f"mean velocity forward without the first second {result.mean_speed:.3f} m/s")
    falls = int((all_commands.lengths < STEPS).sum())
    print(f"all commands: {falls} of {len(all_commands.lengths)} episodes ended in a fall, ", end="")
    print(f"mean return {all_commands.mean_return:.1f}, standard deviation {all_commands.std_return:.1f}")


if __name__ == "__main__":
    main()
