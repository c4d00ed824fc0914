"""Measures CPU time of steps inside of a function that JAX compiles; benchmarks/jax/run calls it.

Each kind is opened in a process of its own, and then they take turns in short blocks, so that whatever else the machine
does meets all of them alike. The table shows the medians of the blocks, and the medians of the ratios to mjenv_jax in
the same round.
"""

from __future__ import annotations

import argparse
import datetime
import os
from pathlib import Path
from statistics import median

from common import Worker, cpu_model, rates_in_turns

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
KINDS = {
    "mjenv_jax": "`mjenv_jax`: XLA calls the library",
    "io_callback": "`mjenv.make_vec` by `io_callback`",
    "envpool": "EnvPool's XLA interface",
}


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="benchmarks/jax/run", description=__doc__)
    add = parser.add_argument
    add("--id", default="Hopper-v5", help="of an environment (Hopper-v5)")
    add("--envs", type=int, default=64, help="number of environments (64)")
    add("--seconds", type=float, default=0.3, help="CPU seconds of a block (0.3)")
    add("--rounds", type=int, default=15, help="blocks of each kind (15)")
    add("--output", type=Path, default=Path("build/jax"), help="folder of the table")
    for name in ("python", "packages"):
        add(f"--{name}", required=True, type=os.path.abspath, help=argparse.SUPPRESS)
    return parser.parse_args()


def start(kind: str, arguments: argparse.Namespace) -> Worker:
    folders = ROOT / "benchmarks", ROOT / "bindings/python/src", ROOT / "extras/jax/python", arguments.packages
    environment = {
        "MJENV_BENCHMARK_CLOCK": "cpu",
        "PYTHONPATH": os.pathsep.join(map(str, folders)),
        "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
        **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "PYTHONUNBUFFERED"), "1"),
    }
    return Worker(kind, [arguments.python, str(HERE / "worker.py"), kind], environment)


def main() -> None:
    arguments = parse()
    workers = [start(kind, arguments) for kind in KINDS]
    rates = rates_in_turns(workers, f"{arguments.id} {arguments.envs} 1 1", arguments.seconds, arguments.rounds)
    date = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    lines = [f"| a step of {arguments.envs} {arguments.id} | CPU time | times mjenv_jax |", "|---|---:|---:|"]
    for worker in workers:
        found = rates[worker.name]
        ratio = median(mine / other for mine, other in zip(rates["mjenv_jax"], found, strict=True))
        lines.append(f"| {KINDS[worker.name]} | {1e3 * arguments.envs / median(found):.3f} ms | {ratio:.2f} |")
    about = "; ".join(dict.fromkeys(worker.about for worker in workers))
    text = "\n".join([*lines, "", f"CPU: {cpu_model()}. {about}. {date}."]) + "\n"
    for worker in workers:
        worker.end()
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "jax.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
