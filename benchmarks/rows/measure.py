"""Measures what many rows cost beyond physics, and compares threads with processes; benchmarks/rows/run calls it.

Beyond physics: of the instructions inside mjenv_step those that are not inside functions of MuJoCo, as callgrind counts
them. Threads: rows stepped by one process with two threads, and by two
processes with one thread and half of the rows each, in turns.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import geometric_mean, median

from common import ROBOTS, cpu_model

FIELDS = "robot rows beyond_physics_percent threads_to_processes blocks cpu date".split()


class Steps:
    """A process of benchmarks/steps.c."""

    def __init__(self, arguments: argparse.Namespace) -> None:
        self._process = subprocess.Popen(
            [arguments.program, arguments.library], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def tell(self, command: str) -> None:
        assert self._process.stdin
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()

    def answer(self) -> str:
        assert self._process.stdout
        line = self._process.stdout.readline()
        if not line:
            sys.exit("benchmarks/steps.c failed, see above")
        return line

    def rate(self) -> float:
        steps, seconds = self.answer().split()
        return int(steps) / float(seconds)


def threads_to_processes(arguments: argparse.Namespace, robot: str) -> list[float]:
    """For each round, the speed of two threads divided by that of two processes."""
    threaded, *single = workers = [Steps(arguments) for _ in range(3)]
    threaded.tell(f"open {robot}-v5 {arguments.rows} 2 1")
    for worker in single:
        worker.tell(f"open {robot}-v5 {arguments.rows // 2} 1 1")
    for worker in workers:
        worker.answer()

    def rate(those: list[Steps]) -> float:
        for worker in those:
            worker.tell(f"run {arguments.seconds}")
        return sum(worker.rate() for worker in those)

    ratios = []
    for turn in range(arguments.rounds):
        if turn % 2:
            of_processes, of_threads = rate(single), rate([threaded])
        else:
            of_threads, of_processes = rate([threaded]), rate(single)
        ratios.append(of_threads / of_processes)
    for worker in workers:
        worker.tell("close")
        worker.answer()
    return ratios


def with_symbols(library: str, folder: str) -> str:
    """A copy of the library with its symbols but without line numbers, which not every valgrind can read."""
    path = Path(library).resolve()
    debug, copy = path.with_name(f"{path.name}.debug"), f"{folder}/libmjenv.so"
    if debug.exists():
        subprocess.run(["eu-unstrip", path, debug, "-o", copy], check=True)
    else:
        shutil.copy(path, copy)
    subprocess.run(["objcopy", "--strip-debug", copy], check=True)
    return copy


def beyond_physics(arguments: argparse.Namespace, robot: str) -> float:
    """The cost beyond physics, in percent of the physics. Counts instructions, so one run suffices."""
    with tempfile.TemporaryDirectory() as folder:
        library, counts = with_symbols(arguments.library, folder), Path(folder) / "counts"
        counter = ["valgrind", "--tool=callgrind", "--toggle-collect=mjenv_step", f"--callgrind-out-file={counts}"]
        command = [*counter, arguments.program, library]
        subprocess.run(
            command, input=f"open {robot}-v5 {arguments.rows} 1 1\n", text=True, check=True, capture_output=True
        )
        total, physics = counted(counts.read_text())
    if not physics:
        sys.exit(f"{arguments.library} has no symbols of MuJoCo, by which its share could be told")
    return 100 * (total / physics - 1)


def counted(text: str) -> tuple[int, int]:
    """The instructions of all functions, and of mjenv's calls of MuJoCo's functions, with all that these call."""
    names: dict[str, str] = {}
    total = physics = 0
    caller, callee = "", None
    for line in text.splitlines():
        if named := re.fullmatch(r"(c?fn)=(\(\d+\))(?: (.*))?", line):
            kind, number, name = named.groups()
            name = names.setdefault(number, name)
            caller, callee = (name, None) if kind == "fn" else (caller, name)
        elif cost := re.fullmatch(r"[+*-]?\d* (\d+)", line):
            if callee is None:
                total += int(cost[1])
            elif "mjenv::" in caller and callee.startswith("mj_"):
                physics += int(cost[1])
            callee = None
    return total, physics


def main() -> None:
    parser = argparse.ArgumentParser(prog="benchmarks/rows/run", description=__doc__)
    add = parser.add_argument
    add("--robots", nargs="+", choices=ROBOTS, default=ROBOTS, metavar="ROBOT", help=" ".join(ROBOTS))
    add("--rows", type=int, default=64, help="(64)")
    add("--seconds", type=float, default=0.2, help="of a block (0.2)")
    add("--rounds", type=int, default=15, help="blocks of the threads and of the processes (15)")
    add("--output", type=Path, default=Path("build/rows"), help="folder of the CSV")
    add("--library", required=True, help=argparse.SUPPRESS)
    add("--program", required=True, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    date = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    ratios = []
    print("| robot | beyond physics | two threads / two processes |\n| --- | ---: | ---: |")
    with (arguments.output / "rows.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(FIELDS)
        for robot in arguments.robots:
            beyond = beyond_physics(arguments, robot)
            blocks = threads_to_processes(arguments, robot)
            ratios.append(median(blocks))
            listed = " ".join(f"{ratio:.3f}" for ratio in blocks)
            row = [robot, arguments.rows, f"{beyond:.2f}", f"{ratios[-1]:.3f}", listed, cpu_model(), date]
            writer.writerow(row)
            print(f"| {robot} | {beyond:.2f} % | {ratios[-1]:.3f} |", flush=True)
    print(f"| geometric mean | | {geometric_mean(ratios):.3f} |\n\nwrote {arguments.output / 'rows.csv'}")


if __name__ == "__main__":
    main()
