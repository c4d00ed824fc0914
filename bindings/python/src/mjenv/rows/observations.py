"""Observations as Gymnasium has them: an array, or a dict of groups of terms (the option observation)."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Dict, Space
from numpy.typing import NDArray

from mjenv.capi.declarations import Role
from mjenv.capi.handle import Rows


class Observations:
    """The space of one row's observation. Makes observations from the library's arrays (..., n)."""

    def __init__(self, rows: Rows, dtype: np.dtype[Any]) -> None:
        low, high = (bound.astype(dtype) for bound in rows.bounds(Role.OBSERVATION))
        self.shape: tuple[int, ...] = low.shape
        self.space: Space[Any] = Box(low, high, dtype=dtype.type)
        self._keys = tuple(
            (key.name, slice(key.offset, key.offset + key.count), key.shape) for key in rows.fields(Role.GROUPS)
        )
        if self._keys:
            boxes = (
                (name, Box(low[part].reshape(shape), high[part].reshape(shape), dtype=dtype.type))
                for name, part, shape in self._keys
            )
            # Gymnasium sorts the keys of a dict, as those of goal environments are.
            self.space = Dict(dict(boxes) if rows.has_goals else OrderedDict(boxes))

    def view(self, array: NDArray[Any]) -> Any:
        """The array, or a dict of views of it."""
        if not self._keys:
            return array
        lead = array.shape[:-1]
        return {name: array[..., part].reshape(*lead, *shape) for name, part, shape in self._keys}

    def copy(self, array: NDArray[Any]) -> Any:
        """A copy of the array, or a dict of contiguous copies of its parts."""
        if not self._keys:
            return array.copy()
        return {name: part.copy() for name, part in self.view(array).items()}
