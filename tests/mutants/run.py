#!/usr/bin/env python3
"""Judges whether the tests of core/ watch every line of the lane code: whether some test fails if a line is changed.

Builds all mutants (see rewrite.py) as one program for each version of MuJoCo, which judges them while it runs a test
(see mutants.hpp). The tests that take least time come first; each judges the mutants of the lines that no test before
it watches, or with --all the mutants that no test before it has killed. So a line of frame/ is watched if a test on one
of the versions watches it. What is known is kept in FOLDER/verdicts, so a run that was stopped goes on where it ended.
"""

from __future__ import annotations

import argparse
import collections
import enum
import hashlib
import json
import os
import re
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import repeat
from pathlib import Path
from typing import TypedDict

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SEEDS = 24
# The tests allocate and free much memory. If the C library returned it to the system, they would take twice as long.
KEEP_MEMORY = {
    "MALLOC_MMAP_MAX_": "0",
    "MALLOC_TRIM_THRESHOLD_": str(4 << 30),
    "MALLOC_TOP_PAD_": str(64 << 20),
    "GLIBC_TUNABLES": "glibc.malloc.hugetlb=1",
}


class Mutant(TypedDict):
    number: int
    file: str
    line: int
    function: str
    source: str  # the lines that the mutant changes
    text: str


def key(mutant: Mutant) -> str:
    """What names a mutant in equal.txt, also after lines have moved."""
    return f"{mutant['file']} {mutant['function']}: {mutant['text']}"


def source_of(mutant: Mutant) -> str:
    """What names a line in equal.txt."""
    return f"{mutant['file']}: {mutant['source']}"


def line_of(mutant: Mutant) -> tuple[str, int]:
    return mutant["file"], mutant["line"]


def topics_of(source: Path, long: bool) -> list[str]:
    """The topics of tests/core/run.cpp that this file tests: that of its name, but for those of its folder."""
    if source.parent.name == "lanes":
        return ["few-lanes", "lanes"] if long else ["few-lanes"]
    if source.parent.name == "twins":
        return ["twins"]
    return [] if source.stem in ("random_models", "run") else [source.stem]


def tests_of(folder: Path, long: bool) -> list[str]:
    """The arguments of test_core for each test."""
    tests = []
    for source in sorted((folder / "source/tests/core").glob("**/*.cpp")):
        names = re.findall(r"(?:cmocka_unit_test\w*|TEST)\(([\w:]+)", source.read_text())
        for topic in topics_of(source, long):
            tests += [f"{topic} {name}" for name in names]
    tests += [f"random-models {seed} 1" for seed in [*range(SEEDS), *range(1000, 1000 + 200 * long)]]
    return list(dict.fromkeys(tests))


class Verdict(enum.IntEnum):
    """What a test says of a mutant, as in mutants.hpp. The first three are open."""

    UNREACHED = 0
    SAME = 1
    UNFINISHED = 2
    SURVIVED = 3
    KILLED = 4
    SKIPPED = 5


# Most mutants are killed as soon as they compute other bits. So each test first has little time for each mutant.
SECONDS = 0.1


def version_of(test: str) -> str:
    """The folder of the lanes that a test tests, beside frame/."""
    return "mujoco4" if test.startswith("twins ") else "mujoco2"


