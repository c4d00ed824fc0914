"""Arrays whose changes are written to the simulation, like those of MuJoCo's Python package."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass
class Origin:
    """The array of the simulation from which a copy was read."""

    copy: NDArray[Any]  # the whole array
    read: Callable[[], NDArray[Any]]
    write: Callable[[NDArray[Any]], None]


class WrittenArray(np.ndarray[Any, Any]):
    """A copy of an array of mjModel or mjData. Assigning to its elements, or to a view, writes the simulation's array.

    Results computed from it, and copies of it, are ordinary arrays. Other functions that change an array in place
    (np.copyto, sort) raise, because their changes would not be written.
    """

    _origin: Origin | None = None

    def __array_finalize__(self, source: Any) -> None:
        self._origin = getattr(source, "_origin", None)

    def __setitem__(self, key: Any, value: Any) -> None:
        origin = self._refreshed()
        with _unlocked(*([] if origin is None else [origin.copy, self])):
            super().__setitem__(key, value)
        self._write(origin)

    def fill(self, value: Any) -> None:
        self[...] = value

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: str, *inputs: Any, out: tuple[Any, ...] = (), **arguments: Any
    ) -> Any:
        plain = tuple(_plain(array) for array in inputs)
        if not out:
            return getattr(ufunc, method)(*plain, **arguments)
        written = [(array, array._refreshed()) for array in out if isinstance(array, WrittenArray)]
        with ExitStack() as stack:
            for array, origin in written:
                if origin is not None:
                    stack.enter_context(_unlocked(origin.copy, array))
            getattr(ufunc, method)(*plain, out=tuple(_plain(array) for array in out), **arguments)
        for array, origin in written:
            array._write(origin)
        return out[0] if len(out) == 1 else out

    def _refreshed(self) -> Origin | None:
        """The origin, if this is a view of what was read from it. Other elements may have been written since."""
        origin = self._origin
        if origin is None or not np.may_share_memory(self, origin.copy):
            return None
        with _unlocked(origin.copy):
            origin.copy[...] = origin.read()
        return origin

    def _write(self, origin: Origin | None) -> None:
        if origin is None:
            return
        try:
            origin.write(origin.copy)
        except BaseException:
            with _unlocked(origin.copy):
                origin.copy[...] = origin.read()
            raise


@contextmanager
def _unlocked(*arrays: NDArray[Any]) -> Iterator[None]:
    """Makes the arrays writeable for a moment: first an array, then a view of it."""
    for array in arrays:
        array.flags.writeable = True
    try:
        yield
    finally:
        for array in arrays:
            array.flags.writeable = False


def _plain(array: Any) -> Any:
    return array.view(np.ndarray) if isinstance(array, WrittenArray) else array


def written_array(
    values: NDArray[Any], read: Callable[[], NDArray[Any]], write: Callable[[NDArray[Any]], None]
) -> WrittenArray:
    """The values, which `read` has returned, as an array whose changes are passed to `write`."""
    copy = np.array(values)
    copy.flags.writeable = False
    array = copy.view(WrittenArray)
    array._origin = Origin(copy, read, write)
    return array
