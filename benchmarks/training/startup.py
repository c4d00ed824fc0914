"""Measures the CPU time from the start of a process until the first update of `mjenv train`.

    startup.py [ID] [--runs 20]     Hopper-v5 by default
    startup.py [ID] --modules       how long it takes to import each module, except those that importlib imports by name

For comparison it measures Python alone, the imports of NumPy and Gymnasium, `import mjenv`, and startup.c, which does
the same as the command. The times are user and system time: medians of runs in turns, after one that fills the caches.
Needs the environment variable MJENV_LIBRARY, beside which libmjenv-learn.so is, and a C compiler.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
CACHED = {"PYTHONDONTWRITEBYTECODE": ""}  # as on a user's machine, modules are compiled once
# Runs `python -m mjenv train ID`, but ends where the first update would begin.
COMMAND = """
import os, runpy, sys
from mjenv_learn.training import Training
Training.update = lambda training: os._exit(0)
sys.argv[1:] = ["train", {id!r}, "--out", {out!r}]
runpy.run_module("mjenv", run_name="__main__", alter_sys=True)
"""


def compiled(folder: Path) -> Path:
    """The program of startup.c."""
    library, program = Path(os.environ["MJENV_LIBRARY"]).absolute(), folder / "startup"
    headers = [f"-I{SOURCE / part / 'include'}" for part in ("capi", "learn")]
    libraries = [library, library.with_name("libmjenv-learn.so"), f"-Wl,-rpath,{library.parent}"]
    command = ["cc", "-O2", *headers, Path(__file__).with_suffix(".c"), "-o", program, *libraries]
    subprocess.run(list(map(str, command)), check=True)
    return program


def cpu_seconds(command: list[str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env={**os.environ, **CACHED})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def import_seconds(command: list[str], runs: int) -> dict[str, float]:
    """How long each module takes to import without those that it imports: the least of the runs."""
    least: dict[str, float] = {}
    for _ in range(runs + 1):
        done = subprocess.run(command, check=True, text=True, capture_output=True, env={**os.environ, **CACHED})
        for own, name in re.findall(r"^import time: +(\d+) \| +\d+ \| +(\S+)$", done.stderr, re.MULTILINE):
            least[name] = min(least.get(name, 1e6), int(own) / 1e6)
    return least


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("id", nargs="?", default="Hopper-v5")
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--modules", action="store_true")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        train = COMMAND.format(id=given.id, out=f"{folder}/trained")
        if given.modules:
            found = import_seconds([sys.executable, "-X", "importtime", "-c", train], given.runs)
            for name, seconds in sorted(found.items(), key=lambda item: -item[1]):
                print(f"{1000 * seconds:6.2f} ms  {name}")
            print(f"{1000 * sum(found.values()):6.2f} ms  all {len(found)} modules")
            return
        commands = {
            "Python alone": [sys.executable, "-c", "pass"],
            "import numpy": [sys.executable, "-c", "import numpy"],
            "import gymnasium, with NumPy": [sys.executable, "-c", "import gymnasium"],
            "import mjenv": [sys.executable, "-c", "import mjenv"],
            "mjenv train until the first update": [sys.executable, "-c", train],
            "the same in C": [str(compiled(Path(folder))), given.id],
        }
        seconds: dict[str, list[float]] = {name: [] for name in commands}
        for run in range(given.runs + 1):
            for name, command in commands.items():
                taken = cpu_seconds(command)
                if run:
                    seconds[name].append(taken)
    print(f"Python {sys.version.split()[0]}, {given.id}, medians of {given.runs} runs")
    for name, taken_by in seconds.items():
        print(f"{1000 * statistics.median(taken_by):6.1f} ms  {name}")


if __name__ == "__main__":
    main()
