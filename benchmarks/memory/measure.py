"""Measures how long creating many environments takes, and their memory; benchmarks/memory/run calls it."""

from __future__ import annotations

import argparse
import csv
import datetime
import os
import subprocess
import tempfile
from pathlib import Path

from common import cpu_model

HERE = Path(__file__).resolve().parent
THREADS = "2"
# peer, id, environments
CASES = (
    ("mjenv-c", "Reacher-v5", "1000000"),
    ("mjenv", "Reacher-v5", "1000000"),
    ("mujoco-batch", "Reacher-v5", "1000000"),
    ("mjenv-c", "Humanoid-v5", "1024"),
    ("mjenv", "Humanoid-v5", "1024"),
    ("mujoco-batch", "Humanoid-v5", "1024"),
    ("envpool", "Humanoid-v5", "1024"),
    ("mjenv-c", "Ant-v5", "1024"),
    ("mjenv", "Ant-v5", "1024"),
    ("mujoco-batch", "Ant-v5", "1024"),
    ("envpool", "Ant-v5", "1024"),
)
NAMES = {
    "mjenv-c": "mjenv, C",
    "mjenv": "mjenv, `make_vec`, with its outputs",
    "mujoco-batch": "mujoco.batch (physics only)",
    "envpool": "EnvPool, with its outputs",
}
FIELDS = "id envs threads peer seconds_first seconds_again bytes_few bytes_all cpu cpus date".split()
Row = dict[str, str]


def ask(arguments: argparse.Namespace, mode: str, peer: str, id: str, envs: str) -> list[str]:
    """Measures in a new process."""
    environment = {**os.environ, "MJENV_LIBRARY": arguments.library, "PYTHONPATH": arguments.package}
    command = [arguments.program, mode, arguments.library]
    if peer != "mjenv-c":
        python = arguments.reference_python if peer == "mjenv" else arguments.peers_python
        command = [python, str(HERE / "create.py"), mode, peer]
    # MuJoCo writes a log of warnings where it runs.
    answer = subprocess.run(
        [*command, id, envs, THREADS],
        env=environment,
        cwd=tempfile.gettempdir(),
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return answer.stdout.split()[-2:]


def measure(arguments: argparse.Namespace, peer: str, id: str, envs: str) -> Row:
    values = [
        id,
        envs,
        THREADS,
        peer,
        *ask(arguments, "seconds", peer, id, envs),
        *ask(arguments, "bytes", peer, id, envs),
    ]
    date = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    return dict(zip(FIELDS, [*values, cpu_model(), str(len(os.sched_getaffinity(0))), date], strict=True))


def table(rows: list[Row]) -> str:
    lines = [
        "| environments | by | created first | created again | memory | memory of one environment a thread |",
        "| --- | --- | ---: | ---: | ---: | ---: |",
    ]
    for row in rows:
        times = [f"{digits(1000 * float(row[name]))} ms" for name in ("seconds_first", "seconds_again")]
        sizes = [f"{digits(int(row[name]) / 1e6)} MB" for name in ("bytes_all", "bytes_few")]
        what = f"{int(row['envs']):,} {row['id']}"
        lines.append(f"| {' | '.join([what, NAMES[row['peer']], *times, *sizes])} |")
    return "\n".join(lines) + "\n"


def digits(value: float) -> str:
    """Three digits, because more would be noise."""
    return f"{float(f'{value:.3g}'):,g}"


def main() -> None:
    parser = argparse.ArgumentParser(prog="benchmarks/memory/run", description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("build/memory"), help="folder of the CSV and the table")
    for name in ("library", "package", "program", "reference-python", "peers-python"):
        parser.add_argument(f"--{name}", required=True, type=os.path.abspath, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    rows = []
    for done, case in enumerate(CASES):
        print(f"[{done + 1}/{len(CASES)}] {' '.join(case)}", flush=True)
        rows.append(measure(arguments, *case))
    with (arguments.output / "memory.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    (arguments.output / "memory.md").write_text(table(rows))
    print(f"{table(rows)}\nwrote {arguments.output / 'memory.csv'}, {arguments.output / 'memory.md'}")


if __name__ == "__main__":
    main()
