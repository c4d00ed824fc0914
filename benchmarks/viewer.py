"""Measures what the live viewer costs: of a session in real time, and of a training that is shown.

    viewer.py session [--id Ant-v5] [--rows 1] [--seconds 20]
    viewer.py training [--id Ant-v5] [--steps 200000] [--rounds 3]

Chromium shows the page in both, which playwright starts. A session: the pictures sent in a second, and the part of one
CPU that the process takes for them and for the simulation. A training: examples/python/train_cleanrl.py, in turns with
and without --view, by the CPU time of its process in the second half of the updates; both have to learn the same bits.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median
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
    from mjenv.viewer.session import Session

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
    with chromium() as browser, tempfile.TemporaryDirectory() as folder:
        ratios = []
        for round in range(arguments.rounds):
            seconds = {}
            for view in (False, True) if round % 2 else (True, False):
                seconds[view] = trained(arguments, Path(folder) / str(view), browser if view else None)
            ratios.append(seconds[True] / seconds[False])
            print(
                f"round {round + 1}: {seconds[False]:.1f} s of CPU, with the viewer {seconds[True]:.1f} s", flush=True
            )
            policies = [(Path(folder) / str(view) / "policy.txt").read_bytes() for view in (False, True)]
            if policies[0] != policies[1]:
                sys.exit("the policies differ")
        more = 100 * (median(ratios) - 1)
        print(
            f"The second half of {arguments.steps} steps of {arguments.id}: {more:+.2f} % of CPU time"
            f" in the median of {len(ratios)} rounds, the same policy; on {cpu_model()}"
        )


def trained(arguments: argparse.Namespace, out: Path, browser: Browser | None) -> float:
    """Trains, and returns the CPU seconds that the process takes for the second half of the updates.

    The first half leaves the browser time to load the page.
    """
    shutil.rmtree(out, ignore_errors=True)
    command = [sys.executable, str(ROOT / "examples/python/train_cleanrl.py"), arguments.id, "--out", str(out)]
    command += ["--steps", str(arguments.steps), *(["--view"] if browser else [])]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert process.stderr
    page = None
    if browser:
        said = process.stderr.readline()
        assert said.startswith("mjenv view: "), said
        page = show(browser, said.split()[-1])
        if steps_in(out / "curve.csv") >= arguments.steps / 2:
            sys.exit("the page took longer than half of the training: choose more --steps")
    half = None
    while process.poll() is None:
        if half is None and steps_in(out / "curve.csv") >= arguments.steps / 2:
            half = cpu_of(process.pid)
        last = cpu_of(process.pid) or 0.0
        time.sleep(0.02)
    if process.returncode or half is None:
        sys.exit(process.stderr.read())
    process.stderr.close()
    if page:
        page.close()
    return last - half


def steps_in(curve: Path) -> int:
    """How many steps a training has written to its curve."""
    lines = curve.read_text().splitlines() if curve.exists() else []
    return int(lines[-1].split(",")[0]) if len(lines) > 1 and lines[-1] else 0


def cpu_of(process: int) -> float | None:
    """The CPU seconds of a process; None once it has ended."""
    try:
        user, system = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    except OSError:
        return None
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("session", "training"))
    parser.add_argument("--id", default="Ant-v5")
    parser.add_argument("--rows", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    {"session": session, "training": training}[arguments.what](arguments)


if __name__ == "__main__":
    main()
