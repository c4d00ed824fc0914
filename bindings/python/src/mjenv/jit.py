"""Tasks in machine code that numba compiles from Python. Needs the package numba.

The decorators reset, reset_info, carry, observe, step, before_step and before_substep turn functions into callbacks of
mjenv/task.h:

    class Reach(mjenv.Task):
        @jit.observe
        def observe(self, sim, observation):
            qpos = jit.array(sim.qpos, sim.nq)
            for i in range(sim.nq):
                observation[i] = qpos[i]

self[i] is number i of those that build returned. The other arguments are those that task.h describes: structs, whose
pointers jit.array turns into arrays, or arrays, which take an index. jit.shared(sim, i, count) is the array of which
model.array_index returned i, and jit.own(outcome, i, count) array i of the class's `own`.

random, uniform, normal, integers and choice draw from start.random, outcome.random or control.random, and state_rand,
state_uniform, state_randn and state_randint from the row's RandomState. The functions must not raise exceptions: they
fail with `return jit.fail(start, "the reason")`.

In reset, forward(start), advance(start, count), restart(start) and contact_count(start) simulate, if the class is
`current`.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

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
_SIM, _START, _OUTCOME, _CONTROL = (
    _record(struct)
    for struct in (_task_abi.mjenv_sim, _task_abi.mjenv_start, _task_abi.mjenv_outcome, _task_abi.mjenv_control)
)


@intrinsic  # type: ignore[misc]
def _pointer(context: Any, address: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

    return _NUMBERS(address), generate


def _call(context: Any, builder: Any, struct: Any, name: str, result: Any, arguments: Any) -> Any:
    """Calls the function of mjenv_task_api with this name. The first argument is the address of such a struct, whose
    member api says which engine's functions it needs."""

    def load(address: Any, struct: Any, field: str) -> Any:
        there = builder.add(address, context.get_constant(types.uint64, getattr(struct, field).offset))
        return builder.load(builder.inttoptr(there, address.type.as_pointer()))

    api = load(arguments[0], struct, "api")
    kind = ir.FunctionType(context.get_value_type(result), [value.type for value in arguments])
    function = builder.inttoptr(load(api, _task_abi.mjenv_task_api, name), kind.as_pointer())
    return builder.call(function, arguments)


