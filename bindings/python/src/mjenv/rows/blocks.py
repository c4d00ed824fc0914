"""Memory in which a reader sees an array of mjModel or mjData, as in MuJoCo's Python package.

What the reader gets is an ordinary array of NumPy. That of a Mirror the library itself reads and writes. It never sees
that of a Block: the block reads it, and before the library is called for anything else, Rows.flush writes the elements
that the reader has changed. After a call that may have changed the simulation, Rows.moved reads anew the arrays that
somebody still holds; the others are read when they are next asked for. So an array that is held shows the present
state, as in MuJoCo.
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

# Python's count of the references to an object. Without it, every array that was read counts as held.
_references: Callable[[object], int] = getattr(sys, "getrefcount", lambda _: 99)


class Mirror:
    """An array of an environment's only row. Reading and writing it costs what it costs in NumPy.

    array: what the reader gets; read-only if it cannot be written.
    """

    __slots__ = ("_name", "_rows", "_write", "array")

    def __init__(self, rows: Rows, field: Field) -> None:
        self._rows, self._name = rows, field.name
        self._write: Callable[..., None] | None = None
        self.array: NDArray[Any] = rows.mirror(field)[...]
        self.array.flags.writeable = rows.is_written(field)

    def lend(self) -> Any:
        """What the reader gets: the array, or a number."""
        return self.array if self.array.shape else self.array.item()

    def assign(self, values: Any) -> None:
        """Writes the whole array."""
        if self._write is None:
            numbers = np.empty(self.array.shape)
            given = 0, self._name.encode(), pointer_to(numbers, c_double), numbers.size
            self._write = self._rows.changer(Rows.prepared(self._rows, "mjenv_write_row", *given), [numbers])
        self._write(self._rows, values)


class Block:
    """An array of one row, or of ALL_ROWS: [rows, ...].

    array: what the reader gets; read-only if it cannot be written. changed: is called after a write.
    """

    __slots__ = (
        *("array", "name", "_rows", "_row", "_changed", "_owner", "_numbers", "_read", "_write"),
        *("_seen", "_unheld", "_is_lent"),
    )

    def __init__(self, rows: Rows, row: int, field: Field, changed: Callable[[], None]) -> None:
        shape = (rows.count, *field.shape) if row == ALL_ROWS else field.shape
        self._rows, self._row, self.name, self._changed = rows, row, field.name, changed
        self._is_lent = False
        self._owner: NDArray[Any] = np.empty(shape, rows.dtype_of(field))
        self._numbers = self._owner if self._owner.dtype == np.float64 else np.empty(shape)
        given = row, field.name.encode(), pointer_to(self._numbers, c_double), self._numbers.size
        self._read = Rows.prepared(rows, "mjenv_read", *given, byref(c_int64()))
        is_direct = row != ALL_ROWS and not rows.is_copied(field.name)
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
        return self.array if self.array.shape else self.array.item()

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
        self.write(mine)

    def assign(self, values: Any) -> None:
        """Writes the whole array."""
        self._rows.flush()
        self.read()
        self.write(values)

    def write(self, values: Any) -> None:
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
        """Takes note that the simulation has changed. Returns whether somebody holds the array, which then shows the
        new state."""
        if not self.is_held():
            return False
        self._fill()  # rows may be under way, or the row cannot be computed: who asks for the array anew gets the error
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
