"""Trains with the native learner and with train_cleanrl.py, both on one thread, and compares CPU time and returns.

    learner.py [ID ...] [--seeds 1 2 3] [--trainers learner script]     trains, and writes learner.csv
    learner.py --table                                                  prints learner.csv as tables
    learner.py --threads N [ID ...] [--steps 200000]                    wall time of one thread and N, in turns

Both trainers have the same settings and numbers of steps; for each id and seed they follow each other. learner.csv has
a line for each training: the CPU seconds of its process, start-up included, the mean and standard deviation of the
returns of the deterministic policy over 20 episodes, which begin with the resets of the seeds 100 to 119, and the
length of the shortest of them. For the learner it also has the CPU seconds and the steps after which the deterministic
policy first had a mean return of the id's goal over these episodes. It plays them up to 40 times while it is trained;
the CPU seconds do not contain that. The script needs the Python of `tools/setup torch`.
"""

from __future__ import annotations

import argparse
import csv
import math
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import astuple, dataclass, fields
from pathlib import Path

import mjenv
from mjenv_learn.training import Settings, Training

SCRIPT = Path(__file__).resolve().parents[2] / "extras/curricula/python" / "train_cleanrl.py"
IDS = tuple(path.stem for path in sorted((SCRIPT.parents[1] / "policies").glob("*.txt")))
TABLE = Path(__file__).with_suffix(".csv")
EPISODES, SEED = 20, 100
TRIALS = 40  # how often a policy plays at most, to see whether it reaches its goal
# Returns at which a robot hops, runs or walks well.
GOALS = {"Hopper-v5": 3000, "HalfCheetah-v5": 5000, "Ant-v5": 4000, "Walker2d-v5": 3000, "Humanoid-v5": 5000}


@dataclass(frozen=True)
class Result:
    """One training. goal_seconds and goal_steps are nan if the goal was not reached, or if there is none."""

    id: str
    seed: int
    trainer: str
    steps: int
    cpu_seconds: float
    mean_return: float
    std_return: float
    shortest: int
    goal_seconds: float = math.nan
    goal_steps: float = math.nan


