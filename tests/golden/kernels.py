"""Tells which kernel OpenBLAS chose and how that kernel rounds a dot product.

As a script: kernels.py OPENBLAS prints both. It imports no NumPy, so that it starts quickly in an emulator, too.
"""

from __future__ import annotations

import ctypes
import random
import sys
from collections.abc import Callable, Sequence
from fractions import Fraction

# OpenBLAS gives this name to its kernel for CPUs before Nehalem.
OLDEST = "Katmai"


def openblas(path: str) -> ctypes.CDLL:
    library = ctypes.CDLL(path)
    library.scipy_openblas_get_corename64_.restype = ctypes.c_char_p
    library.scipy_cblas_ddot64_.restype = ctypes.c_double
    return library


def kernel(library: ctypes.CDLL) -> str:
    return str(library.scipy_openblas_get_corename64_().decode())


def dot_of(library: ctypes.CDLL) -> Callable[[Sequence[float]], float]:
    """The dot product of a vector with itself."""

    def dot(vector: Sequence[float]) -> float:
        array = (ctypes.c_double * len(vector))(*vector)
        one = ctypes.c_int64(1)
        return float(library.scipy_cblas_ddot64_(ctypes.c_int64(len(vector)), array, one, array, one))

    return dot


def rounding(dot: Callable[[Sequence[float]], float]) -> str:
    """The value of the library's option "norm" that rounds as `dot` does, or "other"; found by trying."""

    def add_squares(vector: Sequence[float], fused: bool) -> float:
        total = vector[0] * vector[0]
        for x in vector[1:]:
            total = float(Fraction(x) ** 2 + Fraction(total)) if fused else total + x * x
        return total

    generator = random.Random(0)
    vectors = [[generator.gauss(0, 1) for _ in range(count)] for count in [2, 3] * 100]
    dots = [dot(vector) for vector in vectors]
    for name, fused in (("plain", False), ("fused", True)):
        if dots == [add_squares(vector, fused) for vector in vectors]:
            return name
    return "other"


if __name__ == "__main__":
    loaded = openblas(sys.argv[1])
    print(kernel(loaded), rounding(dot_of(loaded)))
