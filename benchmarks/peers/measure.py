"""Measures steps per second of mjenv and its peers in turns and writes a CSV file; benchmarks/peers/run calls it.

For each robot, number of environments and number of threads all peers are opened, each in a process of its own, and
then take turns in short blocks, round after round, so that whatever else the machine does meets all of them alike.
"""

from __future__ import annotations

import argparse
import datetime
import os
import time
from pathlib import Path
from statistics import median

import report
from common import ROBOTS, Worker, cpu_model, rates_in_turns
from results import LANES, ON_MUJOCO4, PEERS, Row, read, write

HERE = Path(__file__).resolve().parent
# What the workers measure, unless they are programs in C.
CLOCK = "seconds of the CPUs" if os.environ.get("MJENV_BENCHMARK_CLOCK") == "cpu" else "seconds of a clock"
# The peers that benchmarks/steps.c plays, with its arguments.
PROGRAMS = {"mjenv-c": [], "mjenv-rollout": ["10"]}


def applies(peer: str, envs: int, threads: int) -> bool:
    """Whether a peer supports this number of environments and threads."""
    peer = peer.removeprefix(ON_MUJOCO4)
    if peer in ("mjenv-single", "gymnasium-single"):
        return (envs, threads) == (1, 1)
    if peer in ("mjenv-async", "envpool-async", "mjenv-rollout") or LANES in peer:
        return envs > 1
    if peer == "gymnasium-sync":  # has only one thread
        return threads == 1
    if peer == "gymnasium-async":  # a process for each environment
        return threads > 1 and envs <= 64
    return True


def start(peer: str, arguments: argparse.Namespace) -> Worker:
    environment = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
    kind = peer.removeprefix(ON_MUJOCO4)
    library, python = arguments.library, arguments.reference_python
    if LANES in kind:
        kind, environment["MJENV_LANES"] = kind.split(LANES)
    if peer.startswith(ON_MUJOCO4):
        library, python = arguments.mujoco4_library, arguments.mujoco4_python
        environment["MJENV_MUJOCO"] = arguments.mujoco4
    if kind in PROGRAMS:
        return Worker(peer, [arguments.program, library, *PROGRAMS[kind]], environment)
    if kind.startswith("mjenv"):
        environment |= {"MJENV_LIBRARY": library, "PYTHONPATH": arguments.package}
    if kind.startswith(("envpool", "mujoco")):
        python = arguments.peers_python
    return Worker(peer, [python, str(HERE / "worker.py"), kind], environment)


def measure(workers: list[Worker], robot: str, envs: int, threads: int, seconds: float, rounds: int) -> list[Row]:
    rates = rates_in_turns(workers, f"{robot}-v5 {envs} {threads} 1", seconds, rounds)
    date = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    return [
        {
            "robot": robot,
            "envs": str(envs),
            "threads": str(threads),
            "peer": worker.name,
            "steps_per_second": f"{median(rates[worker.name]):.0f}",
            "block_seconds": str(seconds),
            "blocks": " ".join(f"{rate:.0f}" for rate in rates[worker.name]),
            "about": f"{worker.about}, {CLOCK}",
            "cpu": cpu_model(),
            "cpus": str(len(os.sched_getaffinity(0))),
            "date": date,
        }
        for worker in workers
    ]


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="benchmarks/peers/run", description=__doc__)
    add = parser.add_argument
    add("--robots", nargs="+", choices=ROBOTS, default=ROBOTS, metavar="ROBOT", help=" ".join(ROBOTS))
    add("--envs", nargs="+", type=int, default=[1, 8, 64, 1024], help="numbers of environments (1 8 64 1024)")
    add("--threads", nargs="+", type=int, default=[1, 2], help="numbers of threads (1 2); one environment takes one")
    add("--peers", nargs="+", choices=PEERS, default=PEERS, metavar="PEER", help=" ".join(PEERS))
    add("--seconds", type=float, default=0.2, help="of a block (0.2)")
    add("--rounds", type=int, default=9, help="blocks of each peer (9)")
    add("--output", type=Path, default=Path("build/peers"), help="folder of the CSV, the tables and the chart")
    add("--add", action="store_true", help="keep what the folder's CSV holds of other configurations")
    of_mujoco4 = ("mujoco4", "mujoco4-library", "mujoco4-python")
    for name in ("library", "package", "program", "reference-python", "peers-python", *of_mujoco4):
        add(f"--{name}", required=True, type=os.path.abspath, help=argparse.SUPPRESS)
    return parser.parse_args()


def main() -> None:
    arguments = parse()
    arguments.output.mkdir(parents=True, exist_ok=True)
    path = arguments.output / "peers.csv"
    rows = read(path) if arguments.add else []
    workers = [start(peer, arguments) for peer in arguments.peers]
    cases = [
        (robot, envs, threads)
        for robot in arguments.robots
        for envs in arguments.envs
        for threads in arguments.threads
        if envs > 1 or threads == 1
    ]
    began = time.monotonic()
    for done, (robot, envs, threads) in enumerate(cases):
        chosen = [worker for worker in workers if applies(worker.name, envs, threads)]
        measured = measure(chosen, robot, envs, threads, arguments.seconds, arguments.rounds)
        write(path, rows := rows + measured)
        elapsed = time.monotonic() - began
        left = elapsed / (done + 1) * (len(cases) - done - 1)
        rates = ", ".join(f"{row['peer']} {row['steps_per_second']}" for row in measured)
        print(f"[{done + 1}/{len(cases)}, {left / 60:.0f} min left] {robot} {envs} x {threads}: {rates}", flush=True)
    for worker in workers:
        worker.end()
    report.write(path)


if __name__ == "__main__":
    main()
