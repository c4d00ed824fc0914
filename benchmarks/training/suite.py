"""Trains the policies of extras/curricula/policies/dm_control with the native learner, and plays them.

    suite.py [TASK ...]          trains (default: all), and plays
    suite.py --play [TASK ...]   only plays

Writes extras/curricula/policies/dm_control/TASK-v0.txt. Prints what docs/training.md has in its table: the
steps and the CPU time of the training with the start of Python; and over 20 episodes from seed 100, the mean and the
standard deviation of the returns of the deterministic policy. Episodes have 1,000 steps, so a return is at most 1,000.
Needs mjenv with libmjenv-learn.so and libmjenv-dm_control.so beside its library.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import mjenv

POLICIES = Path(__file__).resolve().parents[2] / "extras/curricula/policies" / "dm_control"
EPISODES, SEED = 20, 100
# The settings that differ from the defaults of `mjenv train`.
SETTINGS = {
    "cartpole-swingup": "--steps 1500000 --initial-std 1 --rows 16 --rollout-steps 256 --epochs 10 "
    "--minibatch-size 512 --learning-rate 0.0005",
    "cheetah-run": "--steps 5000000",
    "finger-spin": "--steps 2000000 --initial-std 1",
    "fish-upright": "--steps 1500000 --initial-std 1",
    "reacher-easy": "--steps 2000000 --initial-std 1",
    "walker-walk": "--steps 4000000 --initial-std 1",
}


def train(task: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        command = ["-m", "mjenv", "train", f"dm_control/{task}-v0", *SETTINGS[task].split(), "--out", folder]
        subprocess.run([sys.executable, *command], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(f"{task}: {after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime:.0f} s of CPU time")
        (POLICIES / f"{task}-v0.txt").write_bytes((Path(folder) / "policy.txt").read_bytes())


def play(task: str) -> None:
    played = mjenv.evaluate(POLICIES / f"{task}-v0.txt", EPISODES, seed=SEED)
    print(f"{task}: {played.mean_return:.1f} +- {played.std_return:.1f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", nargs="*", default=list(SETTINGS))
    parser.add_argument("--play", action="store_true")
    given = parser.parse_args()
    for task in given.task:
        if not given.play:
            train(task)
        play(task)


if __name__ == "__main__":
    main()
