"""Compares rows with masses and frictions of their own with rows that share them, and with mujoco.batch.

All take turns in short blocks; benchmarks/rows/run calls it. mujoco.batch, which computes the physics alone, has the
same values in expanded fields. The ratios are medians over the rounds.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import os
from pathlib import Path
from statistics import geometric_mean, median

from common import ROBOTS, Worker, cpu_model, rates_in_turns

WORKER = Path(__file__).resolve().parents[1] / "peers" / "worker.py"
# Columns of the table, and the peers whose speeds they divide.
RATIOS = {
    "own / shared": ("mjenv-own", "mjenv"),
    "own / mujoco.batch, own": ("mjenv-own", "mujoco-batch-own"),
    "mujoco.batch, own / shared": ("mujoco-batch-own", "mujoco-batch"),
}
PEERS = ("mjenv", "mjenv-own", "mujoco-batch", "mujoco-batch-own")
FIELDS = "robot rows threads peer steps_per_second blocks about cpu date".split()


def start(peer: str, arguments: argparse.Namespace) -> Worker:
    environment = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
    if peer.startswith("mujoco"):
        return Worker(peer, [arguments.peers_python, str(WORKER), peer], environment)
    environment |= {"MJENV_LIBRARY": arguments.library, "PYTHONPATH": arguments.package}
    return Worker(peer, [arguments.reference_python, str(WORKER), peer], environment)


def main() -> None:
    parser = argparse.ArgumentParser(prog="benchmarks/rows/run own", description=__doc__)
    add = parser.add_argument
    add("--robots", nargs="+", choices=ROBOTS, default=ROBOTS, metavar="ROBOT", help=" ".join(ROBOTS))
    add("--rows", type=int, default=64, help="(64)")
    add("--threads", type=int, default=1, help="(1)")
    add("--seconds", type=float, default=0.2, help="of a block (0.2)")
    add("--rounds", type=int, default=15, help="blocks of each (15)")
    add("--output", type=Path, default=Path("build/rows"), help="folder of the CSV")
    for name in ("library", "package", "program", "reference-python", "peers-python"):
        add(f"--{name}", required=True, type=os.path.abspath, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    workers = [start(peer, arguments) for peer in PEERS]
    date = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    ratios: dict[str, list[float]] = {name: [] for name in RATIOS}
    print(f"| {arguments.rows} rows | {' | '.join(RATIOS)} |\n| --- |{' ---: |' * len(RATIOS)}")
    path = arguments.output / "own.csv"
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(FIELDS)
        for robot in arguments.robots:
            case = f"{robot}-v5 {arguments.rows} {arguments.threads} 1"
            rates = rates_in_turns(workers, case, arguments.seconds, arguments.rounds)
            for worker in workers:
                blocks = rates[worker.name]
                of_case = [robot, arguments.rows, arguments.threads, worker.name, f"{median(blocks):.0f}"]
                listed = " ".join(f"{rate:.0f}" for rate in blocks)
                writer.writerow([*of_case, listed, worker.about, cpu_model(), date])
            for name, (a, b) in RATIOS.items():
                ratios[name].append(median(x / y for x, y in zip(rates[a], rates[b], strict=True)))
            print(f"| {robot} | {' | '.join(f'{ratios[name][-1]:.3f}' for name in RATIOS)} |", flush=True)
    for worker in workers:
        worker.end()
    means = " | ".join(f"{geometric_mean(ratios[name]):.3f}" for name in RATIOS)
    print(f"| geometric mean | {means} |\n\nwrote {path}")


if __name__ == "__main__":
    main()
