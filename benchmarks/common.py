"""Functions that several benchmarks use."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROBOTS = (
    "Ant HalfCheetah Hopper Humanoid HumanoidStandup InvertedDoublePendulum InvertedPendulum Pusher Reacher Swimmer"
    " Walker2d"
).split()


def cpu_model() -> str:
    """The name of the CPU with its family and model, because virtual machines shorten names."""
    first = Path("/proc/cpuinfo").read_text().partition("\n\n")[0]
    said = dict(line.split(":", 1) for line in first.splitlines() if ":" in line)
    found = {name.strip(): value.strip() for name, value in said.items()}
    if "model name" not in found:
        return "unknown"
    return f"{found['model name']} (family {found.get('cpu family', '?')}, model {found.get('model', '?')})"


class Worker:
    """A process that steps one peer or task on request; peers/worker.py describes its commands."""

    def __init__(self, name: str, command: list[str], environment: dict[str, str]) -> None:
        self.name = name
        self._errors = tempfile.TemporaryFile("w+")  # noqa: SIM115 it lives as long as the process
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            env={**os.environ, **environment},
            cwd=tempfile.gettempdir(),  # MuJoCo writes a log of warnings where it runs
        )
        self.about = self.ask("about")

    def ask(self, command: str) -> str:
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            self._errors.seek(0)
            sys.exit(f"{self._errors.read()}{self.name} failed at '{command}', see above")
        return answer.strip()

    def rate(self, seconds: float) -> float:
        steps, taken = self.ask(f"run {seconds}").split()
        return int(steps) / float(taken)

    def end(self) -> None:
        assert self._process.stdin
        self._process.stdin.close()
        self._process.wait()


def rates_in_turns(workers: list[Worker], case: str, seconds: float, rounds: int) -> dict[str, list[float]]:
    """Measures each worker's steps per second, once in each round.

    The workers take turns in short blocks, so that whatever else the machine does meets all of them alike. case: the
    arguments of the command "open" (peers/worker.py).
    """
    for worker in workers:
        worker.ask(f"open {case}")
    rates: dict[str, list[float]] = {worker.name: [] for worker in workers}
    for turn in range(rounds):
        for worker in workers if turn % 2 == 0 else reversed(workers):
            rates[worker.name].append(worker.rate(seconds))
    for worker in workers:
        worker.ask("close")
    return rates
