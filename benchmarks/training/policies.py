"""Trains the policies of extras/curricula/policies again, and plays them. Another script trains HumanoidStandup's.

    policies.py [ID ...]            trains (default: all), and plays and draws
    policies.py --play [ID ...]     only plays
    policies.py --draw              only draws

Writes extras/curricula/policies/ID.txt, and the curves to policies.csv and policies.svg beside this file. Prints what
docs/training.md has in its table: the CPU time of the training; and over 20 episodes from seed 100, the mean and the
standard deviation of the returns, and the length of the shortest episode.
"""

from __future__ import annotations

import argparse
import csv
import re
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mjenv_learn import svg as svg

ROOT = Path(__file__).resolve().parents[2]
POLICIES = ROOT / "extras/curricula/policies"
TABLE = Path(__file__).with_suffix(".csv")
POINTS = 60  # of each curve, to keep the file small
EPISODES, SEED = 20, 100
# The policies that `mjenv train` has made, and what it was given.
LEARNED: dict[str, tuple[str, ...]] = {
    "Ant-v5": (),
    "HalfCheetah-v5": (),
    "Hopper-v5": ("--seed", "3"),
    "Humanoid-v5": (),
    # Larger displacements at the start than those of the episodes that are played, so that those are within reach.
    "InvertedDoublePendulum-v5": tuple(
        "--option reset_noise_scale=0.3 --gamma 0.995 --learning-rate 0.0003 --steps 800000".split()
    ),
    "InvertedPendulum-v5": (),
    "Pusher-v5": (),
    "Reacher-v5": (),
    "Swimmer-v5": ("--seed", "3"),
    "Walker2d-v5": ("--seed", "4"),
}

# The policies that scripts of their own train, with curves of their own.
ELSEWHERE = {"HumanoidStandup-v5": "extras/curricula/standup/train_standup.py"}

sys.path.append(str(ROOT / "extras/curricula/python"))
from deploy import play  # noqa: E402
from mjenv_learn.policy import Policy  # noqa: E402


@dataclass(frozen=True)
class Point:
    id: str
    steps: int
    mean_return: float


def train(id: str) -> None:
    """Trains a policy, and puts it and its curve where they belong."""
    with tempfile.TemporaryDirectory() as folder:
        command = ("-m", "mjenv", "train", id, *LEARNED[id], "--out", folder)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *command], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(f"{id}: {after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime:.0f} s of CPU time")
        text = (Path(folder) / "policy.txt").read_text()
        # It plays without the training's options.
        (POLICIES / f"{id}.txt").write_text(re.sub(r'"options": \{.*?\}', '"options": {}', text, count=1))
        curve = thinned(id, Path(folder) / "curve.csv")
    write(sorted([*(point for point in read(TABLE) if point.id != id), *curve], key=lambda point: point.id))


def thinned(id: str, path: Path) -> list[Point]:
    """Points of a curve, evenly spread from the first with a finished episode to the last."""
    with path.open() as file:
        rows = [row for row in csv.DictReader(file) if row["mean_return"] != "nan"]
    count = min(POINTS, len(rows))
    chosen = [rows[round(index * (len(rows) - 1) / (count - 1))] for index in range(count)]
    return [Point(id, int(row["steps"]), float(row["mean_return"])) for row in chosen]


def read(path: Path) -> list[Point]:
    if not path.exists():
        return []
    with path.open() as file:
        return [Point(row["id"], int(row["steps"]), float(row["mean_return"])) for row in csv.DictReader(file)]


def write(points: Sequence[Point]) -> None:
    with TABLE.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("id", "steps", "mean_return"))
        writer.writerows((point.id, point.steps, f"{point.mean_return:.6g}") for point in points)


def draw(path: Path, points: Sequence[Point]) -> None:
    """A panel for each id: return over steps."""
    panels = []
    for id in dict.fromkeys(point.id for point in points):
        line = svg.Line(id, [(point.steps / 1e6, point.mean_return) for point in points if point.id == id])
        panels.append(svg.Panel(id, "steps, million", "mean return of 20 episodes", [line]))
    path.write_text(svg.drawing(panels))


def report(id: str) -> None:
    episodes = play(Policy.load(POLICIES / f"{id}.txt"), "mjenv", EPISODES, SEED)
    returns = [total for _, total, _ in episodes]
    deviation, shortest = statistics.pstdev(returns), min(length for length, _, _ in episodes)
    print(f"{id}: mean return {statistics.fmean(returns):.6g} +- {deviation:.4g}, shortest episode {shortest} steps")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("id", nargs="*")
    parser.add_argument("--play", action="store_true")
    parser.add_argument("--draw", action="store_true")
    given = parser.parse_args()
    for id in given.id or sorted(path.stem for path in POLICIES.glob("*.txt")):
        if given.draw:
            break
        if id in ELSEWHERE and not given.play:
            print(f"{id}: {ELSEWHERE[id]} trains this policy")
        elif not given.play:
            train(id)
        report(id)
    draw(TABLE.with_suffix(".svg"), read(TABLE))


if __name__ == "__main__":
    main()