class Judge:
    def __init__(self, folder: Path, only: str, all_mutants: bool) -> None:
        self.folder, self.programs = folder / "verdicts", folder / "programs"
        self.only, self.all_mutants = only, all_mutants
        self.folder.mkdir(parents=True, exist_ok=True)
        self.mutants: list[Mutant] = json.loads((folder / "mutants.json").read_text())
        self.verdicts: dict[str, bytearray] = {}
        self.killer: dict[int, str] = {}
        self.watched: set[tuple[str, int]] = set()  # the lines of which a mutant is killed
        self.seconds: dict[str, float] = {}
        lines = [line.strip() for line in (HERE / "equal.txt").read_text().splitlines()]
        self.equal = {line for line in lines if line and not line.startswith("#")}  # mutants and lines

    def path(self, test: str) -> Path:
        return self.folder / test.replace(" ", "+").replace(":", "")

    def program(self, test: str) -> Path:
        return self.programs / version_of(test) / "tests/core/test_core"

    def start(self, test: str, limit: float, **environment: str) -> int | None:
        """The exit status of a test; None if it did not end. Limits the CPU's time: a machine can pause."""
        limits = ["prlimit", f"--cpu={int(limit) + 1}", "--core=0", f"--data={8 << 30}"]
        try:
            return subprocess.run(
                [*limits, self.program(test), *test.split()],
                env={**os.environ, **KEEP_MEMORY, **environment},
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=60 + 20 * limit,
                check=False,
            ).returncode
        except subprocess.TimeoutExpired:
            return None

    def time(self, test: str) -> None:
        """Notes how long a test takes without judging."""
        path = self.path(test).with_suffix(".seconds")
        if not path.exists():
            start = time.monotonic()
            if self.start(test, 3600) != 0:
                raise SystemExit(f"without any mutant, this fails: {self.program(test)} {test}")
            path.write_text(f"{time.monotonic() - start:.2f}")
        self.seconds[test] = float(path.read_text())

    def is_settled(self, number: int) -> bool:
        """Whether no more tests need to judge a mutant."""
        mutant = self.mutants[number]
        is_watched = number in self.killer if self.all_mutants else line_of(mutant) in self.watched
        return is_watched or self.only not in key(mutant) or self.is_equal(number)

    def is_equal(self, number: int) -> bool:
        """Whether equal.txt names the mutant or its line."""
        return not self.equal.isdisjoint((key(self.mutants[number]), source_of(self.mutants[number])))

    def add(self, test: str, verdicts: bytes, is_whole: bool) -> None:
        """Notes what a run of a test found. Of one that was stopped, only what it judged."""
        known = self.verdicts[test]
        for number, verdict in enumerate(verdicts):
            if verdict != Verdict.SKIPPED and (is_whole or verdict >= Verdict.UNFINISHED):
                known[number] = verdict
            if verdict == Verdict.KILLED:
                self.killer.setdefault(number, test)
                self.watched.add(line_of(self.mutants[number]))

    def load(self, test: str) -> None:
        """Reads what is known of a test, also from a run that was stopped."""
        path, partial = self.path(test), self.path(test).with_suffix(".partial")
        self.verdicts[test] = bytearray([Verdict.SKIPPED] * len(self.mutants))
        if path.exists():
            self.add(test, path.read_bytes(), is_whole=True)
        if partial.exists():
            self.add(test, partial.read_bytes(), is_whole=False)

    def judge(self, test: str, is_last: bool) -> None:
        """Runs a test, which judges the mutants that are not settled. is_last: each has the time it needs."""
        known, open_verdict = self.verdicts[test], Verdict.UNFINISHED if is_last else Verdict.SKIPPED
        asked = bytearray([Verdict.SKIPPED] * len(known))
        for number, verdict in enumerate(known):
            is_there = self.mutants[number]["file"].startswith(("frame/", version_of(test)))
            if verdict == open_verdict and is_there and not self.is_settled(number):
                asked[number] = Verdict.UNREACHED
        if all(verdict == Verdict.SKIPPED for verdict in asked):
            return
        partial = self.path(test).with_suffix(".partial")
        partial.write_bytes(asked)
        start = time.monotonic()
        limit = str(2 + 5 * self.seconds[test] if is_last else SECONDS)
        if self.start(test, 36000, MJENV_MUTANTS=str(partial), MJENV_MUTANTS_SECONDS=limit) != 0:
            raise SystemExit(f"without any mutant, this fails: {self.program(test)} {test}")
        verdicts = partial.read_bytes()
        if is_last:
            verdicts = verdicts.replace(bytes([Verdict.UNFINISHED]), bytes([Verdict.KILLED]))
        self.add(test, verdicts, is_whole=True)
        self.path(test).write_bytes(known)
        partial.unlink()
        counts = collections.Counter(Verdict(verdict).name.lower() for verdict in verdicts)
        del counts["skipped"]
        print(f"{time.monotonic() - start:6.1f} s  {test}: {dict(counts)}", flush=True)

    def verdict(self, numbers: list[int]) -> str:
        """That of a line, or of a mutant: killed if some test kills one of these mutants."""
        if any(number in self.killer for number in numbers):
            return "killed"
        others = [number for number in numbers if not self.is_equal(number)]
        if not others:
            return "equal"
        verdicts = {verdicts[number] for number in others for verdicts in self.verdicts.values()} - {Verdict.SKIPPED}
        return Verdict(max(verdicts)).name.lower() if verdicts else "unjudged"

    def report(self) -> bool:
        """Prints the lines, or the mutants, that no test watches, and how many there are of each verdict in each file.

        Returns whether tests watch all of them.
        """
        counts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
        units: dict[object, list[int]] = collections.defaultdict(list)
        for number, mutant in enumerate(self.mutants):
            if self.only in key(mutant):
                units[number if self.all_mutants else line_of(mutant)].append(number)
        for numbers in units.values():
            verdict = self.verdict(numbers)
            first = self.mutants[numbers[0]]
            counts[first["file"]][verdict] += 1
            counts["all"][verdict] += 1
            if verdict not in ("killed", "equal"):
                print(f"{verdict:10} {first['line']:4} {key(first)}")
        verdicts = ("killed", "equal", "unfinished", "survived", "same", "unreached", "unjudged")
        print(f"{'':30}", *(f"{verdict:>10}" for verdict in verdicts))
        for file, count in counts.items():
            print(f"{file:30}", *(f"{count[verdict]:10}" for verdict in verdicts))
        stale = self.equal - {name(mutant) for mutant in self.mutants for name in (key, source_of)}
        for name in sorted(stale):
            print(f"equal.txt names what is neither a mutant nor a line with mutants: {name}")
        return not stale and not sum(counts["all"][verdict] for verdict in verdicts[2:])