def _simulate(name: str, result: Any, *kinds: Any) -> Any:
    """The function of mjenv_task_api with this name. Its first argument is the mjenv_start of a reset."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        start = builder.ptrtoint(arguments[0], context.get_value_type(types.uint64))
        return _call(context, builder, _task_abi.mjenv_start, name, result, [start, *arguments[1:]])

    if kinds:
        return intrinsic(lambda context, start, count: (result(start, *kinds), generate))
    return intrinsic(lambda context, start: (result(start), generate))


@intrinsic  # type: ignore[misc]
def _addresses(context: Any, address: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

    return types.CPointer(types.uint64)(address), generate


def _draw(name: str, result: Any, *kinds: Any) -> Any:
    """The function of mjenv_task_api with this name. Its first argument is the address of an mjenv_random."""
    signature = result(types.uint64, *kinds)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _call(context, builder, _task_abi.mjenv_random, name, signature.return_type, arguments)

    if kinds:
        return intrinsic(lambda context, random, a, b: (signature, generate))
    return intrinsic(lambda context, random: (signature, generate))


random, normal = _draw("random", types.float64), _draw("normal", types.float64)
uniform = _draw("uniform", types.float64, types.float64, types.float64)
integers = _draw("integers", types.int64, types.int64, types.int64)
choice = _draw("choice", types.int64, types.int64, types.voidptr)
state_rand, state_randn = _draw("state_rand", types.float64), _draw("state_randn", types.float64)
state_uniform = _draw("state_uniform", types.float64, types.float64, types.float64)
state_randint = _draw("state_randint", types.int64, types.int64, types.int64)
forward, restart = _simulate("forward", types.int32), _simulate("restart", types.int32)
advance = _simulate("advance", types.int32, types.int64)
contact_count = _simulate("contact_count", types.int64)


@intrinsic  # type: ignore[misc]
def fail(context: Any, struct: Any, message: Any) -> Any:
    """Keeps the reason of a failure, which must be a literal text. The callback has to return what fail returns.
    struct: sim, start."""
    if not isinstance(message, types.StringLiteral):
        raise numba.errors.RequireLiteralValue("the reason of jit.fail is a literal text")
    kind = _task_abi.mjenv_start if "qpos0" in struct.fields and "nbody" not in struct.fields else _task_abi.mjenv_sim

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = context.get_value_type(types.uint64)
        text = context.insert_const_string(builder.module, message.literal_value)
        api = builder.add(builder.ptrtoint(arguments[0], number), context.get_constant(types.uint64, kind.api.offset))
        table = builder.load(builder.inttoptr(api, number.as_pointer()))
        there = builder.add(table, context.get_constant(types.uint64, _task_abi.mjenv_task_api.fail_with.offset))
        called = ir.FunctionType(context.get_value_type(types.int32), [text.type])
        function = builder.inttoptr(builder.load(builder.inttoptr(there, number.as_pointer())), called.as_pointer())
        return builder.call(function, [text])

    return types.int32(struct, message), generate


def _status(result: Any) -> int:
    """What a callback returns for what its body has returned."""
    raise NotImplementedError


@overload(_status)
def _compiled_status(result):  # type: ignore[no-untyped-def]  # numba compares the parameters with those of the lambdas
    if isinstance(result, types.NoneType):
        return lambda result: 0
    if isinstance(result, types.Optional):
        return lambda result: 0 if result is None else result
    return lambda result: result


@numba.njit  # type: ignore[misc]
def array(address: Any, count: Any) -> Any:
    """The `count` float64 numbers to which a pointer of a struct points."""
    return numba.carray(_pointer(address), (count,))


@numba.njit  # type: ignore[misc]
def shared(sim: Any, index: Any, count: Any) -> Any:
    """The `count` float64 numbers of the array of which model.array_index returned the index."""
    addresses = numba.carray(_addresses(sim.arrays), (index + 1,))
    return numba.carray(_pointer(addresses[index]), (count,))


@numba.njit  # type: ignore[misc]
def own(struct: Any, index: Any, count: Any) -> Any:
    """The row's own array of this index in the class's `own`, of `count` numbers. struct: start, control or outcome."""
    addresses = numba.carray(_addresses(struct.own), (index + 1,))
    return numba.carray(_pointer(addresses[index]), (count,))


def _writer(function: Callable[..., Any]) -> Any:
    """Compiles a callback that writes numbers."""
    body = numba.njit(function)

    def callback(self: Any, sim: Any, numbers: Any) -> int:
        return _status(body(self, numba.carray(sim, 1)[0], numbers))

    return numba.cfunc(types.int32(_NUMBERS, _SIM, _NUMBERS))(callback)


def reset(function: Callable[..., Any]) -> Any:
    """Compiles reset(self, start)."""
    body = numba.njit(function)

    def callback(self: Any, start: Any) -> int:
        return _status(body(self, numba.carray(start, 1)[0]))

    return numba.cfunc(types.int32(_NUMBERS, _START))(callback)


def reset_info(function: Callable[..., Any]) -> Any:
    """Compiles reset_info(self, sim, info)."""
    return _writer(function)


def carry(function: Callable[..., Any]) -> Any:
    """Compiles carry(self, sim, carried)."""
    return _writer(function)


def observe(function: Callable[..., Any]) -> Any:
    """Compiles observe(self, sim, observation)."""
    return _writer(function)


def step(function: Callable[..., Any]) -> Any:
    """Compiles step(self, sim, outcome)."""
    body = numba.njit(function)

    def callback(self: Any, sim: Any, outcome: Any) -> int:
        return _status(body(self, numba.carray(sim, 1)[0], numba.carray(outcome, 1)[0]))

    return numba.cfunc(types.int32(_NUMBERS, _SIM, _OUTCOME))(callback)


def _map(function: Callable[..., Any]) -> Any:
    """Compiles a callback that writes an mjenv_control."""
    body = numba.njit(function)

    def callback(self: Any, sim: Any, control: Any) -> int:
        return _status(body(self, numba.carray(sim, 1)[0], numba.carray(control, 1)[0]))

    return numba.cfunc(types.int32(_NUMBERS, _SIM, _CONTROL))(callback)


def before_step(function: Callable[..., Any]) -> Any:
    """Compiles before_step(self, sim, control)."""
    return _map(function)


def before_substep(function: Callable[..., Any]) -> Any:
    """Compiles before_substep(self, sim, control)."""
    return _map(function)
