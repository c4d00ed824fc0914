"""Measures what the options cost that compute Gymnasium's wrappers: history, time_aware, clip_actions, rescale_actions.

Environments without and with each option take turns in short blocks of steps with the same actions, on one thread;
benchmarks/rows/run calls it. Each figure is the median over the rounds of the CPU time with the option divided by the
time without, measured one after the other.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

from common import cpu_model

OPTIONS: dict[str, dict[str, Any]] = {
    "history=3": {"history": 3},
    "time_aware=True": {"time_aware": True},
    "clip_actions=True": {"clip_actions": True},
    "rescale_actions=(-1, 1)": {"rescale_actions": (-1, 1)},
    "all four": {"history": 3, "time_aware": True, "clip_actions": True, "rescale_actions": (-1, 1)},
}


def measure(id: str, rows: int, steps: int, rounds: int) -> None:
    import numpy as np

    import mjenv

    all_envs = {name: mjenv.make_vec(id, rows, **options) for name, options in {"none": {}, **OPTIONS}.items()}
    space = all_envs["none"].single_action_space
    actions = np.random.default_rng(1).uniform(-0.9, 0.9, (steps, rows, *space.shape)).astype(space.dtype)
    times: dict[str, list[float]] = {name: [] for name in all_envs}
    for envs in all_envs.values():
        envs.reset(seed=1)
        for action in actions:  # warms up
            envs.step(action)
    for turn in range(rounds):
        for name, envs in [*all_envs.items()][:: 1 if turn % 2 == 0 else -1]:
            before = time.process_time()
            for action in actions:
                envs.step(action)
            times[name].append(time.process_time() - before)
    print(f"{rows} rows of {id}, {cpu_model()}\n\n| option | times as long |\n| --- | ---: |")
    for name in OPTIONS:
        print(f"| `{name}` | {median(a / b for a, b in zip(times[name], times['none'], strict=True)):.3f} |")


def main() -> None:
    parser = argparse.ArgumentParser(prog="benchmarks/rows/run options", description=__doc__)
    add = parser.add_argument
    add("--id", default="HalfCheetah-v5", help="(HalfCheetah-v5)")
    add("--rows", type=int, default=1024, help="(1024)")
    add("--steps", type=int, default=20, help="of a block (20)")
    add("--rounds", type=int, default=31, help="blocks of each (31)")
    add("--measure", action="store_true", help=argparse.SUPPRESS)
    for name in ("library", "package", "program", "reference-python"):
        add(f"--{name}", type=os.path.abspath, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.measure:
        measure(given.id, given.rows, given.steps, given.rounds)
        return
    package = os.pathsep.join((given.package, str(Path(__file__).parents[1])))
    environment = {**os.environ, "MJENV_LIBRARY": given.library, "PYTHONPATH": package, "OMP_NUM_THREADS": "1"}
    command = [given.reference_python, __file__, "--measure", *sys.argv[1:]]
    raise SystemExit(subprocess.run(command, env=environment).returncode)


if __name__ == "__main__":
    main()