def measure(id: str, seed: int, trainer: str) -> Result:
    with tempfile.TemporaryDirectory() as folder:
        command = [__file__, "--train"] if trainer == "learner" else [str(SCRIPT)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        made = subprocess.run(
            [sys.executable, *command, id, "--seed", str(seed), "--out", folder],
            check=True,
            text=True,
            stdout=subprocess.PIPE,
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        with (Path(folder) / "curve.csv").open() as curve:
            steps = [int(row["steps"]) for row in csv.DictReader(curve)][-1]
        played = mjenv.evaluate(Path(folder) / "policy.txt", EPISODES, seed=SEED)
    learned = trainer == "learner"
    goal_seconds, goal_steps, playing = map(float, made.stdout.split()) if learned else (math.nan, math.nan, 0.0)
    return Result(
        id,
        seed,
        trainer,
        steps,
        after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime - playing,
        played.mean_return,
        played.std_return,
        int(played.lengths.min()),
        goal_seconds,
        goal_steps,
    )


def train(id: str, seed: int, out: Path) -> None:
    """Trains as `mjenv train` does. Prints the CPU seconds and steps until the goal, and the CPU seconds of playing."""
    reached, played_for, goal = (math.nan, math.nan), 0.0, GOALS.get(id)
    settings = Settings.of(id)
    updates = settings.steps // (settings.rows * settings.rollout_steps)

    def play(training: Training) -> None:
        nonlocal reached, played_for
        if goal is None or not math.isnan(reached[0]):
            return
        seconds = time.process_time()
        if mjenv.evaluate(training.policy(), EPISODES, seed=SEED).mean_return >= goal:
            reached = seconds - played_for, training.steps
        played_for += time.process_time() - seconds

    mjenv.train(id, seed=seed, out=out, callback=play, every=max(1, updates // TRIALS))
    print(*reached, played_for)


def compare_threads(id: str, threads: int, steps: int) -> str:
    """How many times as fast N threads train: the median of the ratios of wall time of three rounds."""
    ratios = []
    for _ in range(3):
        seconds = []
        for count in (1, threads):
            start = time.perf_counter()
            mjenv.train(id, seed=1, steps=steps, threads=count)
            seconds.append(time.perf_counter() - start)
        ratios.append(seconds[0] / seconds[1])
    return f"{id}: {threads} threads are {statistics.median(ratios):.2f} times as fast as one"


def read() -> list[Result]:
    if not TABLE.exists():
        return []
    with TABLE.open() as file:
        return [
            Result(row["id"], int(row["seed"]), row["trainer"], int(row["steps"]), float(row["cpu_seconds"]),
                   float(row["mean_return"]), float(row["std_return"]), int(row["shortest"]),
                   float(row["goal_seconds"]), float(row["goal_steps"]))
            for row in csv.DictReader(file)
        ]  # fmt: skip


def keep(result: Result) -> None:
    """Writes a result into the table, in place of an earlier one of the same training."""
    key = (result.id, result.seed, result.trainer)
    others = [one for one in read() if (one.id, one.seed, one.trainer) != key]
    with TABLE.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(one.name for one in fields(Result))
        for one in sorted([*others, result], key=lambda one: (one.id, one.trainer, one.seed)):
            writer.writerow(f"{value:.6g}" if isinstance(value, float) else value for value in astuple(one))


def table(results: Iterable[Result]) -> Iterator[str]:
    """Markdown: times and returns beside the script's, and the times until the goals."""
    trainings: dict[str, dict[str, list[Result]]] = {}
    for one in results:
        trainings.setdefault(one.id, {}).setdefault(one.trainer, []).append(one)
    yield "| id | steps | CPU time | of the script | ratio | return by seed | of the script |"
    yield "|---|---:|---:|---:|---:|---|---|"
    ratios = []
    for id, by in trainings.items():
        learner, script = by["learner"], by["script"]
        seconds = [statistics.median(one.cpu_seconds for one in ones) for ones in (learner, script)]
        ratios.append(seconds[1] / seconds[0])
        times = f"{shown(seconds[0])} | {shown(seconds[1])} | {ratios[-1]:.1f}"
        yield f"| {id} | {learner[0].steps:,} | {times} | {returns_of(learner)} | {returns_of(script)} |"
    yield f"| geometric mean | | | | {statistics.geometric_mean(ratios):.1f} | | |"
    yield ""
    yield "| id | return | CPU time by seed | median |"
    yield "|---|---:|---|---:|"
    for id, goal in GOALS.items():
        times_of = [math.inf if math.isnan(one.goal_seconds) else one.goal_seconds for one in trainings[id]["learner"]]
        yield f"| {id} | {goal:,} | {' / '.join(map(shown, times_of))} | {shown(statistics.median_high(times_of))} |"


def returns_of(ones: list[Result]) -> str:
    digits = 1 if abs(ones[0].mean_return) < 100 else 0
    return " / ".join(f"{one.mean_return:,.{digits}f} ± {one.std_return:,.{digits}f}" for one in ones)


def shown(seconds: float) -> str:
    return "not reached" if math.isinf(seconds) else f"{seconds:.1f} s"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("id", nargs="*", default=IDS)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--trainers", nargs="+", choices=("learner", "script"), default=("learner", "script"))
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--threads", type=int)
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--train", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--seed", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.train:
        train(given.id[0], given.seed, given.out)
    elif given.table:
        print(*table(read()), sep="\n")
    elif given.threads:
        for id in given.id:
            print(compare_threads(id, given.threads, given.steps), flush=True)
    else:
        for id in given.id:
            for seed in given.seeds:
                for trainer in given.trainers:
                    result = measure(id, seed, trainer)
                    keep(result)
                    print(*astuple(result), flush=True)


if __name__ == "__main__":
    main()
