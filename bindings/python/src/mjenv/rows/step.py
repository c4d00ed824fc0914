"""The hot path from a user's step to the library's, in as few operations of Python as possible.

1. Step.step looks up the buffer and the prepared call for the dtype of the actions, and checks their shape.
2. It takes the handle's turn (_turns.py), because a second thread could overwrite the buffers during the call, in which
   other threads of Python run. It does not wait for the turn but raises BusyError, because a call can take minutes.
3. It copies the actions into the buffer. The library reads them there, so that the arguments of the call never change
   and are converted once.
4. It calls the library.
5. It copies the results while no other thread can overwrite them.
6. It gives the turn back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from operator import methodcaller
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjenv.capi.declarations import Dtype, Status
from mjenv.capi.dtypes import BOOL, FLOATS, Float64Array
from mjenv.capi.handle import Rows
from mjenv.capi.schema import Field
from mjenv.errors import InvalidValueError, OptionError

Results = TypeVar("Results")
Info = dict[str, Any]

_FLOAT64, _FLOAT32 = np.dtype(np.float64), np.dtype(np.float32)
# A value that the library, which writes 0 or 1, never writes to was_reset.
_UNTOUCHED = 2
# The types that are Python's own. The others are NumPy's scalars.
_PYTHON = (Dtype.NATIVE_FLOAT, Dtype.NATIVE_INT, BOOL)


class Step(Generic[Results]):
    """Steps all rows of a handle.

    shape: of the actions. out: a pointer to the mjenv_batch that a step writes. results: returns, for a dtype of the
    actions, the function that copies the outputs of a step. was_reset: the memory of the batch's array was_reset, if
    rows may fail while others are stepped; the exception then has the results.
    """

    def __init__(
        self,
        rows: Rows,
        shape: tuple[int, ...],
        out: Any,
        results: Callable[[np.dtype[Any]], Callable[[], Results]],
        was_reset: bytearray | None = None,
    ) -> None:
        self._rows, self._shape, self._was_reset = rows, shape, was_reset
        self._take, self._give_back = rows.turns.take_free, rows.turns.give_back
        self._inputs: dict[np.dtype[Any], tuple[NDArray[Any], Callable[[], int], Callable[[], Results]]] = {}
        for dtype, code in FLOATS.items():
            buffer = np.zeros(shape, dtype)
            call = rows.prepared("mjenv_step", None, buffer.ctypes.data, buffer.size, int(code), out)
            self._inputs[dtype] = buffer, call, results(dtype)

    def step(self, actions: ArrayLike) -> Results:
        """Takes a step in every row and returns copies of its results."""
        try:
            buffer, call, results = self._inputs[actions.dtype]  # type: ignore[union-attr]
        except (AttributeError, KeyError, TypeError):
            actions = float_array(actions)
            buffer, call, results = self._inputs[actions.dtype]
        if actions.shape != self._shape:  # type: ignore[union-attr]
            raise wrong_shape(actions, self._shape, self._rows)
        rows = self._rows
        if rows.lent:
            rows.flush()
        try:
            turn = [self._take()]
        except IndexError:
            turn = [rows.enter()]
        try:
            if rows.closed:
                raise rows.gone()
            buffer[...] = actions
            was_reset = self._was_reset
            if was_reset:
                was_reset[0] = _UNTOUCHED
            status = call()
            if status:
                error = rows.engine.last_error(status)
                # If was_reset is untouched, no row was stepped.
                if was_reset and was_reset[0] != _UNTOUCHED:
                    error.results = results()  # type: ignore[assignment]
                try:
                    raise error
                finally:
                    del error  # breaks the cycle of error, traceback and frame
            return results()
        finally:
            try:
                rows.moved()
            finally:
                self._give_back(turn.pop())


def float_array(actions: ArrayLike) -> NDArray[Any]:
    """Actions as float32 or float64 in this machine's byte order. Integers and bools become float64."""
    array = np.asarray(actions)
    if array.dtype.kind == "f" and array.dtype.itemsize == 4:
        return array.astype(np.float32)
    if array.dtype.kind in "biu" or (array.dtype.kind == "f" and array.dtype.itemsize == 8):
        return array.astype(np.float64)
    raise OptionError(f"an action holds float32 or float64 numbers, not {array.dtype}", Status.E_TYPE)


