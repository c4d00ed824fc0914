"""Trains with the native learner and with train_cleanrl.py, both on one thread, and compares CPU time and returns.

    learner.py [ID ...] [--seeds 1 2 3] [--alone] [--steps N]

Both have the same settings and numbers of steps. For each id and seed the two trainings follow each other. Prints the
CPU seconds of each process, start-up included, and the mean and standard deviation of the returns of the deterministic
policy over 20 episodes, which begin with the resets of the seeds 100 to 119. --alone leaves the script out, which needs
the Python of `tools/setup torch`.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import mjenv

SCRIPT = Path(__file__).resolve().parents[2] / "examples" / "python" / "train_cleanrl.py"
IDS = tuple(path.stem for path in sorted((SCRIPT.parents[1] / "policies").glob("*.txt")))
EPISODES, SEED = 20, 100


def cpu_seconds(command: list[str]) -> float:
    """The CPU time of a command and its threads."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(name: str, command: list[str], id: str, seed: int, steps: int | None) -> float:
    """Trains by a command, prints a line, and returns the CPU time."""
    with tempfile.TemporaryDirectory() as folder:
        more = ["--steps", str(steps)] if steps else []
        seconds = cpu_seconds([sys.executable, *command, id, "--seed", str(seed), "--out", folder, *more])
        played = mjenv.evaluate(Path(folder) / "policy.txt", EPISODES, seed=SEED)
    print(
        f"{id:26} {seed:4} {name:8} {seconds:8.2f} s  {played.mean_return:12,.1f} +- {played.std_return:,.1f}",
        flush=True,
    )
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("id", nargs="*", default=IDS)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--steps", type=int, help="instead of those of the settings")
    parser.add_argument("--alone", action="store_true")
    given = parser.parse_args()
    for id in given.id:
        for seed in given.seeds:
            ours = measure("learner", ["-m", "mjenv", "train"], id, seed, given.steps)
            if not given.alone:
                theirs = measure("script", [str(SCRIPT)], id, seed, given.steps)
                print(f"{id:26} {seed:4} ratio    {theirs / ours:8.2f}", flush=True)


if __name__ == "__main__":
    main()
