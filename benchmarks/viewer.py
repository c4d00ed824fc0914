"""Measures what the live viewer costs: of a session in real time, and of a training that is shown.

    viewer.py session [--id Ant-v5] [--rows 1] [--seconds 20]
    viewer.py training [--id Ant-v5] [--steps 200000]

Chromium shows the page in both, which playwright starts. A session: the pictures sent in a second, and the part of one
CPU that the process takes for them and for the simulation. A training: extras/curricula/python/train_cleanrl.py, the
part of its CPU time that the viewer takes, in its own thread and in viser's. It has to learn the same bits
without the viewer.
"""

from __future__ import annotations

import argparse
import contextlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, sync_playwright

from common import cpu_model

ROOT = Path(__file__).resolve().parents[1]
WITHOUT_GPU = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@contextlib.contextmanager
def chromium() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=WITHOUT_GPU)
        yield browser
        browser.close()


def show(browser: Browser, address: str) -> Any:
    page = browser.new_page(viewport={"width": 320, "height": 200})
    page.set_default_timeout(300_000)
    page.goto(address)
    page.get_by_role("tab", name="Run").wait_for()
    return page


def session(arguments: argparse.Namespace) -> None:
    from mjenv_viewer.session import Session

    pictures = 0
    with chromium() as browser, Session(arguments.id, arguments.rows, port=0) as shown:
        show_picture = shown.picture.show

        def counted(found: Any) -> None:
            nonlocal pictures
            pictures += 1
            show_picture(found)

        shown.ask(lambda: setattr(shown.picture, "show", counted))
        show(browser, shown.address)
        time.sleep(5)
        pictures = 0
        begun, cpu, time_before = time.perf_counter(), time.process_time(), shown.ask(lambda: simulated(shown))
        time.sleep(arguments.seconds)
        seconds, cpu = time.perf_counter() - begun, time.process_time() - cpu
        speed = (shown.ask(lambda: simulated(shown)) - time_before) / seconds
        print(
            f"{arguments.id}, {arguments.rows} rows at {speed:.2f} times real time: {pictures / seconds:.1f} pictures a"
            f" second, {100 * cpu / seconds:.1f} % of one CPU, {1000 * cpu / max(pictures, 1):.2f} ms a picture; on"
            f" {cpu_model()}"
        )


def simulated(shown: Any) -> float:
    """The seconds that the first row has simulated in its episode."""
    return float(shown.steps[0] * shown.envs.dt)


def training(arguments: argparse.Namespace) -> None:
    sys.path.insert(0, str(ROOT / "extras/curricula/python"))
    import torch

    import train_cleanrl as example
    from mjenv_viewer.watch import View

    torch.set_num_threads(1)
    settings = replace(example.SETTINGS[arguments.id], envs=64, rollout=64)
    stages = [example.Stage(arguments.steps, {})]
    policies = []
    with tempfile.TemporaryDirectory() as folder:
        for view in (False, True):
            meter = Meter(View)
            with meter if view else contextlib.nullcontext():
                example.train(arguments.id, "mjenv", stages, 1, Path(folder), settings, view=view)
            policies.append((Path(folder) / "policy.txt").read_bytes())
    print(
        f"{arguments.id}, {arguments.steps} steps: while a browser looked, {meter.pictures} pictures took"
        f" {100 * meter.viewer / meter.total:.2f} % of the process's {meter.total:.1f} s of CPU time; on {cpu_model()}"
    )
    if policies[0] != policies[1]:
        sys.exit("the policies differ")
    print("The policy has the same bits without the viewer.")


class Meter:
    """Opens a browser for the View that a program makes, and measures the CPU time from when it looks on."""

    def __init__(self, view: Any) -> None:
        self._kind, self._draw = view, view._draw
        self.pictures = 0
        self.viewer = self.total = self._begun = self._own = self._threads = 0.0
        self._browser: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> None:
        self._kind._draw = lambda view, force=False: self._measured(view, force)

    def _measured(self, view: Any, force: bool) -> None:
        if self._browser is None:
            self._browser = subprocess.Popen([sys.executable, __file__, "browser", "--address", view.address])
        clocks = view._clock._clocks
        if not self._begun:
            if view.server.is_watched:
                self._begun = time.process_time()
                self._threads = sum(map(time.clock_gettime, clocks))
            self._draw(view, force)
            return
        begun = time.thread_time()
        self._draw(view, force)
        self.pictures += 1
        self._own += time.thread_time() - begun
        self.total = time.process_time() - self._begun
        self.viewer = self._own + sum(map(time.clock_gettime, clocks)) - self._threads

    def __exit__(self, *_: Any) -> None:
        self._kind._draw = self._draw
        if self._browser:
            self._browser.terminate()
            self._browser.wait()
        if not self.pictures:
            sys.exit("the training ended before the browser showed it: choose more --steps")


def look(arguments: argparse.Namespace) -> None:
    """The browser of a training, which ends it."""
    with chromium() as browser:
        show(browser, arguments.address).wait_for_timeout(1e9)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("session", "training", "browser"))
    parser.add_argument("--id", default="Ant-v5")
    parser.add_argument("--rows", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--address", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    {"session": session, "training": training, "browser": look}[arguments.what](arguments)


if __name__ == "__main__":
    main()
