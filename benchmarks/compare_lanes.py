"""Compares builds of benchmarks/lanes, numbers of lanes, and mujoco.batch of MuJoCo 4.0: the time of a step of one row.

Each NAME is an ID or model as benchmarks/lanes takes it. All step 64 rows under random controls on one thread, in
turns, each time in a new process. The time is CPU time; that of the start is taken off, because each process also runs
with few steps. Prints CSV: for each name the first build's microseconds without lanes, then how many times as fast the
others are (medians of the ratios within each round), and at the end the geometric means.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from statistics import geometric_mean, median

from common import cpu_model

ROWS = 64
# Steps the model of a file by mujoco.batch, and prints the seconds of CPU time for a step of one row.
BATCH = """
import sys, time
import mujoco, numpy as np
from mujoco.batch import Batch
file, frames, rows, steps = sys.argv[1], *map(int, sys.argv[2:])
model = mujoco.MjModel.from_xml_path(file)
batch = Batch(model, rows, 1)
qpos, qvel, ctrl = (batch.bind(name) for name in ("qpos", "qvel", "ctrl"))
start = mujoco.MjData(model).qpos.copy()
random = np.random.default_rng(0)
low, high = np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, [-1, 1]).T
began = 0
for step in range(-5, steps):
    if step == 0:
        began = time.process_time()
    if step % 50 == 0:
        qpos[:], qvel[:] = start, 0
    ctrl[:] = random.uniform(low, high, (rows, model.nu))
    batch.step(nstep=frames)
print((time.process_time() - began) / (steps * rows))
"""


def cpu_seconds(command: list[str]) -> float:
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"{' '.join(command)} failed")
    return usage.ru_utime + usage.ru_stime


def seconds_of_step(program: str, name: str, lanes: int, steps: int) -> float:
    few = cpu_seconds([program, "play", name, str(lanes), "1"])
    return (cpu_seconds([program, "play", name, str(lanes), str(1 + steps)]) - few) / (steps * ROWS)


def seconds_of_batch(python: str, name: str, steps: int) -> float:
    file, _, frames = name.partition(".xml")
    command = [python, "-c", BATCH, f"{file}.xml", frames[1:] or "1", str(ROWS), str(steps)]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("names", nargs="+", metavar="NAME")
    add("--program", required=True, type=os.path.abspath, help="benchmarks/lanes of a build")
    add("--other", type=os.path.abspath, help="benchmarks/lanes of another build")
    add("--batch", help="a Python with MuJoCo 4.0 (tools/setup peers)")
    add("--lanes", type=int, default=4, help="(4)")
    add("--seconds", type=float, default=0.5, help="of CPU time for each turn, about (0.5)")
    add("--rounds", type=int, default=7, help="(7)")
    arguments = parser.parse_args()
    columns = {"lanes": (arguments.program, arguments.lanes)}
    if arguments.other:
        columns |= {"other, no lanes": (arguments.other, 0), "other, lanes": (arguments.other, arguments.lanes)}
    heads = [*columns, *(["mujoco.batch"] if arguments.batch else [])]
    print(f"# {cpu_model()}, {arguments.lanes} lanes, {ROWS} rows, one thread")
    print("name,us", *(f'"{head}"' for head in heads), sep=",")
    all_ratios: dict[str, list[float]] = {head: [] for head in heads}
    for name in arguments.names:
        steps = max(20, int(arguments.seconds / (ROWS * seconds_of_step(arguments.program, name, 0, 20))))
        alone, ratios = [], {head: [] for head in heads}
        for _ in range(arguments.rounds):
            alone.append(seconds_of_step(arguments.program, name, 0, steps))
            for head, (program, lanes) in columns.items():
                ratios[head].append(alone[-1] / seconds_of_step(program, name, lanes, steps))
            if arguments.batch:
                ratios["mujoco.batch"].append(alone[-1] / seconds_of_batch(arguments.batch, name, steps))
        for head in heads:
            all_ratios[head].append(median(ratios[head]))
        medians = [f"{median(ratios[head]):.3f}" for head in heads]
        print(Path(name).name, f"{1e6 * median(alone):.2f}", *medians, sep=",", flush=True)
    print("geometric mean", "", *(f"{geometric_mean(all_ratios[head]):.3f}" for head in heads), sep=",")


if __name__ == "__main__":
    main()
