"""Measures CPU seconds per step of dm_control's suite for mjenv and its peers; benchmarks/dm_control/run calls it.

For each task every peer is opened in a process of its own, and then they take turns in short blocks, round after round,
so that whatever else the machine does meets all of them alike.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import os
from pathlib import Path
from statistics import geometric_mean, median

from common import Worker, cpu_model, rates_in_turns

HERE = Path(__file__).resolve().parent
TASKS = (
    "acrobot-swingup acrobot-swingup_sparse ball_in_cup-catch cartpole-balance cartpole-balance_sparse "
    "cartpole-swingup cartpole-swingup_sparse "
    "cartpole-two_poles cartpole-three_poles cheetah-run finger-spin finger-turn_easy "
    "finger-turn_hard fish-upright fish-swim hopper-stand hopper-hop humanoid-stand humanoid-walk humanoid-run "
    "humanoid-run_pure_state humanoid_CMU-stand humanoid_CMU-run lqr-lqr_2_1 lqr-lqr_6_2 manipulator-bring_ball "
    "manipulator-bring_peg manipulator-insert_ball manipulator-insert_peg pendulum-swingup point_mass-easy "
    "point_mass-hard quadruped-walk quadruped-run quadruped-escape quadruped-fetch reacher-easy reacher-hard "
    "stacker-stack_2 stacker-stack_4 swimmer-swimmer6 swimmer-swimmer15 walker-stand walker-walk walker-run"
).split()
# Each comparison: mjenv's peer, the other one, and what the table calls it.
PAIRS = (
    ("mjenv-suite", "dm_control", "one environment, `suite.load`"),
    ("mjenv-single", "dm_control", "one environment, `make`"),
    ("mj_step", "dm_control", "only `mj_step` of MuJoCo's library"),  # which bounds what the same physics can gain
    ("mjenv-64", "envpool-64", "64 rows, one thread"),
)
PEERS = ("dm_control", "mj_step", "mjenv-suite", "mjenv-single", "mjenv-64", "envpool-64")
# With --mujoco4, also of this model, which has elliptic cones, condim 6, friction and sensors, with its frame_skip
MODELS = [f"{HERE.parents[1]}/examples/models/quadruped.xml:5"]
MUJOCO4_PAIRS = (("mjenv-64", "mjenv-64-lanes0", "64 rows, one thread, on MuJoCo 4.0"),)
MUJOCO4_PEERS = ("mjenv-64", "mjenv-64-lanes0")
# With --pixels: CPU time for a picture and the two steps before it, drawn by EGL or OSMesa.
PIXEL_PAIRS = (
    ("mjenv-pixels", "dm_control-pixels", "pictures, one environment, `make_vec`"),
    ("mjenv-pixels-64", "dm_control-pixels", "pictures, 64 rows, one thread"),
)
PIXEL_PEERS = ("dm_control-pixels", "mjenv-pixels", "mjenv-pixels-64")
PIXEL_TASKS = ("cartpole-swingup", "cheetah-run", "walker-walk", "reacher-easy", "quadruped-walk", "humanoid-stand")


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="benchmarks/dm_control/run", description=__doc__)
    add = parser.add_argument
    add("--tasks", nargs="+", help="DOMAIN-TASK; default: all, with --pixels some")
    add("--pixels", choices=("egl", "osmesa"), help="measure pictures that this OpenGL draws")
    add("--mujoco4", action="store_true", help="measure mjenv on MuJoCo 4.0, with lanes and without")
    add("--seconds", type=float, default=0.3, help="CPU seconds of a block")
    add("--rounds", type=int, default=5, help="blocks of each peer")
    add("--output", type=Path, default=Path("build/dm_control"), help="a folder")
    add("--package", help=argparse.SUPPRESS)
    add("--dm-control-python", help=argparse.SUPPRESS)
    add("--peers-python", help=argparse.SUPPRESS)
    add("--mujoco4-python", help=argparse.SUPPRESS)
    return parser.parse_args()


def main() -> None:
    arguments = parse()
    peers = PIXEL_PEERS if arguments.pixels else MUJOCO4_PEERS if arguments.mujoco4 else PEERS
    environment = {
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "LP_NUM_THREADS": "1",  # of Mesa
        "MUJOCO_GL": arguments.pixels or "disabled",
        "TASKS": " ".join(TASKS + MODELS),
    }
    workers = {}
    for peer in peers:
        python = arguments.peers_python if peer.startswith("envpool") else arguments.dm_control_python
        own = {"PYTHONPATH": arguments.package} if peer.startswith("mjenv") else {}
        if peer.endswith("-lanes0"):
            own["MJENV_LANES"] = "0"
        command = [arguments.mujoco4_python or python, str(HERE / "worker.py"), peer.removesuffix("-lanes0")]
        workers[peer] = Worker(peer, command, environment | own)
    has = {peer: set(worker.ask("tasks").split()) for peer, worker in workers.items()}
    rows = []
    for task in arguments.tasks or (PIXEL_TASKS if arguments.pixels else TASKS + MODELS * arguments.mujoco4):
        chosen = [workers[peer] for peer in peers if task in has[peer]]
        rates = rates_in_turns(chosen, task, arguments.seconds, arguments.rounds)
        microseconds = {peer: 1e6 / median(found) for peer, found in rates.items()}
        name = task.rpartition("/")[2]
        rows.append(
            {"task": name, **{peer: f"{microseconds[peer]:.2f}" if peer in microseconds else "" for peer in peers}}
        )
        print(task, *(f"{peer} {value:.1f}" for peer, value in microseconds.items()), flush=True)
    arguments.output.mkdir(parents=True, exist_ok=True)
    name = "-".join(["dm_control", *filter(None, (arguments.pixels, arguments.mujoco4 and "mujoco4"))])
    with (arguments.output / f"{name}.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, ["task", *peers])
        table.writeheader()
        table.writerows(rows)
    text = report(rows, peers, [worker.about for worker in workers.values()], arguments)
    (arguments.output / f"{name}.md").write_text(text)
    print(text)
    for worker in workers.values():
        worker.end()


def report(rows: list[dict[str, str]], peers: tuple[str, ...], about: list[str], arguments: argparse.Namespace) -> str:
    pairs = PIXEL_PAIRS if arguments.pixels else MUJOCO4_PAIRS if arguments.mujoco4 else PAIRS
    unit = f"picture ({arguments.pixels}) and two steps" if arguments.pixels else "environment step"
    date = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    lines = [
        f"CPU microseconds per {unit}; medians of {arguments.rounds} blocks of {arguments.seconds} s, in turns.",
        f"{cpu_model()}, {len(os.sched_getaffinity(0))} CPUs, {date}. " + "; ".join(sorted(set(about))) + ".",
        "",
        "| task | " + " | ".join(peers) + " |",
        "|---|" + "---:|" * len(peers),
        *(f"| {row['task']} | " + " | ".join(row[peer] or "-" for peer in peers) + " |" for row in rows),
        "",
        "| how many times as fast as the other | geometric mean | least | most | tasks |",
        "|---|---:|---:|---:|---:|",
    ]
    for mine, other, name in pairs:
        ratios = {row["task"]: float(row[other]) / float(row[mine]) for row in rows if row[mine] and row[other]}
        if not ratios:
            continue
        least, most = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
        against = {"mjenv-64-lanes0": "no lanes"}.get(other) or other.removesuffix("-64").removesuffix("-pixels")
        lines.append(
            f"| {name}, against {against} | {geometric_mean(ratios.values()):.2f} | "
            f"{ratios[least]:.2f} ({least}) | {ratios[most]:.2f} ({most}) | {len(ratios)} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
