"""The rows of a vector environment: what VectorEnv, its single rows and the adapter for Stable-Baselines3 share."""

from __future__ import annotations

import contextlib
import operator
import os
import weakref
from collections.abc import Mapping, Sequence
from ctypes import byref, c_int64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjenv.capi.declarations import Role, Status
from mjenv.capi.dtypes import FLOATS, Float64Array, laid_out
from mjenv.capi.handle import Rows, pointer_to
from mjenv.errors import AlreadyPendingCallError, BusyError, Error, InvalidValueError, NoAsyncCallError, OptionError
from mjenv.rows.arguments import check_seed
from mjenv.rows.outputs import BoolArray, Outputs
from mjenv.rows.pictures import Pictures
from mjenv.rows.step import float_array, wrong_shape

UNKNOWN_SEED = -1  # as in Gymnasium, for a stream that does not come from a seed


class Pool:
    """The rows' handle, the arrays that its calls write, the rows' seeds, and which rows are under way.

    Pickling keeps the episodes, the random streams and what the last call wrote.
    """

    def __init__(self, rows: Rows, obs_dtype: np.dtype[Any], *, final: bool, rendering: Mapping[str, Any]) -> None:
        """final: whether resets report the last observations of episodes. rendering: the arguments of Pictures."""
        self.rows, self.count = rows, rows.count
        self.pictures = Pictures(rows, **rendering)
        self.frame_skip = rows.frame_skip()
        # Whether the rows' states may have changed since the observations were written.
        self.stale = False
        self._obs_dtype, self._final = obs_dtype, final
        # None for a row that was never seeded.
        self._last_seeds: NDArray[np.object_] = np.full(rows.count, None, dtype=object)
        self._prepare()

    def _prepare(self) -> None:
        rows = self.rows
        self.outputs = Outputs(rows, self._obs_dtype, final=self._final)
        self.out = byref(self.outputs.struct)
        self.shape: tuple[int, int] = (self.count, self.outputs.nu)
        self._send, self._recv = rows.engine.mjenv_send, rows.engine.mjenv_recv
        # The number of rows between send and recv, and the dtype of their actions.
        self.pending = 0
        self._sent_float32: BoolArray = np.zeros(self.count, np.bool_)
        self._finalizer = weakref.finalize(self, _close, weakref.ref(rows))
        # Not at exit, because a daemon thread may still be stepping. (typeshed does not know this property.)
        self._finalizer.atexit = False  # type: ignore[misc]

    def __getstate__(self) -> dict[str, Any]:
        self.check_settled()
        kept = ("rows", "pictures", "count", "frame_skip", "stale", "_obs_dtype", "_final", "_last_seeds")
        state = {name: self.__dict__[name] for name in kept}
        outputs = self.outputs
        return {**state, "_written": (outputs.obs.copy(), outputs.status.copy(), outputs.exported.copy())}

    def __setstate__(self, state: dict[str, Any]) -> None:
        written = state.pop("_written")
        self.__dict__.update(state)
        self._prepare()
        outputs = self.outputs
        arrays: tuple[NDArray[Any], ...] = (outputs.obs, outputs.status, outputs.exported)
        for array, values in zip(arrays, written, strict=True):
            array[...] = values

    def close(self) -> None:
        """Frees the rows. Those under way are given up."""
        self.rows.close()
        self.pictures.close()
        self.pending = 0

    # ---- arguments and errors ----

    def actions(self, actions: ArrayLike, shape: tuple[int, ...]) -> NDArray[Any]:
        """Actions as a contiguous float32 or float64 array of that shape."""
        array = np.asarray(actions)
        if array.dtype not in FLOATS:
            array = float_array(array)
        if array.shape != shape:
            raise wrong_shape(array, shape, self.rows)
        return laid_out(array)

    def of_rows(self, name: str, values: ArrayLike, chosen: NDArray[np.intp]) -> Float64Array:
        """The chosen rows of new values (count, n) for an array of mjData, which must be finite."""
        field = self.rows.array(Role.DATA, name)
        assert field is not None
        array = np.asarray(values, np.float64)
        if array.shape != (self.count, *field.shape):
            shape = (self.count, *field.shape)
            raise InvalidValueError(f"{name} has the shape {array.shape}, not {shape}", Status.E_SIZE)
        found = array[chosen]
        if not np.isfinite(found).all():
            place, index = np.argwhere(~np.isfinite(found))[0]
            raise InvalidValueError(
                f"row {chosen[place]}: {name}[{index}] is {found[place, index]}, not finite", Status.E_VALUE
            )
        return found

    def row(self, row: int) -> int:
        """A row's number, checked."""
        number = operator.index(row)
        if not 0 <= number < self.count:
            raise InvalidValueError(f"row {number} is outside 0..{self.count - 1}", Status.E_VALUE)
        return number

    def changed(self) -> None:
        """Called after a row's state was changed other than by a step or a reset."""
        self.stale = True

    def check_settled(self) -> None:
        """Raises AlreadyPendingCallError if rows are under way."""
        if self.pending:
            raise AlreadyPendingCallError(f"{self.pending} row(s) are under way: call recv first", Status.E_PENDING)

    # ---- rows under way ----

    def send(self, actions: ArrayLike, rows: NDArray[np.int64] | None) -> None:
        """Begins a step of these rows, of all if rows is None."""
        self.rows.check_sendable()
        self.rows.flush()
        count = self.count if rows is None else len(rows)
        action = self.actions(actions, (count, self.shape[1]))
        pointer = None if rows is None else pointer_to(rows, c_int64)
        part: Any = slice(None) if rows is None else rows
        address, size, code = action.ctypes.data, action.size, FLOATS[action.dtype]
        # If an interrupt comes when the call returns, the rows are under way, and status keeps this value.
        status: int = Status.OK
        turn = [self.rows.enter()]
        try:
            env = self.rows.pointer
            try:
                status = self._send(env, pointer, count, address, size, code)
            finally:
                if not status:
                    self.pending += count
                    self._sent_float32[part] = action.dtype == np.float32
            self.rows.check(status)
        finally:
            self.rows.leave(turn.pop())

    def receive(self, least: int | None) -> tuple[NDArray[np.int64], Error | None]:
        """Waits for `least` rows under way; None: for all.

        Returns the rows that are done, ascending, and the error if some of them failed. The caller must have the turn,
        because another call would overwrite the outputs before they are copied.
        """
        env = self.rows.pointer
        if not self.pending:
            raise NoAsyncCallError("no rows are under way: call send first", Status.E_NOT_PENDING)
        wanted = self.pending if least is None else least
        buffer = np.empty(self.pending, np.int64)
        count = c_int64()
        pointer, size, received = pointer_to(buffer, c_int64), buffer.size, byref(count)
        try:
            status = self._recv(env, wanted, -1, pointer, size, received, self.out)
        finally:  # even after an interrupt, because these rows are no longer under way
            self.pending -= count.value
        if not count.value:
            self.rows.check(status)
        return np.sort(buffer[: count.value]), self.rows.engine.last_error(status) if status else None

    def sent_dtype(self, rows: NDArray[np.int64]) -> np.dtype[Any]:
        """The dtype of the actions of the first of these rows, on which the infos' dtypes depend."""
        float32 = len(rows) > 0 and self._sent_float32[rows[0]]
        return np.dtype(np.float32 if float32 else np.float64)

    # ---- seeds ----

    def all_seeds(self) -> tuple[int, ...]:
        """Each row's last seed; UNKNOWN_SEED if its stream came from a snapshot.

        First seeds the rows that were never seeded.
        """
        self.reseed(None, None)
        return tuple(self._last_seeds)

    def seed_of(self, row: int) -> int:
        """The same for one row."""
        if self._last_seeds[row] is None:
            seed = int.from_bytes(os.urandom(8), "little")
            self.rows.seed(row, seed)
            self._last_seeds[row] = seed
        given: int = self._last_seeds[row]  # a bool stays one, as in Gymnasium
        return given

    def reseed(self, seed: int | Sequence[int | None] | None, mask: BoolArray | None) -> None:
        """Seeds the masked rows; None: all rows.

        seed: an int seeds row i with seed + i; a sequence has a seed for each row, or None to keep the row's stream. A
        row that would have no seed, and never had one, gets one from the operating system.
        """
        seeds = self._listed(seed)
        rows = range(self.count) if mask is None else np.flatnonzero(mask).tolist()
        for row in rows:
            check_seed(seeds[row])
        new = [row for row in rows if seeds[row] is None and self._last_seeds[row] is None]
        for row, drawn in zip(new, np.frombuffer(os.urandom(8 * len(new)), np.uint64).tolist(), strict=True):
            seeds[row] = drawn
        self._give({row: seeds[row] for row in rows if seeds[row] is not None})

    def reseed_row(self, row: int, seed: int | None) -> None:
        """The same for one row, at a cost that does not depend on how many there are."""
        check_seed(seed)
        if seed is None:
            self.seed_of(row)
        else:
            self.rows.seed(row, seed)
            self._last_seeds[row] = seed

    def copy_seed(self, source: int, mask: BoolArray) -> None:
        """Notes that the masked rows now have the stream of the row `source`."""
        self._last_seeds[mask] = self._last_seeds[source]

    def forget_seed(self, row: int | None) -> None:
        """Notes that the stream of a row, of all rows if None, came from a snapshot."""
        self._last_seeds[slice(None) if row is None else row] = UNKNOWN_SEED

    def _listed(self, seed: Any) -> list[Any]:
        if seed is None:
            return [None] * self.count
        if isinstance(seed, int):
            return list(range(seed, seed + self.count))
        try:
            seeds = list(seed)
        except TypeError:
            raise OptionError(f"a seed is an int or a list of ints, not {seed!r}", Status.E_TYPE) from None
        if len(seeds) != self.count:
            raise InvalidValueError(f"{len(seeds)} seeds for {self.count} rows", Status.E_SIZE)
        return seeds

    def _give(self, seeds: Mapping[int, int]) -> None:
        small = {row: seed for row, seed in seeds.items() if seed < 2**64}
        if small:
            words, mask = np.zeros(self.count, np.uint64), np.zeros(self.count, np.bool_)
            words[[*small]], mask[[*small]] = [*small.values()], True
            self.rows.seed_rows(words, mask)
        for row in seeds.keys() - small.keys():
            self.rows.seed(row, seeds[row])
        for row, seed in seeds.items():
            self._last_seeds[row] = seed


def _close(rows: weakref.ref[Rows]) -> None:
    """Frees the rows now, or if a thread is using them, when it has dropped them."""
    found = rows()
    if found is not None:
        with contextlib.suppress(BusyError):
            found.close()
