"""Tasks in machine code that numba compiles from Python. Needs the package numba.

The decorators reset, reset_info, carry, observe and step turn functions into callbacks of mjenv/task.h:

    class Reach(mjenv.Task):
        @jit.observe
        def observe(self, sim, observation):
            qpos = jit.array(sim.qpos, sim.nq)
            for i in range(sim.nq):
                observation[i] = qpos[i]

self[i] is number i of those that build returned. The others are the arguments that task.h describes: structs whose
pointers jit.array turns into arrays, or arrays, which take an index. random, uniform, normal, integers and choice draw
from start.random or outcome.random. The functions must not raise exceptions.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from mjenv import _task_abi

_NUMPY = {
    ctypes.c_uint32: np.uint32,
    ctypes.c_int32: np.int32,
    ctypes.c_double: np.float64,
}


def _record(struct: Any) -> Any:
    """numba's type of a struct; pointers are their addresses."""
    fields = [(name, _NUMPY.get(kind, np.uint64)) for name, kind in struct._fields_]
    dtype = np.dtype(fields, align=True)
    assert dtype.itemsize == ctypes.sizeof(struct)
    return types.CPointer(numba.from_dtype(dtype))


_NUMBERS = types.CPointer(types.float64)
_SIM, _START, _OUTCOME = (
    _record(struct) for struct in (_task_abi.mjenv_sim, _task_abi.mjenv_start, _task_abi.mjenv_outcome)
)


@intrinsic  # type: ignore[misc]
def _pointer(context: Any, address: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

    return _NUMBERS(address), generate


def _draw(name: str, result: Any, *kinds: Any) -> Any:
    """The function of mjenv_task_api with this name. Its first argument is the address of an mjenv_random."""
    signature = result(types.uint64, *kinds)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def load(address: Any, struct: Any, field: str) -> Any:
            there = builder.add(address, context.get_constant(types.uint64, getattr(struct, field).offset))
            return builder.load(builder.inttoptr(there, address.type.as_pointer()))

        # The stream's own engine draws.
        api = load(arguments[0], _task_abi.mjenv_random, "api")
        kind = ir.FunctionType(context.get_value_type(signature.return_type), [value.type for value in arguments])
        function = builder.inttoptr(load(api, _task_abi.mjenv_task_api, name), kind.as_pointer())
        return builder.call(function, arguments)

    if kinds:
        return intrinsic(lambda context, random, a, b: (signature, generate))
    return intrinsic(lambda context, random: (signature, generate))


random, normal = _draw("random", types.float64), _draw("normal", types.float64)
uniform = _draw("uniform", types.float64, types.float64, types.float64)
integers = _draw("integers", types.int64, types.int64, types.int64)
choice = _draw("choice", types.int64, types.int64, types.voidptr)


@numba.njit  # type: ignore[misc]
def array(address: Any, count: Any) -> Any:
    """The `count` float64 numbers to which a pointer of a struct points."""
    return numba.carray(_pointer(address), (count,))


def _writer(function: Callable[..., None]) -> Any:
    """Compiles a callback that writes numbers."""
    body = numba.njit(function)

    def callback(self: Any, sim: Any, numbers: Any) -> int:
        body(self, numba.carray(sim, 1)[0], numbers)
        return 0

    return numba.cfunc(types.int32(_NUMBERS, _SIM, _NUMBERS))(callback)


def reset(function: Callable[..., None]) -> Any:
    """Compiles reset(self, start)."""
    body = numba.njit(function)

    def callback(self: Any, start: Any) -> int:
        body(self, numba.carray(start, 1)[0])
        return 0

    return numba.cfunc(types.int32(_NUMBERS, _START))(callback)


def reset_info(function: Callable[..., None]) -> Any:
    """Compiles reset_info(self, sim, info)."""
    return _writer(function)


def carry(function: Callable[..., None]) -> Any:
    """Compiles carry(self, sim, carried)."""
    return _writer(function)


def observe(function: Callable[..., None]) -> Any:
    """Compiles observe(self, sim, observation)."""
    return _writer(function)


def step(function: Callable[..., None]) -> Any:
    """Compiles step(self, sim, outcome)."""
    body = numba.njit(function)

    def callback(self: Any, sim: Any, outcome: Any) -> int:
        body(self, numba.carray(sim, 1)[0], numba.carray(outcome, 1)[0])
        return 0

    return numba.cfunc(types.int32(_NUMBERS, _SIM, _OUTCOME))(callback)
