"""The arrays that the calls of a vector environment write, and Gymnasium's infos made from them."""

from __future__ import annotations

from ctypes import c_double, c_uint8
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi.declarations import Role
from mjenv.capi.dtypes import FLOATS, Float64Array
from mjenv.capi.handle import Batch, Rows, pointer_to
from mjenv.capi.schema import Field
from mjenv.rows.observations import Observations
from mjenv.rows.step import Info, dtype_of, views

BoolArray = NDArray[np.bool_]

_FLOAT64 = np.dtype(np.float64)


class _Places:
    """The places, in the infos and in the library's arrays, of the rows that a mask over the reported rows selects."""

    __slots__ = ("mask", "source", "target")

    def __init__(self, mask: BoolArray, rows: NDArray[np.int64] | None) -> None:
        self.mask = mask
        self.target: NDArray[np.intp] = np.flatnonzero(mask)
        self.source: NDArray[Any] = self.target if rows is None else rows[self.target]


class _Layout:
    """Makes infos from one role's block of values."""

    def __init__(self, fields: tuple[Field, ...], rows: int, action_dtype: np.dtype[Any]) -> None:
        # name, name of the mask, part of the block, its shape, dtype
        self._parts = tuple(
            (
                field.name,
                f"_{field.name}",
                slice(field.offset * rows, (field.offset + field.count) * rows),
                (rows, *field.shape),
                dtype_of(field.type, action_dtype),
            )
            for field in fields
        )
        self._masks: BoolArray = np.ones((len(fields), rows), np.bool_)

    def whole(self, values: Float64Array, mask: BoolArray | None = None) -> Info:
        """Infos of all rows as views of the values, which are 0 where the mask is False."""
        infos: Info = {}
        masks: BoolArray = self._masks.copy() if mask is None else self._masks & mask
        for (name, mask_name, part, shape, dtype), own_mask in zip(self._parts, masks, strict=True):
            value: NDArray[Any] = values[part]
            if len(shape) > 1:
                value = value.reshape(shape)
            infos[name] = value if dtype is _FLOAT64 else value.astype(dtype)
            infos[mask_name] = own_mask
        return infos

    def add(self, infos: Info, values: Float64Array, places: _Places) -> None:
        """Adds what these rows have. As in Gymnasium, the first to bring a key sets its dtype."""
        mask, target, source = places.mask, places.target, places.source
        for name, mask_name, part, shape, dtype in self._parts:
            value: NDArray[Any] = values[part]
            if len(shape) > 1:
                value = value.reshape(shape)
            if name in infos:
                infos[mask_name] |= mask
            else:
                infos[name] = np.zeros((len(mask), *shape[1:]), dtype)
                infos[mask_name] = mask.copy()
            infos[name][target] = value[source]


class Outputs(Batch):
    """The arrays that calls on all rows write."""

    def __init__(self, rows: Rows, dtype: np.dtype[Any], *, final: bool) -> None:
        count = rows.count
        self.observations = Observations(rows, dtype)
        super().__init__(count, self.observations.shape, rows.size(Role.INFO), FLOATS[dtype])
        self.nu = rows.size(Role.ACTION)
        self.terminated, self.truncated = self.ended

        # A bytearray, because searching it is the fastest way to find out that no row was reset.
        self.resets = bytearray(count)
        self.was_reset: BoolArray = np.frombuffer(self.resets, np.bool_)
        self.struct.reset_info_count, self.struct.arrays_count = rows.size(Role.RESET_INFO), rows.size(Role.ARRAYS)
        self.reset_info = np.zeros(count * self.struct.reset_info_count)
        self.exported = np.zeros(count * self.struct.arrays_count)
        self.arrays = views(self.exported, rows.fields(Role.ARRAYS), count)
        self.struct.was_reset = pointer_to(self.was_reset, c_uint8)
        self.struct.reset_info = pointer_to(self.reset_info, c_double)
        self.struct.arrays = pointer_to(self.exported, c_double)

        self.final = final
        if final:
            self.final_obs, self.final_info = np.zeros_like(self.obs), np.zeros_like(self.info)
            self.struct.final_obs = self.final_obs.ctypes.data
            self.struct.final_info = pointer_to(self.final_info, c_double)

        self._layouts = {kind: _Layout(rows.fields(Role.INFO), count, kind) for kind in FLOATS}
        self._reset_layout = _Layout(rows.fields(Role.RESET_INFO), count, np.dtype(np.float64))

    def reset_infos(self, mask: BoolArray | None) -> Info:
        """The infos of a reset of the masked rows."""
        if mask is None:
            return self._reset_layout.whole(self.reset_info.copy())
        infos: Info = {}
        self._reset_layout.add(infos, self.reset_info, _Places(mask, None))
        return infos

    def step_infos(self, action_dtype: np.dtype[Any], rows: NDArray[np.int64] | None = None) -> Info:
        """The infos of a step of these rows; None: of all rows."""
        layout = self._layouts[action_dtype]
        if rows is None and 1 not in self.resets:
            return layout.whole(self.info.copy())
        was_reset = self.was_reset if rows is None else self.was_reset[rows]
        stepped = ~was_reset
        infos: Info = {}
        # Gymnasium goes through the rows in order, so the first row decides whose keys come first.
        steps_first = len(stepped) > 0 and bool(stepped[0])
        if steps_first and rows is None:
            infos = layout.whole(self.info.copy(), stepped)
        elif steps_first:
            layout.add(infos, self.info, _Places(stepped, rows))
        if was_reset.any():
            places = _Places(was_reset, rows)
            if self.final:
                self._add_final(infos, layout, places)
            self._reset_layout.add(infos, self.reset_info, places)
        if not steps_first and stepped.any():
            layout.add(infos, self.info, _Places(stepped, rows))
        return infos

    def _add_final(self, infos: Info, layout: _Layout, places: _Places) -> None:
        final_obs = np.full(len(places.mask), None, dtype=object)
        for row, obs in zip(places.target.tolist(), self.final_obs[places.source], strict=True):
            final_obs[row] = self.observations.copy(obs)
        final_info: Info = {}
        layout.add(final_info, self.final_info, places)
        infos["final_obs"], infos["_final_obs"] = final_obs, places.mask.copy()
        infos["final_info"], infos["_final_info"] = final_info, places.mask.copy()