def keep_kills(folder: Path, old: list[Mutant], new: list[Mutant]) -> None:
    """After a change of the code or the tests, keeps what tests have killed, with the mutants' new numbers."""
    numbers = {key(mutant): number for number, mutant in enumerate(old)}
    for path in folder.glob("*"):
        if path.suffix == ".seconds":
            continue
        known = path.read_bytes()
        verdicts = bytearray([Verdict.SKIPPED] * len(new))
        for number, mutant in enumerate(new):
            before = numbers.get(key(mutant))
            if before is not None and known[before] == Verdict.KILLED:
                verdicts[number] = Verdict.KILLED
        path.write_bytes(verdicts)


def setup(part: str) -> str:
    """What tools/setup prints: a Python."""
    return subprocess.run([ROOT / "tools/setup", part], check=True, stdout=subprocess.PIPE, text=True).stdout.strip()


def build(folder: Path) -> None:
    """Builds as tests/run does for its part quick, with each version of MuJoCo."""
    configure = "cmake -G Ninja -DMJENV_LTO=OFF -DMJENV_BUILD_TESTS=ON -DMJENV_BUILD_BENCHMARKS=OFF".split()
    configure += ["-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"]
    configure += [f"-DCMAKE_{language}_FLAGS_RELEASE=-O1 -DNDEBUG -w" for language in ("C", "CXX")]
    find = "import importlib.util; print(*importlib.util.find_spec('mujoco').submodule_search_locations)"
    engine = subprocess.run([setup("mujoco4"), "-c", find], check=True, stdout=subprocess.PIPE, text=True).stdout
    versions = {"mujoco2": "-DMJENV_ENGINE=auto", "mujoco4": f"-DMJENV_ENGINE={engine.strip()}"}
    for version, option in versions.items():
        subprocess.run([*configure, option, "-S", ROOT, "-B", folder / "plain" / version], check=True)
    mutants, digest = folder / "mutants.json", folder / "digest"
    known = mutants.read_text() if mutants.exists() else "[]"
    python = setup("mutants")  # which has the parser that rewrite.py needs
    commands = [folder / "plain" / version / "compile_commands.json" for version in versions]
    subprocess.run([python, HERE / "rewrite.py", folder, *commands], check=True)
    files = [
        *sorted((folder / "source/tests/core").glob("**/*.*")),
        *sorted((folder / "source/core/engine/lanes").glob("**/*.*")),
    ]
    present = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
    if not digest.exists() or digest.read_text() != present:
        keep_kills(folder / "verdicts", json.loads(known), json.loads(mutants.read_text()))
        digest.write_text(present)
    for version, option in versions.items():
        program = folder / "programs" / version
        subprocess.run([*configure, option, "-S", folder / "source", "-B", program], check=True)
        subprocess.run(["cmake", "--build", program, "--target", "test_core"], check=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=ROOT / "build/mutants")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--long", action="store_true", help="also with the long tests")
    parser.add_argument("--test", action="append", help="judge with these tests again, such as 'few-lanes test_odd'")
    parser.add_argument("--only", default="", help="the mutants in whose line of the report this text occurs")
    parser.add_argument(
        "--all", action="store_true", help="all mutants, not just those of lines that no test watches yet"
    )
    parser.add_argument("--report", action="store_true", help="only print what is known")
    arguments = parser.parse_args()
    folder = arguments.folder.resolve()
    if not arguments.report:
        build(folder)
    judge = Judge(folder, arguments.only, arguments.all)
    again = arguments.test or []
    for test in again:
        judge.path(test).unlink(missing_ok=True)
    tests = list(dict.fromkeys([*tests_of(folder, arguments.long), *again]))
    for test in tests:
        judge.load(test)
    if not arguments.report:
        with ThreadPoolExecutor(arguments.jobs) as pool:
            list(pool.map(judge.time, again or tests))
            for is_last in (False, True):
                order = sorted(judge.seconds, key=judge.seconds.__getitem__)
                list(pool.map(judge.judge, order, repeat(is_last)))
    if not judge.report():
        sys.exit(1)


if __name__ == "__main__":
    main()
