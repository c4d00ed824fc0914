"""Memory in which a reader sees an array of mjModel or mjData, as in MuJoCo's Python package.

What the reader gets is an ordinary array of NumPy. The library never sees it: a block reads it, and before the library
is called for anything else, Rows.flush writes the elements that the reader has changed. After a call that may have
changed the simulation, Rows.moved reads anew the arrays that somebody still holds; the others are read when they are
next asked for. So an array that is held shows the present state, as in MuJoCo.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from ctypes import byref, c_double, c_int64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi.declarations import ALL_ROWS
from mjenv.capi.handle import Rows, pointer_to
from mjenv.capi.schema import Field

# For how many moves an array that is read in every state is read before the program asks for it, which is faster.
_FOLLOWED = 15
# Python's count of the references to an object. Without it, every array that was read counts as held.
_references: Callable[[object], int] = getattr(sys, "getrefcount", lambda _: 99)


class Block:
    """An array of one row, or of ALL_ROWS: [rows, ...].

    array: what the reader gets; read-only if it cannot be written. changed: is called after a write. kept: a dict in
    which the present array is under the name `key`; None if there is no such dict.
    """

    __slots__ = (
        *("array", "name", "kept", "_key", "_rows", "_row", "_changed", "_owner", "_numbers", "_read", "_write"),
        *("_seen", "_unheld", "_is_lent", "_moves", "_followed"),
    )

    def __init__(
        self, rows: Rows, row: int, field: Field, changed: Callable[[], None], kept: dict[str, Any] | None, key: str
    ) -> None:
        shape = (rows.count, *field.shape) if row == ALL_ROWS else field.shape
        self._rows, self._row, self.name, self._changed = rows, row, field.name, changed
        self.kept, self._key, self._is_lent = kept, key, False
        # In which state it was last lent, and for how many moves it is read without being asked for.
        self._moves = self._followed = 0
        self._owner: NDArray[Any] = np.empty(shape, rows.dtype_of(field))
        self._numbers = self._owner if self._owner.dtype == np.float64 else np.empty(shape)
        given = row, field.name.encode(), pointer_to(self._numbers, c_double), self._numbers.size
        self._read = Rows.prepared(rows, "mjenv_read", *given, byref(c_int64()))
        # NumPy tasks have copies of the parameters, which their method `write` keeps up to date.
        is_direct = row != ALL_ROWS and not field.name.startswith("parameters.")
        self._write = Rows.prepared(rows, "mjenv_write_row", *given) if is_direct else None
        # The bytes that were last read; None if the array cannot be written.
        self._seen = b"" if rows.is_written(field) else None
        self.array = self._owner[...]
        self.array.flags.writeable = self._seen is not None
        self._unheld = _references(self._owner) + _references(self.array)

    def lend(self) -> Any:
        """Brings the array up to date, and returns what the reader gets: the array, or a number."""
        self.read()
        if not self._is_lent:
            self._is_lent = True
            self._rows.lent.append(self)
            if self.kept is not None and self._moves == self._rows.moves - 1:  # it was read before the last move, too
                self._followed = _FOLLOWED
        value = self.array if self.array.shape else self.array.item()
        if self.kept is not None:
            self.kept[self._key] = value
        return value

    def read(self) -> None:
        """Brings the array up to date."""
        self._call(self._fill)

    def _fill(self) -> int:
        status = self._read()
        if self._numbers is not self._owner:
            self._owner[...] = self._numbers
        if self._seen is not None:
            self._seen = self._owner.tobytes()
        return status

    def is_changed(self) -> bool:
        """Whether the reader has changed elements."""
        return self._seen is not None and self._seen != self._owner.tobytes()

    def flush(self) -> None:
        """Writes the elements that the reader has changed. If that raises, the array is as before the change."""
        mine, seen, bits = self._owner.copy(), self._seen, f"u{self._owner.itemsize}"
        self.read()
        if seen != self._seen:  # another reader has written other elements
            assert seen is not None
            differs = mine.view(bits) != np.frombuffer(seen, bits).reshape(mine.shape)
            mine = np.where(differs, mine, self._owner)
        self.assign(mine)

    def assign(self, values: Any) -> None:
        """Writes the whole array, which must be up to date."""
        if self._write is not None:
            self._numbers[...] = values
            try:
                self._call(self._write)
            finally:
                self.read()
        else:
            numbers = np.empty(self._owner.shape)
            numbers[...] = values
            if self._row != ALL_ROWS:
                self._rows.write(self._row, self.name, numbers, by_reader=True)
            else:
                differs = (numbers != self._owner).reshape(len(numbers), -1).any(axis=1)
                self._rows.write_rows(differs, self.name, numbers, by_reader=True)
            self.read()
        self._changed()

    def is_held(self) -> bool:
        """Whether somebody holds the array, or a view of it."""
        self._is_lent = _references(self._owner) + _references(self.array) > self._unheld
        return self._is_lent

    def moved(self) -> bool:
        """Takes note that the simulation has changed. Returns whether the array shows the new state.

        It does if somebody holds it, and for a while if it was read in two states one after the other.
        """
        kept = self.kept
        if self._followed:
            self._followed -= 1
        else:
            self._moves = self._rows.moves - 1
            if kept is not None:
                kept.pop(self._key, None)
            if not self.is_held():
                return False
        # Rows may be under way, or the row cannot be computed: who asks for the array anew gets the error.
        if self._fill():
            self._followed = 0
            if kept is not None:
                kept.pop(self._key, None)
        elif kept is not None and self._key in kept and not self.array.shape:
            kept[self._key] = self.array.item()
        return True

    def _call(self, call: Callable[[], int]) -> None:
        rows = self._rows
        turn = [rows.enter()]
        try:
            if rows.closed:
                raise rows.gone()
            rows.check(call())
        finally:
            rows.leave(turn.pop())
