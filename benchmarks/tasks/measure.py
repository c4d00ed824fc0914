"""Measures Hopper-v5 as a built-in task and as tasks from outside of the library; benchmarks/tasks/run calls it.

All kinds take turns in short blocks. For each block the ratio of a kind's speed to that of the built-in task in the
same round is taken; the tables show the median of the ratios. Tasks in Julia are compared with the built-in task that
Julia steps.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import os
from pathlib import Path
from statistics import median

from common import Worker, cpu_model, rates_in_turns

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
KINDS = "built-in c cpp rust numba numpy gymnasium mujoco-batch julia-built-in julia".split()
JULIA = {"julia-built-in": "Hopper-v5", "julia": "JuliaHopper-v5"}
ONE_THREAD = {"gymnasium", *JULIA}
FIELDS = "kind envs threads steps_per_second ratio_to_built_in ratios about cpu date".split()


def start(kind: str, arguments: argparse.Namespace) -> Worker:
    if kind in JULIA:
        package = ROOT / "bindings" / "julia"
        environment = {"MJENV_LIBRARY": arguments.library, "JULIA_LOAD_PATH": f"{package}:@stdlib"}
        return Worker(kind, [arguments.julia, str(HERE / "worker.jl"), JULIA[kind]], environment)
    path = [ROOT / "benchmarks"]
    environment = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
    python = {"gymnasium": arguments.reference_python, "mujoco-batch": arguments.peers_python}.get(kind)
    if python is None:
        python = arguments.numba_python
        folders = ("bindings/python/tests", "extras/batch/python", "extras/numba/python", "extras/numba/tests")
        path += [Path(arguments.package), *(ROOT / folder for folder in folders)]
        environment["MJENV_LIBRARY"] = arguments.library
    environment["PYTHONPATH"] = os.pathsep.join(map(str, path))
    return Worker(kind, [python, str(HERE / "worker.py"), kind, arguments.plugins], environment)


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="benchmarks/tasks/run", description=__doc__)
    add = parser.add_argument
    add("--kinds", nargs="+", choices=KINDS, default=KINDS, metavar="KIND", help=" ".join(KINDS))
    add("--envs", nargs="+", type=int, default=[64, 1024], help="numbers of environments (64 1024)")
    add("--threads", nargs="+", type=int, default=[1, 2], help="numbers of threads (1 2)")
    add("--seconds", type=float, default=0.3, help="of a block (0.3)")
    add("--rounds", type=int, default=15, help="blocks of each kind (15)")
    add("--cpu", action="store_true", help="count CPU seconds, without the kinds of Julia; with one thread")
    add("--output", type=Path, default=Path("build/tasks"), help="folder of the CSV and the table")
    for name in (
        "library",
        "package",
        "program",
        "plugins",
        "reference-python",
        "peers-python",
        "numba-python",
        "julia",
    ):
        add(f"--{name}", required=True, type=os.path.abspath, help=argparse.SUPPRESS)
    return parser.parse_args()


def main() -> None:
    arguments = parse()
    if arguments.cpu:
        os.environ["MJENV_BENCHMARK_CLOCK"] = "cpu"
        arguments.threads = [1]
        arguments.kinds = [kind for kind in arguments.kinds if kind not in JULIA]
    arguments.output.mkdir(parents=True, exist_ok=True)
    bases = ["built-in", "julia-built-in"] if "julia" in arguments.kinds else ["built-in"]
    kinds = list(dict.fromkeys([*bases, *arguments.kinds]))
    workers = [start(kind, arguments) for kind in kinds]
    date = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    cases = [(envs, threads) for envs in arguments.envs for threads in arguments.threads]
    table: dict[str, list[str]] = {kind: [] for kind in kinds}
    with (arguments.output / "tasks.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(FIELDS)
        for envs, threads in cases:
            chosen = [worker for worker in workers if worker.name not in ONE_THREAD or threads == 1]
            rates = rates_in_turns(chosen, f"Hopper-v5 {envs} {threads} 1", arguments.seconds, arguments.rounds)
            for worker in workers:
                if worker.name not in rates:
                    table[worker.name].append("")
                    continue
                base = "julia-built-in" if worker.name in JULIA else "built-in"
                ratios = [a / b for a, b in zip(rates[worker.name], rates[base], strict=True)]
                ratio = f"{median(ratios):.3f}"
                table[worker.name].append(ratio)
                listed = " ".join(f"{r:.3f}" for r in ratios)
                rate = f"{median(rates[worker.name]):.0f}"
                writer.writerow([worker.name, envs, threads, rate, ratio, listed, worker.about, cpu_model(), date])
            print(f"{envs} x {threads}: " + ", ".join(f"{k} {v[-1]}" for k, v in table.items()), flush=True)
    for worker in workers:
        worker.end()
    header = ["speed / built-in", *(f"{envs} x {threads}" for envs, threads in cases)]
    lines = [header, ["---", *("---:" for _ in cases)], *([kind, *cells] for kind, cells in table.items())]
    text = "".join(f"| {' | '.join(line)} |\n" for line in lines) + f"\nCPU: {cpu_model()}. {date}.\n"
    (arguments.output / "tasks.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
