"""Checks of what callers pass to environments."""

from __future__ import annotations

import operator
from enum import Enum
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjenv.capi.declarations import Status
from mjenv.capi.dtypes import FLOATS, laid_out
from mjenv.errors import InvalidValueError, OptionError
from mjenv.rows.outputs import BoolArray

try:
    from gymnasium.vector import AutoresetMode as AutoresetMode  # type: ignore[attr-defined, unused-ignore]
except ImportError:  # gymnasium 1.0

    class AutoresetMode(Enum):  # type: ignore[no-redef, unused-ignore]
        """When a finished environment is reset."""

        NEXT_STEP = "NextStep"
        SAME_STEP = "SameStep"
        DISABLED = "Disabled"


def count_of(num_envs: Any) -> int:
    try:
        count = operator.index(num_envs)
    except TypeError:
        raise OptionError(f"num_envs is an int, not {num_envs!r}", Status.E_TYPE) from None
    if not 1 <= count < 2**63:
        raise InvalidValueError(f"num_envs is {count}, less than 1 or more than can be counted", Status.E_VALUE)
    return count


def time_limit_of(max_episode_steps: Any) -> int:
    """The library's option for Gymnasium's keyword: 0 means no limit."""
    if not isinstance(max_episode_steps, Integral) or (max_episode_steps < 1 and max_episode_steps != -1):
        raise InvalidValueError(f"max_episode_steps is an int >= 1, or -1 for no limit, not {max_episode_steps!r}")
    return max(0, int(max_episode_steps))


def autoreset_mode_of(mode: Any) -> AutoresetMode:
    if isinstance(mode, str) and mode.upper() in AutoresetMode.__members__:
        return AutoresetMode[mode.upper()]  # as the library spells it
    try:
        return AutoresetMode(mode)
    except ValueError:
        valid = ", ".join(repr(mode.value) for mode in AutoresetMode)
        raise InvalidValueError(f"autoreset_mode is one of {valid}, not {mode!r}", Status.E_VALUE) from None


def obs_dtype_of(dtype: Any) -> np.dtype[Any]:
    try:
        found: np.dtype[Any] | None = None if dtype is None else np.dtype(dtype)
    except TypeError:
        found = None
    if found is None or found not in FLOATS:
        raise OptionError(f"dtype is np.float64 or np.float32, not {dtype!r}", Status.E_TYPE)
    return found


def check_seed(seed: Any) -> None:
    if seed is None:
        return
    if not isinstance(seed, int):
        raise OptionError(f"a seed is a Python int or None, not {seed!r} of {type(seed)}", Status.E_TYPE)
    if seed < 0:
        raise InvalidValueError(f"a seed is at least zero, not {seed}", Status.E_VALUE)


def row_numbers(rows: ArrayLike) -> NDArray[np.int64]:
    numbers = np.asarray(rows)
    if numbers.ndim != 1:
        raise InvalidValueError(f"rows have the shape {numbers.shape}, not one dimension", Status.E_SIZE)
    if len(numbers) and numbers.dtype.kind not in "iu":
        raise OptionError(f"rows are ints, not {numbers.dtype}", Status.E_TYPE)
    return laid_out(numbers, np.int64)


def bool_mask(mask: Any, count: int, name: str) -> BoolArray:
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        kind = mask.dtype if isinstance(mask, np.ndarray) else type(mask).__name__
        raise OptionError(f"{name} is a NumPy array of bool, not {kind}", Status.E_TYPE)
    if mask.shape != (count,):
        raise InvalidValueError(f"{name} has the shape {mask.shape}, not {(count,)}", Status.E_SIZE)
    return np.ascontiguousarray(mask)


def reset_mask_of(options: Any, count: int) -> BoolArray | None:
    if options is None:
        return None
    if not isinstance(options, dict):
        raise OptionError(f"options are a dict or None, not {options!r}", Status.E_TYPE)
    if "reset_mask" not in options:
        return None
    mask = bool_mask(options["reset_mask"], count, "options['reset_mask']")
    if not mask.any():
        raise InvalidValueError("options['reset_mask'] names no row", Status.E_VALUE)
    return mask


def image_of(image: Any) -> bytes:
    """A snapshot's image as bytes."""
    if not isinstance(image, (bytes, bytearray, memoryview)):
        raise OptionError(f"an image is bytes, not {type(image).__name__}", Status.E_TYPE)
    return bytes(image)
