"""The machine and the versions that a recording depends on."""

from __future__ import annotations

import ctypes
import os
import platform
import subprocess
import sys
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import gymnasium
import mujoco
import numpy as np

WANTED = {"python": "3.10", "gymnasium": "1.3.0", "mujoco": "2.2.2", "numpy": "2.2.6"}
# OpenBLAS's kernels, and the value of the library's option "norm" that rounds as they do.
KERNELS = {"Haswell": "plain", "SkylakeX": "fused"}


def hexed(values: Iterable[float]) -> str:
    """C99 hexadecimal numbers, which read back to the same bits."""
    return " ".join(float(value).hex() for value in values)


def openblas_kernel() -> str:
    """The kernel that NumPy's dot products run on."""
    for path in (Path(np.__file__).parent.parent / "numpy.libs").glob("*openblas*"):
        name = ctypes.CDLL(str(path)).scipy_openblas_get_corename64_
        name.restype = ctypes.c_char_p
        return str(name().decode())
    raise SystemExit("record.py: this NumPy has no OpenBLAS of its own; install NumPy's wheel")


def norm_rounding() -> str:
    """The value of the library's option "norm" that rounds as this NumPy does, found by computing a norm."""

    def add_squares(vector: list[float], fused: bool) -> float:
        total = vector[0] * vector[0]
        for x in vector[1:]:
            total = float(Fraction(x) ** 2 + Fraction(total)) if fused else total + x * x
        return total

    vectors = np.random.default_rng(0).normal(size=(500, 3)).tolist()
    vectors += [vector[:2] for vector in vectors]
    dots = [float(np.dot(np.array(vector), np.array(vector))) for vector in vectors]
    for name, fused in (("plain", False), ("fused", True)):
        if dots == [add_squares(vector, fused) for vector in vectors]:
            return name
    raise SystemExit(f"record.py: the dot products of kernel {openblas_kernel()} are neither plain nor fused")


def machine() -> dict[str, str]:
    """The machine's properties on which the last bits may depend."""
    cpu = "unknown"
    flags: set[str] = set()
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        key, _, value = line.partition(":")
        if key.strip() == "model name":
            cpu = value.strip()
        if key.strip() == "flags":
            flags = set(value.split())
    return {
        "gymnasium": gymnasium.__version__,
        "mujoco": mujoco.mj_versionString(),
        "numpy": np.__version__,
        "python": platform.python_version(),
        "cpu": cpu,
        "kernel": openblas_kernel(),
        "norm": norm_rounding(),
        "libm": "fma" if {"fma", "avx2"} <= flags else "sse2",
    }


def lines_of(facts: dict[str, str]) -> list[str]:
    return [f"{key} {value}" for key, value in facts.items()]


def run_under(coretype: str, *arguments: str, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    """record.py under another kernel, in a folder where MuJoCo's log of bad actions bothers nobody."""
    environment = dict(os.environ, OPENBLAS_CORETYPE=coretype)
    command = [sys.executable, str(Path(__file__).with_name("record.py")), *arguments]
    return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True)