def wrong_shape(actions: Any, shape: tuple[int, ...], rows: Rows) -> InvalidValueError:
    """The exception for actions that do not have the shape that these rows take."""
    given = np.shape(actions)
    if len(shape) == 1:
        return InvalidValueError(f"the action has the shape {given}; {rows.id} takes {shape}", Status.E_SIZE)
    return InvalidValueError(
        f"the actions have the shape {given}; {rows.count} x {rows.id} take {shape}", Status.E_SIZE
    )


def dtype_of(kind: Any, action_dtype: np.dtype[Any]) -> np.dtype[Any]:
    """The dtype that a value has in Gymnasium, or for a Python number would have in an array."""
    if kind == Dtype.ACTION:
        return action_dtype
    return np.dtype(CONVERTERS.get(kind, np.float64))


# Converts an np.float64 to the type that the value has in Gymnasium or in a registered task.
CONVERTERS: dict[Any, type[Any]] = {
    BOOL: bool,
    Dtype.NATIVE_FLOAT: float,
    Dtype.NATIVE_INT: int,
    Dtype.INT64: np.int64,
    Dtype.FLOAT32: np.float32,
    Dtype.INT32: np.int32,
    Dtype.UINT8: np.uint8,
}


class Record:
    """How the fields of one row's record of float64 numbers become an info.

    items: the name of each field, and an index into the record, which copies an array. conversions: the names of fields
    whose type is not float64, each with its converter. narrowed: the names of numbers that are float32 because the
    action is, each with a buffer, which converts them in half the time of np.float32().
    """

    __slots__ = ("conversions", "items", "narrowed")

    def __init__(self, fields: Sequence[Field], action_dtype: np.dtype[Any]) -> None:
        self.items = tuple((field.name, _index_of(field)) for field in fields)
        converters = ((field.name, _converter(field, action_dtype)) for field in fields)
        self.conversions = tuple((name, convert) for name, convert in converters if convert)
        narrowed = [f for f in fields if f.type == Dtype.ACTION and action_dtype == np.float32 and not f.shape]
        self.narrowed = tuple((field.name, np.zeros(1, np.float32)) for field in narrowed)

    def read(self, record: Float64Array) -> Info:
        info = {}
        for name, index in self.items:
            info[name] = record[index]
        for name, convert in self.conversions:
            info[name] = convert(info[name])
        for name, buffer in self.narrowed:
            buffer[0] = info[name]
            info[name] = buffer[0]
        return info


def _converter(field: Field, action_dtype: np.dtype[Any]) -> Callable[[Any], Any] | None:
    """The converter of a field's float64 value or array; None if none is needed, or a buffer of Record.narrowed."""
    if not field.shape:
        return CONVERTERS.get(field.type)
    dtype = dtype_of(field.type, action_dtype)
    return None if dtype == _FLOAT64 else methodcaller("astype", dtype)


def _index_of(field: Field) -> Any:
    if not field.shape:
        return field.offset
    return np.arange(field.offset, field.offset + field.count).reshape(field.shape)


def views(values: Float64Array, fields: Iterable[Field], rows: int) -> dict[str, Float64Array]:
    """Each field's part, (rows, *shape), of a block that the library lays out field by field."""
    parts = ((field, values[field.offset * rows : (field.offset + field.count) * rows]) for field in fields)
    return {field.name: part.reshape(rows, *field.shape) for field, part in parts}


def infos_of_rows(
    fields: Sequence[Field], values: Float64Array, rows: int, action_dtype: np.dtype[Any], chosen: Any
) -> list[Info]:
    """One info for each chosen row, with the types that an environment of one row gives.

    values: a block that the library lays out field by field. chosen: an index along the rows.
    """
    columns: list[Any] = []
    for field, view in zip(fields, views(values, fields, rows).values(), strict=True):
        column = view[chosen].astype(dtype_of(field.type, action_dtype))
        columns.append(column.tolist() if field.type in _PYTHON and not field.shape else column)
    names = [field.name for field in fields]
    if not names:
        return [{} for _ in range(len(np.arange(rows)[chosen]))]
    return [dict(zip(names, of_row, strict=True)) for of_row in zip(*columns, strict=True)]
