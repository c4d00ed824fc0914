#!/usr/bin/env python3
"""Judges whether the tests of core/ watch every line of the lane code: whether some test fails if a line is changed.

Builds all mutants (see rewrite.py) as one program, finds out which mutants each test can notice, and runs for each
mutant these tests until one fails. Resumes where the last run ended: what is known is kept in FOLDER/results.jsonl.
"""

from __future__ import annotations

import argparse
import collections
import json
import os
import random
import re
import shutil
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import repeat
from pathlib import Path
from typing import TypedDict

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
# The topics of tests/core/run.cpp that do not have the name of the file that tests them
TOPICS = {"lanes": ["few-lanes"], "random_models": []}
LONG_TOPICS = {**TOPICS, "lanes": ["few-lanes", "lanes"]}
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
    text: str


def key(mutant: Mutant) -> str:
    """What names a mutant in equal.txt and results.jsonl, also after lines have moved."""
    return f"{mutant['file']} {mutant['function']}: {mutant['text']}"


def tests_of(folder: Path, long: bool) -> list[str]:
    """The arguments of test_core for each test."""
    tests = []
    for source in sorted((folder / "source/tests/core").glob("*.cpp")):
        names = re.findall(r"cmocka_unit_test\w*\(([\w:]+)", source.read_text())
        for topic in (LONG_TOPICS if long else TOPICS).get(source.stem, [source.stem]):
            tests += [f"{topic} {name}" for name in names]
    tests += [f"random-models {seed} 1" for seed in [*range(SEEDS), *range(1000, 1000 + 200 * long)]]
    return list(dict.fromkeys(tests))


class Judge:
    def __init__(self, folder: Path, program: Path) -> None:
        self.folder, self.program = folder, program
        self.mutants: list[Mutant] = json.loads((folder / "mutants.json").read_text())
        self.seconds: dict[str, float] = {}
        self.felt: dict[str, bytes] = {}
        self.ran: dict[str, set[str]] = collections.defaultdict(set)  # the tests that a mutant survived
        self.killer: dict[str, str] = {}
        self.last_killers: dict[str, dict[int, str]] = collections.defaultdict(dict)  # in each file, by line
        self.runs: collections.Counter[str] = collections.Counter()
        self.kills: collections.Counter[str] = collections.Counter()
        self.lock = threading.Lock()
        self.results = folder / "results.jsonl"
        for line in self.results.read_text().splitlines() if self.results.exists() else []:
            result = json.loads(line)
            self.ran[result["mutant"]].update(result["survived"])
            self.runs.update([*result["survived"], result["killer"]])
            if result["killer"]:
                self.kills[result["killer"]] += 1
                self.killer[result["mutant"]] = result["killer"]
        equal = [line.strip() for line in (HERE / "equal.txt").read_text().splitlines()]
        self.equal = {line for line in equal if line and not line.startswith("#")}

    def start(self, test: str, limit: float, **environment: str) -> int | None:
        """The exit status of a test; None if it did not end. Limits the CPU's time: a machine can pause."""
        limits = ["prlimit", f"--cpu={int(limit) + 1}", "--core=0", f"--data={8 << 30}"]
        for _ in range(2):
            try:
                return subprocess.run(
                    [*limits, str(self.program), *test.split()],
                    env={**os.environ, **KEEP_MEMORY, **environment},
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    timeout=60 + 20 * limit,
                    check=False,
                ).returncode
            except subprocess.TimeoutExpired:
                continue
        return None

    def felt_file(self, test: str) -> Path:
        return self.folder / "felt" / test.replace(" ", "+")

    def is_known(self, test: str) -> bool:
        return self.felt_file(test).exists()

    def forget(self, test: str) -> None:
        """Forgets what is known of a test, which may have changed."""
        self.felt_file(test).unlink(missing_ok=True)
        for survived in self.ran.values():
            survived.discard(test)

    def record(self, test: str) -> None:
        """Notes how long a test takes, and for each mutant whether it could notice it: see mutants.hpp."""
        path, timed = self.felt_file(test), self.felt_file(test).with_suffix(".seconds")
        if not self.is_known(test):
            path.parent.mkdir(exist_ok=True)
            start = time.monotonic()
            is_well = self.start(test, 3600) == 0
            timed.write_text(f"{time.monotonic() - start:.2f}")
            partial = path.with_suffix(".partial")
            partial.write_bytes(bytes(len(self.mutants)))
            if not is_well or self.start(test, 3600, MJENV_MUTANTS_FELT=str(partial)) != 0:
                raise SystemExit(f"without any mutant, this fails: {self.program} {test}")
            partial.rename(path)
        self.felt[test], self.seconds[test] = path.read_bytes(), float(timed.read_text())

    def noticing(self, mutant: Mutant) -> list[str]:
        """The tests that can notice a mutant. First the one that killed its neighbour, then those that kill most."""
        nearby = self.last_killers[mutant["file"]]
        nearest = min(nearby, key=lambda line: abs(line - mutant["line"]), default=None)
        first = nearby.get(nearest) if nearest is not None else None
        cost = {test: self.seconds[test] * (self.runs[test] + 2) / (self.kills[test] + 1) for test in self.felt}
        tests = [test for test, felt in self.felt.items() if felt[mutant["number"]] == 2]
        return sorted(tests, key=lambda test: (test != first, cost[test]))

    def judge(self, mutant: Mutant, limit: float) -> None:
        """Runs these tests until one fails, except those for which the limit in seconds leaves no time."""
        name = key(mutant)
        begun, survived, killer = time.monotonic(), [], ""
        for test in self.noticing(mutant):
            start = time.monotonic()
            if test in self.ran[name] or start + self.seconds[test] > begun + limit:
                continue
            status = self.start(test, 5 * self.seconds[test] + 2, MJENV_MUTANT=str(mutant["number"]))
            self.runs[test] += 1
            if status != 0:
                killer = test
                break
            survived.append(test)
        with self.lock, self.results.open("a") as file:
            self.ran[name].update(survived)
            if killer:
                self.killer[name] = killer
                self.kills[killer] += 1
                self.last_killers[mutant["file"]][mutant["line"]] = killer
            file.write(json.dumps({"mutant": name, "killer": killer, "survived": survived}) + "\n")

    def verdict(self, mutant: Mutant) -> str:
        name = key(mutant)
        if name in self.killer:
            return "killed"
        if name in self.equal:
            return "equal"
        noticing = self.noticing(mutant)
        if not noticing:
            reached = any(felt[mutant["number"]] for felt in self.felt.values())
            return "same" if reached else "unreached"
        if name not in self.ran:
            return "unjudged"
        return "survived" if self.ran[name] >= set(noticing) else "unfinished"

    def report(self, only: str) -> bool:
        """Prints the mutants that no test killed, and how many there are of each verdict in each file.

        Returns whether tests kill all mutants that have been judged.
        """
        counts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
        for mutant in self.mutants:
            if only not in key(mutant):
                continue
            verdict = self.verdict(mutant)
            counts[mutant["file"]][verdict] += 1
            counts["all"][verdict] += 1
            if verdict not in ("killed", "equal", "unjudged"):
                print(f"{verdict:10} {mutant['line']:4} {key(mutant)}")
        verdicts = ("killed", "survived", "unfinished", "same", "unreached", "equal", "unjudged")
        print(f"{'':22}", *(f"{verdict:>10}" for verdict in verdicts))
        for file, count in counts.items():
            print(f"{file:22}", *(f"{count[verdict]:10}" for verdict in verdicts))
        stale = self.equal - {key(mutant) for mutant in self.mutants}
        for name in sorted(stale):
            print(f"equal.txt names what is no mutant: {name}")
        return not stale and not sum(counts["all"][verdict] for verdict in verdicts[1:-2])


