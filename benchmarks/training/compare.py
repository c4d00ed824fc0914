"""Trains on mjenv and on Gymnasium side by side, checks that both learn the same, and draws return over wall time.

    compare.py [--trainer cleanrl|sb3] [--steps N] [--out FOLDER] [--policies FOLDER] [ID ...]
    compare.py --draw [--trainer cleanrl|sb3] [--out FOLDER]

The two trainings of an id run at the same time, each on a CPU of its own. Their curves over steps and the policies
that they save must be equal, every digit; only the wall times may differ. Writes OUT/TRAINER.csv and OUT/TRAINER.svg;
--draw draws again from the CSV; --policies keeps the policies. The Python of `tools/setup training` has all it needs
but mjenv.
"""

from __future__ import annotations

import argparse
import csv
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mjenv_learn import svg as svg

EXAMPLES = Path(__file__).resolve().parents[2] / "extras/curricula/python"
IDS = ("InvertedPendulum-v5", "Reacher-v5", "Hopper-v5")
BACKENDS = ("mjenv", "gymnasium")
COLUMNS = ("id", "steps", "mean_return", "mjenv_seconds", "gymnasium_seconds")


@dataclass(frozen=True)
class Point:
    id: str
    steps: int
    mean_return: float
    mjenv_seconds: float
    gymnasium_seconds: float


def train_both(trainer: str, id: str, folder: Path, steps: int | None = None) -> list[Point]:
    """Trains on both, checks that everything except the wall times is equal, and returns the curve."""
    cpus = sorted(os.sched_getaffinity(0))
    running = []
    for index, backend in enumerate(BACKENDS):
        command = [sys.executable, EXAMPLES / f"train_{trainer}.py", id, "--backend", backend]
        if steps:
            command += ["--steps", str(steps)]
        cpu = cpus[index % len(cpus)]
        command = ["taskset", "--cpu-list", str(cpu), *command, "--out", folder / backend]
        running.append(subprocess.Popen([*map(str, command)]))
    for process in running:
        if process.wait():
            raise SystemExit(f"{process.args} ended with {process.returncode}")
    return joined(id, folder)


def joined(id: str, folder: Path) -> list[Point]:
    """Joins the two curves, which must be equal except for the wall times, as must the policies."""
    curves = [list(csv.DictReader((folder / backend / "curve.csv").open())) for backend in BACKENDS]
    learned = [[(row["steps"], row["mean_return"]) for row in curve] for curve in curves]
    if learned[0] != learned[1]:
        first = next(pair for pair in zip(*learned, strict=False) if pair[0] != pair[1])
        raise SystemExit(f"{id}: the curves differ: {first}")
    policies = [(folder / backend / "policy.txt").read_bytes() for backend in BACKENDS]
    if policies[0] != policies[1]:
        raise SystemExit(f"{id}: the policies differ")
    return [
        Point(id, int(ours["steps"]), float(ours["mean_return"]), float(ours["seconds"]), float(theirs["seconds"]))
        for ours, theirs in zip(*curves, strict=True)
    ]


def write(path: Path, points: Sequence[Point]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows([getattr(point, column) for column in COLUMNS] for point in points)


def read(path: Path) -> list[Point]:
    with path.open() as file:
        return [
            Point(row["id"], int(row["steps"]), *(float(row[column]) for column in COLUMNS[2:]))
            for row in csv.DictReader(file)
        ]


def draw(path: Path, points: Sequence[Point]) -> None:
    """One panel for each id: return over wall time with both backends."""
    panels = []
    for id in dict.fromkeys(point.id for point in points):
        own = [point for point in points if point.id == id and point.mean_return == point.mean_return]
        lines = [
            svg.Line("mjenv", [(point.mjenv_seconds, point.mean_return) for point in own]),
            svg.Line("Gymnasium", [(point.gymnasium_seconds, point.mean_return) for point in own]),
        ]
        panels.append(svg.Panel(f"{id}, {own[-1].steps:,} steps", "wall time, s", "mean return of 20 episodes", lines))
    path.write_text(svg.drawing(panels))


def summary(points: Sequence[Point]) -> None:
    print(f"{'id':22} {'steps':>8} {'return':>9} {'mjenv':>9} {'Gymnasium':>10} {'ratio':>6}")
    for id in dict.fromkeys(point.id for point in points):
        last = [point for point in points if point.id == id][-1]
        ratio = last.gymnasium_seconds / last.mjenv_seconds
        print(
            f"{id:22} {last.steps:8} {last.mean_return:9.2f} {last.mjenv_seconds:7.1f} s "
            f"{last.gymnasium_seconds:8.1f} s {ratio:6.2f}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("id", nargs="*", default=IDS)
    parser.add_argument("--trainer", choices=("cleanrl", "sb3"), default="cleanrl")
    parser.add_argument("--steps", type=int, help="environment steps, instead of the trainers' own numbers")
    parser.add_argument("--out", type=Path, default=Path(__file__).resolve().parent)
    parser.add_argument("--policies", type=Path, help="a folder to keep the trained policies in")
    parser.add_argument("--draw", action="store_true", help="draw again what was measured")
    given = parser.parse_args()
    table = given.out / f"{given.trainer}.csv"
    if not given.draw:
        points = [point for point in (read(table) if table.exists() else []) if point.id not in given.id]
        for id in given.id:
            with tempfile.TemporaryDirectory() as folder:
                points += train_both(given.trainer, id, Path(folder), given.steps)
                if given.policies:
                    shutil.copy(Path(folder) / "mjenv" / "policy.txt", given.policies / f"{id}.txt")
        order = {id: index for index, id in enumerate(IDS)}
        write(table, sorted(points, key=lambda point: order.get(point.id, len(order))))
    points = read(table)
    draw(table.with_suffix(".svg"), points)
    summary(points)


if __name__ == "__main__":
    main()
