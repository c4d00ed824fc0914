"""Runs every program of this folder on mjenv and on Gymnasium, and compares what the two print: run.py [PROGRAM...]."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

FOLDER = Path(__file__).parent
# Program, and the package without which it is skipped: some have no release for each Python.
PROGRAMS = {
    "classes": "ogbench", "with_gymnasium": "gymnasium", "with_sb3": "stable_baselines3", "with_torchrl": "torchrl",
    "with_tianshou": "tianshou", "with_skrl": "skrl", "with_rllib": "ray", "with_minari": "minari",
    "with_pufferlib": "pufferlib", "with_d3rlpy": "d3rlpy", "with_evotorch": "evotorch",
    "with_mamujoco": "gymnasium_robotics",
}  # fmt: skip
# No two runs of these are equal, on Gymnasium neither.
UNEQUAL = ("with_rllib",)


def output_of(program: str, side: str) -> str:
    command = [sys.executable, "-W", "ignore", str(FOLDER / f"{program}.py"), side]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1800, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{program} {side}: ended with {done.returncode}\n{done.stdout}{done.stderr}")
    return "\n".join(line for line in done.stdout.splitlines() if line.startswith("> "))


def main() -> None:
    os.environ.setdefault("MUJOCO_GL", "egl")
    ran = 0
    for program in sys.argv[1:] or PROGRAMS:
        if find_spec(PROGRAMS[program]) is None:
            print(f"{program}: skipped, without {PROGRAMS[program]}", flush=True)
            continue
        ours, theirs = (output_of(program, side) for side in ("mjenv", "gymnasium"))
        is_unequal = program in UNEQUAL and theirs != output_of(program, "gymnasium")
        if ours != theirs and not is_unequal:
            raise SystemExit(f"{program}: mjenv printed\n{ours}\nand Gymnasium\n{theirs}")
        print(f"{program}: {'ran; two runs on Gymnasium differ, too' if is_unequal else 'equal'}", flush=True)
        ran += 1
    print(f"{ran} passed")


if __name__ == "__main__":
    main()