def build(folder: Path) -> None:
    """Builds as tests/run does for its part quick."""
    configure = "cmake -G Ninja -DMJENV_LTO=OFF -DMJENV_BUILD_TESTS=ON -DMJENV_BUILD_BENCHMARKS=OFF".split()
    configure += ["-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"]
    configure += [f"-DCMAKE_{language}_FLAGS_RELEASE=-O1 -DNDEBUG -w" for language in ("C", "CXX")]
    plain, copy = folder / "plain", folder / "cmake"
    subprocess.run([*configure, "-S", ROOT, "-B", plain], check=True)
    mutants = folder / "mutants.json"
    known = mutants.read_text() if mutants.exists() else ""
    setup = subprocess.run([ROOT / "tools/setup", "mutants"], check=True, stdout=subprocess.PIPE, text=True)
    python = setup.stdout.strip()  # which has the parser that rewrite.py needs
    subprocess.run([python, HERE / "rewrite.py", plain / "compile_commands.json", folder], check=True)
    if mutants.read_text() != known:
        shutil.rmtree(folder / "felt", ignore_errors=True)  # other numbers
    subprocess.run([*configure, "-S", folder / "source", "-B", copy], check=True)
    subprocess.run(["cmake", "--build", copy, "--target", "test_core"], check=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=ROOT / "build/mutants")
    parser.add_argument("--program", type=Path, help="a test_core that is built already; default: builds one in FOLDER")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--most", type=int, help="judge at most so many mutants, which are drawn at random")
    parser.add_argument("--limit", type=float, default=600, help="how many seconds of tests a mutant gets")
    parser.add_argument("--long", action="store_true", help="also with the long tests")
    parser.add_argument("--test", action="append", help="judge with these tests alone, such as 'few-lanes test_odd'")
    parser.add_argument("--only", default="", help="the mutants in whose line of the report this text occurs")
    parser.add_argument("--report", action="store_true", help="only print what is known")
    arguments = parser.parse_args()
    folder = arguments.folder.resolve()
    if not arguments.program and not arguments.report:
        build(folder)
    judge = Judge(folder, arguments.program or folder / "cmake/tests/core/test_core")
    killed = set(judge.killer)
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for test in arguments.test or []:
            judge.forget(test)
        tests = arguments.test or tests_of(folder, arguments.long)
        list(pool.map(judge.record, filter(judge.is_known, tests) if arguments.report else tests))
        order = random.Random(1).sample(judge.mutants, len(judge.mutants))
        order = [mutant for mutant in order if arguments.only in key(mutant) and key(mutant) not in judge.killer]
        order = [mutant for mutant in order if judge.verdict(mutant) in ("unjudged", "unfinished")][: arguments.most]
        # Few tests kill most mutants, and soon. So the mutants that need long come last.
        for verdict, limit in ("unjudged", min(5, arguments.limit)), ("unfinished", arguments.limit):
            some = [mutant for mutant in order if judge.verdict(mutant) == verdict]
            list(pool.map(judge.judge, [] if arguments.report else some, repeat(limit)))
    if arguments.test:
        for name in sorted(set(judge.killer) - killed):
            print(f"killed by {judge.killer[name]}: {name}")
    elif not judge.report(arguments.only):
        sys.exit(1)


if __name__ == "__main__":
    main()
