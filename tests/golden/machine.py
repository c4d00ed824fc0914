"""The machine and the versions that a recording depends on, and how to record as another machine would."""

from __future__ import annotations

import math
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import gymnasium
import mujoco
import numpy as np

import kernels

HERE = Path(__file__).resolve().parent
WANTED = {"gymnasium": "1.4.0", "numpy": "2.2.6"}
# Where the recordings of each version of MuJoCo are.
FOLDERS = {"2.2.2": HERE, "4.0.0": HERE / "mujoco4"}
# The C library computes sin, cos, exp, log1p and pow in one way on CPUs with FMA and AVX2, and in another way on all
# other CPUs. The sine of 692 tells the two apart.
SINES = {float.fromhex("0x1.80869e3fad89ap-1"): "fma", float.fromhex("0x1.80869e3fad899p-1"): "sse2"}
# Makes glibc compute as on a CPU without FMA.
WITHOUT_FMA = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"}
EMULATOR = "qemu-x86_64"
# A CPU for each kernel that OpenBLAS chooses by itself, as the emulator calls it. The emulator knows no AVX-512.
CPUS = {"SkylakeX": "", "Haswell": "Haswell", "Sandybridge": "SandyBridge", "Nehalem": "Nehalem"}


def hexed(values: Iterable[float]) -> str:
    """C99 hexadecimal numbers, which read back to the same bits."""
    return " ".join(float(value).hex() for value in values)


def libm() -> str:
    """The class of this machine's C library functions, and the name of the folder with its recordings."""
    value = math.sin(692)
    if value not in SINES:
        raise SystemExit(f"record.py: this C library's sin(692) is {value.hex()}, which belongs to no recording")
    return SINES[value]


def openblas_path() -> str:
    for path in (Path(np.__file__).parent.parent / "numpy.libs").glob("*openblas*"):
        return str(path)
    raise SystemExit("record.py: this NumPy has no OpenBLAS of its own; install NumPy's wheel")


def norm_rounding() -> str:
    """The value of the library's option "norm" that rounds as this NumPy does."""
    found = kernels.rounding(lambda vector: float(np.dot(np.array(vector), np.array(vector))))
    if found == "other":
        raise SystemExit("record.py: this NumPy's dot products are neither plain nor fused")
    return found


def machine() -> dict[str, str]:
    """The machine's properties on which the last bits may depend."""
    cpu = "unknown"
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        key, _, value = line.partition(":")
        if key.strip() == "model name":
            cpu = value.strip()
    return {
        "gymnasium": gymnasium.__version__,
        "mujoco": mujoco.mj_versionString(),
        "numpy": np.__version__,
        "python": platform.python_version(),
        "cpu": cpu,
        "kernel": kernels.kernel(kernels.openblas(openblas_path())),
        "norm": norm_rounding(),
        "libm": libm(),
    }


def lines_of(facts: dict[str, str]) -> list[str]:
    return [f"{key} {value}" for key, value in facts.items()]


def emulator(cpu: str) -> list[str] | None:
    """The words before a command that run it on an emulated CPU, or None where that cannot be done."""
    found = shutil.which(EMULATOR)
    return [found, "-cpu", CPUS[cpu]] if found and CPUS[cpu] else None


def dot_products(prefix: list[str], coretype: str | None) -> str:
    """KERNEL ROUNDING of NumPy's OpenBLAS with `coretype` in OPENBLAS_CORETYPE, or unset for None.

    The rounding is "crash" where OpenBLAS uses instructions that the CPU lacks. `prefix` is empty or an emulator's.
    """
    environment = {key: value for key, value in os.environ.items() if key != "OPENBLAS_CORETYPE"}
    environment["OPENBLAS_NUM_THREADS"] = "1"
    if coretype is not None:
        environment["OPENBLAS_CORETYPE"] = coretype
    command = [*prefix, sys.executable, "-I", "-S", str(HERE / "kernels.py"), openblas_path()]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    return done.stdout.strip() if done.returncode == 0 else "none crash"


class Run(NamedTuple):
    """A process that records with one class of the C library's functions and one kernel of OpenBLAS."""

    libm: str
    kernel: str

    @property
    def is_emulated(self) -> bool:
        """Whether the run needs an emulator: a CPU with FMA can do without it, but not the reverse."""
        return self.libm == "fma" and libm() == "sse2"

    def record(self, folder: Path) -> subprocess.CompletedProcess[str] | None:
        """Records into the folder, where MuJoCo also leaves its log. Returns None if there is no emulator."""
        prefix = emulator("Haswell") if self.is_emulated else []
        if prefix is None:
            return None
        environment = dict(os.environ, OPENBLAS_CORETYPE=self.kernel)
        if self.libm == "sse2":
            environment |= WITHOUT_FMA
        folder.mkdir()
        command = [*prefix, sys.executable, str(HERE / "record.py"), "--into", str(folder), *self]
        return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True)
