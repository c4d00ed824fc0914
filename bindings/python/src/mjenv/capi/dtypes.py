"""NumPy's dtypes of the library's arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi.declarations import Dtype

Float64Array = NDArray[np.float64]

# The dtypes in which the library takes actions and gives observations.
FLOATS: dict[np.dtype[Any], Dtype] = {np.dtype(np.float64): Dtype.FLOAT64, np.dtype(np.float32): Dtype.FLOAT32}

# The type of bools in infos of NumPy tasks.
BOOL = np.dtype(np.bool_)

DTYPES: dict[Any, type[np.generic]] = {
    Dtype.FLOAT64: np.float64,
    Dtype.INT64: np.int64,
    Dtype.FLOAT32: np.float32,
    Dtype.INT32: np.int32,
    Dtype.UINT8: np.uint8,
}


def laid_out(values: Any, dtype: Any = None) -> NDArray[Any]:
    """The values as C reads them: one after the other, at aligned addresses."""
    return np.require(values, dtype, ("C_CONTIGUOUS", "ALIGNED"))
