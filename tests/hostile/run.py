#!/usr/bin/env python3
"""Plays every model of models.py in its own process and folder and reports those that go wrong.

Usage: tests/hostile/run PLAYER [--mujoco 2|4|4-few] [--own] [--seconds S] [--unbounded] [WORD...]
  PLAYER       the program built from play.c
  --mujoco     the version of the player's MuJoCo: which cases are played (default 2)
  --own        as files of the user's own, which may take all time and memory, but may not crash
  --seconds    of CPU time that a model may take (default 10); 20 times as much by the clock
  --unbounded  without a limit on memory, which sanitizers cannot bear
  WORD         only cases with one of these words in their names
"""

from __future__ import annotations

import argparse
import collections
import concurrent.futures
import ctypes
import dataclasses
import os
import pathlib
import resource
import signal
import struct
import subprocess
import sys
import tempfile
import time

import models

# Bytes of address space; the library allows a stranger's model less.
MEMORY = 8 << 30


def lay_out(folder: pathlib.Path, case: models.Case) -> None:
    """Writes the model and its files."""
    for name, content in {"model.xml": case.xml, **case.files}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if content == "pipe":
            os.mkfifo(path)
        elif content == ("folder",):
            path.mkdir()
        elif isinstance(content, tuple):
            path.symlink_to(content[1])
        else:
            path.write_bytes(content.encode() if isinstance(content, str) else content)


class Reads:
    """Counts how often the files below a folder are opened."""

    def __init__(self, folder: pathlib.Path) -> None:
        libc = ctypes.CDLL(None, use_errno=True)
        self.events = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        self.folders = {}
        for path in (folder, *(path for path in folder.rglob("*") if path.is_dir() and not path.is_symlink())):
            # IN_OPEN, and IN_CLOSE_NOWRITE, because the system merges equal events that follow each other.
            number = libc.inotify_add_watch(self.events, os.fsencode(path), 0x20 | 0x10)
            if number < 0:
                raise OSError(ctypes.get_errno(), "inotify")
            self.folders[number] = path.relative_to(folder)

    def counts(self) -> collections.Counter[str]:
        counts: collections.Counter[str] = collections.Counter()
        while True:
            try:
                events = os.read(self.events, 1 << 16)
            except BlockingIOError:
                os.close(self.events)
                return counts
            while events:
                number, mask, _, length = struct.unpack_from("iIII", events)
                name, events = events[16 : 16 + length].rstrip(b"\0"), events[16 + length :]
                if mask & 0x20 and not mask & 0x40000000:  # IN_OPEN of no folder
                    counts[str(self.folders[number] / os.fsdecode(name))] += 1


def play(case: models.Case, arguments: argparse.Namespace) -> tuple[models.Case, str, str, float]:
    """The case, what its player said, what is wrong with that ("" if nothing), and the seconds it took."""
    with tempfile.TemporaryDirectory(prefix="mjenv-hostile-") as outer:
        folder = pathlib.Path(outer) / "model"
        folder.mkdir()
        lay_out(folder, case)
        before = sorted(folder.rglob("*"))
        own = ["own"] * arguments.own
        brief = ["brief"] * (not case.is_drawn)
        command = [arguments.player, "Ant-v5", "./model.xml", *(case.arguments or own), *brief]

        def bound() -> None:
            if not arguments.unbounded:
                resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            resource.setrlimit(resource.RLIMIT_CPU, (arguments.seconds, arguments.seconds))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

        reads = Reads(pathlib.Path(outer))
        start = time.monotonic()
        limit = 20 * arguments.seconds
        try:
            done = subprocess.run(
                command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, timeout=limit, preexec_fn=bound
            )
        except subprocess.TimeoutExpired:
            return case, "", "" if own else f"took more than {limit} s", limit
        seconds = time.monotonic() - start
        # What is read a second time is perhaps not what was checked. A name that is spelled in two ways is two files,
        # and a model that attaches itself is two models, each of which is checked.
        is_two = "spelled" in case.name or case.name == "today-child-self"
        repeated = [name for name, count in reads.counts().items() if count > 1 and not is_two]
        said, printed = done.stdout.decode(errors="replace"), done.stderr.decode(errors="replace")
        if own and not case.arguments:
            case = dataclasses.replace(case, expect="either", words=())
            if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
                return case, said, "", seconds
        why = complaint(case, done.returncode, said, printed, before != sorted(folder.rglob("*")))
        return case, said, why or (f"read {repeated} more than once" if repeated else ""), seconds


def complaint(case: models.Case, code: int, said: str, printed: str, wrote: bool) -> str:
    if code in (-signal.SIGXCPU, -signal.SIGKILL):
        return "took too much CPU time"
    if code != 0:
        return f"ended with {code}: {said[-300:]} {printed[-3000:]}"
    if printed:
        return f"printed {printed[-3000:]!r}"
    if wrote:
        return "wrote a file"
    outcome = said.partition(" ")[0].strip()
    if said.count("\n") != 1 and outcome != "refused":
        return f"printed {said!r}"
    if outcome not in ("works", "refused") or (case.expect != "either" and outcome != case.expect):
        return f"should be {case.expect}: {said[:500]}"
    if outcome == "refused" and said.split()[1] not in (
        "MJENV_E_MODEL",
        "MJENV_E_MEMORY",
        "MJENV_E_PHYSICS",
        "MJENV_E_ARGUMENT",
        "MJENV_E_RENDER",
    ):
        return said
    missing = [word for word in case.words if word not in said]
    return f"does not say {missing}: {said[:500]}" if missing else ""


def main() -> int:
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("player", type=os.path.abspath)
    parser.add_argument("--mujoco", choices=("2", "4", "4-few"), default="2")
    parser.add_argument("--own", action="store_true")
    parser.add_argument("--seconds", type=int, default=10)
    parser.add_argument("--unbounded", action="store_true")
    parser.add_argument("words", nargs="*")
    arguments = parser.parse_intermixed_args()
    chosen = [
        c
        for c in models.cases(arguments.mujoco)
        if not arguments.words or any(word in c.name for word in arguments.words)
    ]
    outcomes: collections.Counter[str] = collections.Counter()
    slowest: list[tuple[float, str]] = []
    wrong = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for case, said, why, seconds in pool.map(lambda c: play(c, arguments), chosen):
            outcomes[said.partition(" ")[0].strip()] += 1
            slowest.append((seconds, case.name))
            if why:
                wrong += 1
                print(f"{case.name}: {why}")
            if os.environ.get("VERBOSE"):
                print(f"{case.name}: {seconds:.2f} s {said.strip()}")
    slowest.sort(reverse=True)
    print("slowest:", ", ".join(f"{name} {seconds:.1f} s" for seconds, name in slowest[:5]))
    print(f"{outcomes['works']} worked, {outcomes['refused']} were refused")
    print(f"{len(chosen) - wrong} passed, {wrong} failed")
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
