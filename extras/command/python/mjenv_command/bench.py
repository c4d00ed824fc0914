"""mjenv bench: measures the steps per second of mjenv and of the installed Gymnasium in one interleaved run."""

from __future__ import annotations

import argparse
import contextlib
import importlib.metadata
import os
import platform
import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

import mjenv
from mjenv_command import terminal
from mjenv_command.arguments import Commands, add_json, known_id, not_negative, positive, print_json, seconds

DEFAULT_IDS = ("Ant-v5", "HalfCheetah-v5", "Hopper-v5", "Humanoid-v5", "Reacher-v5")
DRAWN = 64  # each contender repeats so many different actions


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "bench",
        help="measure steps per second, beside Gymnasium if it is installed",
        description="Measures how many random steps per second each contender takes. In each round all contenders run "
        "in turn for a slice of time, and the order changes from round to round, so that other work on the machine "
        "affects all of them alike. Prints the median of the rounds, and the median of the ratios within a round. The "
        "times include resets. Gymnasium takes part, without its checking wrapper, if its MuJoCo environments can be "
        "built.",
    )
    command.add_argument("id", nargs="*", type=known_id, help=f"ids to measure (default: {' '.join(DEFAULT_IDS)})")
    command.add_argument("--rows", type=positive, default=16, help="environments in a vector (default: 16)")
    command.add_argument(
        "--threads", type=not_negative, default=0, help="threads of the vector; 0: the CPUs of this process (default)"
    )
    command.add_argument("--rounds", type=positive, default=9, help="rounds (default: 9)")
    command.add_argument("--seconds", type=seconds, default=0.1, help="length of a slice (default: 0.1)")
    command.add_argument("--alone", action="store_true", help="leave Gymnasium out")
    add_json(command)
    command.set_defaults(run=run)


class Contender:
    """One way to step an environment. Each measurement takes about slice_seconds."""

    def __init__(self, name: str, envs: Any, rows: int, slice_seconds: float) -> None:
        self.name, self._envs, self._rows = name, envs, rows
        space = envs.action_space
        space.seed(0)
        self._actions = [space.sample() for _ in range(DRAWN)]
        envs.reset(seed=0)
        self._play: Callable[[int], None] = self._play_single if rows == 0 else self._play_vector
        calls = 1
        while (taken := self._time(calls)) < slice_seconds / 4:
            calls *= 2
        self._calls = max(1, round(calls * slice_seconds / taken))

    def rate(self) -> float:
        """Steps per second; a step of a vector counts once for each row."""
        return self._calls * max(1, self._rows) / self._time(self._calls)

    def close(self) -> None:
        self._envs.close()

    def _time(self, calls: int) -> float:
        start = time.perf_counter()
        self._play(calls)
        return time.perf_counter() - start

    def _play_single(self, calls: int) -> None:
        step, reset, actions = self._envs.step, self._envs.reset, self._actions
        for index in range(calls):
            _, _, terminated, truncated, _ = step(actions[index % DRAWN])
            if terminated or truncated:
                reset()

    def _play_vector(self, calls: int) -> None:
        step, actions = self._envs.step, self._actions
        for index in range(calls):
            step(actions[index % DRAWN])


def run(arguments: argparse.Namespace) -> int:
    ids = arguments.id or list(DEFAULT_IDS)
    results = []
    with terminal.progress(len(ids) * arguments.rounds, "measuring") as advance:
        for id in ids:
            results.append(measure(id, arguments, advance))
    if arguments.json:
        print_json({"versions": versions(arguments.engine), "cpus": cpus(), "results": results})
        return 0
    print(f"{versions(arguments.engine)}; {cpus()} CPUs; medians of {arguments.rounds} interleaved rounds")
    for result in results:
        _show(result)
    return 0


def cpus() -> int:
    """How many CPUs this process may use, or if Python cannot tell, as on Windows, how many there are."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def versions(engine: str | None) -> str:
    """The versions of what is measured."""
    found = [f"mjenv {mjenv.version(engine)}", f"gymnasium {gymnasium.__version__}", f"numpy {np.__version__}"]
    with contextlib.suppress(importlib.metadata.PackageNotFoundError):
        found.append(f"mujoco {importlib.metadata.version('mujoco')}")
    return ", ".join([*found, f"Python {platform.python_version()}"])


def measure(id: str, arguments: argparse.Namespace, advance: Callable[[], None]) -> dict[str, Any]:
    """The steps per second of each contender, and their ratio to the first contender's."""
    contenders, refusal, lanes = _contenders(id, arguments)
    rates: list[list[float]] = [[] for _ in contenders]
    for turn in range(arguments.rounds):
        for place in range(len(contenders)):
            which = (turn + place) % len(contenders)
            rates[which].append(contenders[which].rate())
        advance()
    for contender in contenders:
        contender.close()
    return {
        "id": id,
        "rows": arguments.rows,
        "threads": arguments.threads,
        "gymnasium": refusal,
        "lanes": lanes[0],
        "lanes_reason": lanes[1],
        "contenders": [
            {
                "name": contender.name,
                "steps_per_second": statistics.median(own),
                "ratio": statistics.median(mine / first for mine, first in zip(own, rates[0], strict=True)),
            }
            for contender, own in zip(contenders, rates, strict=True)
        ],
    }


def _contenders(id: str, arguments: argparse.Namespace) -> tuple[list[Contender], str | None, tuple[int, str]]:
    """The contenders, Gymnasium's first; the reason if Gymnasium does not take part; and mjenv's lanes."""
    rows, slice_seconds = arguments.rows, arguments.seconds
    found: list[Contender] = []
    refusal = "left out" if arguments.alone else None
    if not arguments.alone:
        try:
            single = gymnasium.make(id, disable_env_checker=True)
            vector = gymnasium.make_vec(id, rows, vectorization_mode="sync", disable_env_checker=True)
        except (ImportError, gymnasium.error.Error) as error:
            refusal = str(error)
        else:
            found.append(Contender("gymnasium make", single, 0, slice_seconds))
            found.append(Contender(f"gymnasium make_vec {rows}", vector, rows, slice_seconds))
    found.append(Contender("mjenv make", mjenv.make(id, engine=arguments.engine), 0, slice_seconds))
    envs = mjenv.make_vec(id, rows, num_threads=arguments.threads, engine=arguments.engine)
    found.append(Contender(f"mjenv make_vec {rows}", envs, rows, slice_seconds))
    return found, refusal, (envs.lanes, envs.lanes_reason)


def _show(result: dict[str, Any]) -> None:
    terminal.heading(result["id"])
    rows = [[one["name"], f"{one['steps_per_second']:,.0f}", f"{one['ratio']:.2f}"] for one in result["contenders"]]
    terminal.table(["", "steps/s", "ratio"], rows, right="steps/s ratio")
    print(f"lanes of mjenv make_vec: {terminal.lanes_text(result['lanes'], result['lanes_reason'])}")
    if result["gymnasium"] not in (None, "left out"):
        print(f"without Gymnasium: {result['gymnasium']}")
