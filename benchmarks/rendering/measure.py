"""Measures pictures per second and their memory and prints Markdown; benchmarks/rendering/run calls it."""

from __future__ import annotations

import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from contextlib import closing
from statistics import median
from typing import Any

import gymnasium
from library import LIBRARY, Env, Renderer

IDS = ("Ant-v5", "HalfCheetah-v5", "Humanoid-v5", "Reacher-v5")
SIZES = {480: 40, 64: 80}  # pixels a side: pictures
KINDS = ("gymnasium", "both", "colours", "fast")
FAST = {"samples": 0, "shadows": 0}


def drawer(kind: str, id: str, size: int) -> Callable[[], float]:
    """Each call takes a step, draws one picture, and returns the seconds that the drawing took."""
    theirs = gymnasium.make(id, render_mode="rgb_array", width=size, height=size)
    theirs.reset(seed=0)
    theirs.action_space.seed(0)
    ours = Env(id, strict=0)
    ours.reset(0)
    if kind == "gymnasium":
        draw: Callable[[], Any] = theirs.render
    else:
        renderer = Renderer(ours, size, size, **(FAST if kind == "fast" else {}))
        draw = renderer.render if kind == "both" else renderer.colours

    def next_picture() -> float:
        action = theirs.action_space.sample()
        theirs.unwrapped.step(action)
        ours.step(action)
        start = time.perf_counter()
        draw()
        return time.perf_counter() - start

    return next_picture


class Process:
    """A process that draws; a process, because a thread has only one OpenGL context at a time."""

    def __init__(self, kind: str, id: str, size: int) -> None:
        command = [sys.executable, __file__, "draw", kind, id, str(size)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.next_picture()  # builds what is kept

    def next_picture(self) -> float:
        assert self.process.stdin
        assert self.process.stdout
        print(file=self.process.stdin, flush=True)
        return float(self.process.stdout.readline())


def draw(kind: str, id: str, size: str) -> None:
    next_picture = drawer(kind, id, int(size))
    for _ in sys.stdin:
        print(next_picture(), flush=True)


def speed() -> None:
    print("| id | size | Gymnasium | colours and depth | ratio | colours | ratio | fast preset | ratio |")
    print("|---|---|---|---|---|---|---|---|---|")
    for id in IDS:
        for size, count in SIZES.items():
            processes = [Process(kind, id, size) for kind in KINDS]
            times = [[process.next_picture() for process in processes] for _ in range(count)]
            for process in processes:
                process.process.communicate()
            cells = [f"{id} | {size} x {size} | {1 / median(row[0] for row in times):.1f}"]
            for kind in range(1, len(KINDS)):
                ratio = median(row[0] / row[kind] for row in times)
                cells.append(f"{1 / median(row[kind] for row in times):.1f} | {ratio:.2f}")
            print("| " + " | ".join(cells) + " |", flush=True)


def resident() -> float:
    """The resident memory of this process, MB."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096 / 1e6


def memory() -> None:
    ours = Env("Reacher-v5", strict=0)
    ours.reset(0)
    with closing(ours):
        with closing(Renderer(ours, 64, 64)) as renderer:
            for count in range(1, 10001):
                renderer.render()
                if count in (100, 1000, 10000):
                    print(f"after {count} pictures: {resident():.1f} MB", flush=True)
        for count in range(1, 201):
            with closing(Renderer(ours, 64, 64)) as renderer:
                renderer.render()
            if count in (10, 100, 200):
                print(f"after {count} more renderers, one at a time: {resident():.1f} MB", flush=True)


def main() -> None:
    warnings.simplefilter("ignore")
    if sys.argv[1:2] == ["draw"]:
        draw(*sys.argv[2:])
        return
    env = Env(IDS[0])
    with closing(env), closing(Renderer(env, 1, 1)) as renderer:
        print(LIBRARY.mjenv_renderer_gl(renderer.handle).decode(), end="\n\n")
    for part in sys.argv[1:] or ["speed", "memory"]:
        {"speed": speed, "memory": memory}[part]()


main()
