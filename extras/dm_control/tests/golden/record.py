"""Records short episodes of dm_control's suite for machines without it: fma/episodes.txt and sse2/episodes.txt.

    record.py            writes both files; needs a CPU with AVX-512
    record.py --check    records again, and compares what this CPU can give

Runs on the Python of `tools/setup dm_control`.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "disabled")
sys.path.append(str(Path(__file__).resolve().parents[4] / "tests/golden"))  # episodes.py and machine.py

# original_suite sets what NumPy reads when it is imported.
from original_suite import TASKS, flat, suite

# isort: split
import gymnasium
import numpy as np

from episodes import Checksum
from machine import WITHOUT_FMA, libm, norm_rounding

HERE = Path(__file__).resolve().parent
SEED, EPISODES, STEPS = 42, 3, 50


def line(task: tuple[str, str], norm: str) -> str:
    """The line of a task: ID NORM LENGTH RETURN CHECKSUM, as in episodes.txt."""
    env = suite.load(*task, {"random": SEED, "time_limit": float("inf")})
    spec = env.action_spec()
    space = gymnasium.spaces.Box(spec.minimum.astype(np.float32), spec.maximum.astype(np.float32))
    space.seed(SEED)
    checksum, length, total = Checksum(), 0, 0.0
    for _ in range(EPISODES):
        checksum.add(flat(env.reset().observation))
        for step in range(1, STEPS + 1):
            # lqr's motors have no bounds within which samples make sense.
            found = env.step(space.sample() * (task[0] != "lqr"))
            checksum.add(flat(found.observation), found.reward)
            checksum.add_word(int(found.last()))
            checksum.add_word(int(step == STEPS))
            length += 1
            total += float(found.reward)
            if found.last():
                break
    return f"dm_control/{'-'.join(task)}-v0 {norm} {length} {total.hex()} {checksum.value:016x}"


def recorded() -> str:
    versions = [f"{name} {version(name)}" for name in ("dm_control", "mujoco", "numpy")]
    lines = [
        f"# What dm_control's suite gives for {EPISODES} episodes of {STEPS} steps: ID NORM LENGTH RETURN CHECKSUM, as"
        " in episodes.txt. An episode is truncated in its last step. The actions of lqr are 0.",
        f"# {', '.join(versions)}, norm {norm_rounding()}, libm {libm()}",
        *(line(task, norm_rounding()) for task in TASKS),
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    check = parser.parse_args().check
    path = HERE / libm() / "episodes.txt"
    if not check:
        path.write_text(recorded())
    else:
        wanted = path.read_text().splitlines()[1:]
        # The norms are those of OpenBLAS's kernel for this CPU.
        if f"norm {norm_rounding()}" not in wanted[0]:
            print(f"{path} was recorded with norms that this CPU rounds otherwise, so it is not compared")
        elif wanted != recorded().splitlines()[1:]:
            raise SystemExit(f"{path} differs from what dm_control gives here")
    if libm() == "fma":
        command = [sys.executable, __file__, *["--check"][: int(check)]]
        subprocess.run(command, check=True, env={**os.environ, **WITHOUT_FMA, "OPENBLAS_CORETYPE": "Nehalem"})


if __name__ == "__main__":
    main()
