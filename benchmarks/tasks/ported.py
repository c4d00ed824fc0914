"""Compares the speeds of the class of docs/port.md on Gymnasium and of its ports, whose code it takes from that page.

    ported.py [--rounds 9] [--seconds 0.5] [--out FILE.csv]

Needs the Python of `tools/setup reference`, mjenv, and CMAKE_PREFIX_PATH or mjenv_DIR of an installed library. All of
them step on one thread, in turns in one process. The time is that of the CPU, so that other programs matter little.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import gymnasium
import numpy as np

import mjenv

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "benchmarks"), str(ROOT / "tests" / "docs")]

from blocks import blocks_of  # noqa: E402
from common import cpu_model  # noqa: E402

ROWS = (1, 16, 256)
FIELDS = ("task", "rows", "ratio", "lowest", "highest", "rounds", "cpu", "date")


def prepare(folder: Path) -> None:
    """Writes the files of the page, builds its plug-in and loads all its tasks."""
    for block in blocks_of("docs/port.md"):
        if block.title:
            (folder / block.title).parent.mkdir(exist_ok=True)
            (folder / block.title).write_text(block.text)
    source = folder / "ported"
    for command in (["-S", source, "-B", source / "build"], ["--build", source / "build"]):
        subprocess.run(["cmake", *map(str, command)], check=True, stdout=subprocess.DEVNULL)
    mjenv.load_tasks(source / "build" / "libleg.so")
    sys.path.append(str(source))
    import numpy_leg  # noqa: F401  # registers NumpyLeg-v0

    gymnasium.register("GymnasiumLeg-v0", "gymnasium_leg:JumpingLeg", max_episode_steps=250)


def makers(rows: int) -> dict[str, Callable[[], Any]]:
    if rows == 1:
        return {
            "Gymnasium": lambda: gymnasium.make("GymnasiumLeg-v0", disable_env_checker=True),
            "NumPy": lambda: mjenv.make("NumpyLeg-v0"),
            "C++": lambda: mjenv.make("CppLeg-v0"),
        }
    return {
        "Gymnasium": lambda: gymnasium.make_vec("GymnasiumLeg-v0", rows, vectorization_mode="sync"),
        "NumPy": lambda: mjenv.make_vec("NumpyLeg-v0", rows, num_threads=1),
        "C++": lambda: mjenv.make_vec("CppLeg-v0", rows, num_threads=1),
    }


class Player:
    def __init__(self, env: Any, rows: int) -> None:
        self._env, self._rows = env, rows
        shape = env.action_space.shape
        self._actions = list(np.random.default_rng(0).uniform(-1, 1, (100, *shape)).astype(np.float32))
        env.reset(seed=0)

    def rate(self, seconds: float) -> float:
        """Steps per second of CPU time."""
        steps, start = 0, time.process_time()
        while (spent := time.process_time() - start) < seconds:
            for action in self._actions:
                _, _, terminated, truncated, _ = self._env.step(action)
                if self._rows == 1 and (terminated or truncated):
                    self._env.reset()
            steps += len(self._actions) * self._rows
        return steps / spent


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--seconds", type=float, default=0.5, help="of each turn")
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "results" / "ported.csv")
    given = parser.parse_args()
    date = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    with tempfile.TemporaryDirectory() as folder, given.out.open("w", newline="") as file:
        prepare(Path(folder))
        table = csv.DictWriter(file, FIELDS, lineterminator="\n")
        table.writeheader()
        for rows in ROWS:
            players = {name: Player(make(), rows) for name, make in makers(rows).items()}
            rounds = [{name: each.rate(given.seconds) for name, each in players.items()} for _ in range(given.rounds)]
            for name in ("NumPy", "C++"):
                ratios = [rates[name] / rates["Gymnasium"] for rates in rounds]
                middle, low, high = (f"{value:.2f}" for value in (median(ratios), min(ratios), max(ratios)))
                print(f"{name:6} {rows:3} rows: {middle} times Gymnasium ({low} to {high})")
                values = name, rows, middle, low, high, given.rounds, cpu_model(), date
                table.writerow(dict(zip(FIELDS, values, strict=True)))


if __name__ == "__main__":
    main()
