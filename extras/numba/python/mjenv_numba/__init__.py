"""Tasks in machine code that numba compiles from Python. Needs the package numba.

The decorators reset, reset_info, carry, observe, step, before_step, before_substep and compute_reward turn functions
into callbacks of mjenv/task.h:

    import mjenv_numba as jit

    class Reach(mjenv.Task):
        @jit.observe
        def observe(self, sim, observation):
            qpos = jit.array(sim.qpos, sim.nq)
            for i in range(sim.nq):
                observation[i] = qpos[i]

self[i] is number i of those that build returned. task.h describes the other arguments. They are structs, whose pointers
jit.array turns into arrays, or arrays. jit.shared(sim, i, count) is the array for which model.array_index returned i
(jit.shared_float32 if its numbers are float32), and jit.own(outcome, i, count) is array i of the class's `own`.

random, uniform, normal, integers and choice draw from start.random, outcome.random or control.random, and state_rand,
state_uniform, state_randn, state_randint, state_choice, state_permutation and state_shuffle from the row's RandomState.
The functions must not raise exceptions: they fail with `return jit.fail(start, "the reason")`.

In reset, forward(start), advance(start, count), restart(start) and contact_count(start) simulate, if the class is
`current`, and sim_of(start) is the live simulation.

For robots that walk: touching(sim, foot, floor), air_time(time, foot, touches, dt), and terrain(model, "ground"), whose
numbers build returns; height(self, first, sim, x, y) and height_around(self, first, sim, body, x, y) then read the
heights. They have the bits of the helpers in task.hpp.
"""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Callable
from typing import Any

try:
    import numba
except ImportError as error:
    raise ImportError(f"mjenv_numba needs the package numba: pip install numba ({error})") from None
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from mjenv.capi import task_declarations
from mjenv.task import Model
from mjenv.task.locomotion import Terrain

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
    for struct in (
        task_declarations.mjenv_sim,
        task_declarations.mjenv_start,
        task_declarations.mjenv_outcome,
        task_declarations.mjenv_control,
    )
)


def _cast(kind: Any) -> Any:
    """The function that turns an address into a pointer of this type."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

    return intrinsic(lambda context, address: (kind(address), generate))


_pointer, _narrow_pointer = _cast(_NUMBERS), _cast(types.CPointer(types.float32))
_addresses = _cast(types.CPointer(types.uint64))
_sim = _cast(_SIM)
_contacts = _cast(types.CPointer(numba.from_dtype(np.dtype(task_declarations.mjenv_contact))))


def _call(context: Any, builder: Any, struct: Any, name: str, result: Any, arguments: Any) -> Any:
    """Calls the function of mjenv_task_api with this name. The first argument is the address of such a struct, whose
    member api says which engine's functions it needs."""

    def load(address: Any, struct: Any, field: str) -> Any:
        there = builder.add(address, context.get_constant(types.uint64, getattr(struct, field).offset))
        return builder.load(builder.inttoptr(there, address.type.as_pointer()))

    api = load(arguments[0], struct, "api")
    kind = ir.FunctionType(context.get_value_type(result), [value.type for value in arguments])
    function = builder.inttoptr(load(api, task_declarations.mjenv_task_api, name), kind.as_pointer())
    return builder.call(function, arguments)


def _intrinsic(kind: str, name: str, function: Callable[..., Any]) -> Any:
    """numba's intrinsic of the function, with a name and a text for help(mjenv_numba)."""
    function.__name__ = name
    function.__doc__ = f"The function {name} of mjenv_task_api, in mjenv/task.h. Its first argument is an mjenv_{kind}."
    return intrinsic(function)


def _simulate(name: str, result: Any, *kinds: Any) -> Any:
    """The function of mjenv_task_api with this name. Its first argument is the mjenv_start of a reset."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        start = builder.ptrtoint(arguments[0], context.get_value_type(types.uint64))
        return _call(context, builder, task_declarations.mjenv_start, name, result, [start, *arguments[1:]])

    if kinds:
        return _intrinsic("start", name, lambda context, start, count: (result(start, *kinds), generate))
    return _intrinsic("start", name, lambda context, start: (result(start), generate))


def _draw(name: str, result: Any, *kinds: Any) -> Any:
    """The function of mjenv_task_api with this name. Its first argument is the address of an mjenv_random."""
    signature = result(types.uint64, *kinds)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _call(context, builder, task_declarations.mjenv_random, name, signature.return_type, arguments)

    if kinds:
        return _intrinsic("random", name, lambda context, random, a, b: (signature, generate))
    return _intrinsic("random", name, lambda context, random: (signature, generate))


random, normal = _draw("random", types.float64), _draw("normal", types.float64)
uniform = _draw("uniform", types.float64, types.float64, types.float64)
integers = _draw("integers", types.int64, types.int64, types.int64)
choice = _draw("choice", types.int64, types.int64, types.voidptr)
state_rand, state_randn = _draw("state_rand", types.float64), _draw("state_randn", types.float64)
state_uniform = _draw("state_uniform", types.float64, types.float64, types.float64)
state_randint = _draw("state_randint", types.int64, types.int64, types.int64)
_state_choice = _draw("state_choice", types.int64, types.int64, types.voidptr)
_state_permutation = _draw("state_permutation", types.void, types.int64, types.voidptr)
forward, restart = _simulate("forward", types.int32), _simulate("restart", types.int32)
advance = _simulate("advance", types.int32, types.int64)
contact_count = _simulate("contact_count", types.int64)


@intrinsic  # type: ignore[misc]
def _none(context: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.get_constant_null(signature.return_type)

    return types.voidptr(), generate


@intrinsic  # type: ignore[misc]
def _address_of(context: Any, array: Any) -> Any:
    if not (isinstance(array, types.Array) and array.dtype == types.int64 and array.ndim == 1 and array.is_contig):
        raise numba.errors.TypingError("order is a contiguous array of np.int64 with one dimension")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(array)(context, builder, arguments[0]).data
        return builder.bitcast(data, context.get_value_type(types.voidptr))

    return types.voidptr(array), generate


@intrinsic  # type: ignore[misc]
def fail(context: Any, struct: Any, message: Any) -> Any:
    """Keeps the reason of a failure, which must be a literal text. The callback has to return what fail returns.
    struct: sim, start."""
    if not isinstance(message, types.StringLiteral):
        raise numba.errors.RequireLiteralValue("the reason of jit.fail is a literal text")
    kind = (
        task_declarations.mjenv_start
        if "qpos0" in struct.fields and "nbody" not in struct.fields
        else task_declarations.mjenv_sim
    )

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = context.get_value_type(types.uint64)
        text = context.insert_const_string(builder.module, message.literal_value)
        api = builder.add(builder.ptrtoint(arguments[0], number), context.get_constant(types.uint64, kind.api.offset))
        table = builder.load(builder.inttoptr(api, number.as_pointer()))
        there = builder.add(
            table, context.get_constant(types.uint64, task_declarations.mjenv_task_api.fail_with.offset)
        )
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
    """The `count` float64 numbers of the array for which model.array_index returned the index."""
    addresses = numba.carray(_addresses(sim.arrays), (index + 1,))
    return numba.carray(_pointer(addresses[index]), (count,))


@numba.njit  # type: ignore[misc]
def shared_float32(sim: Any, index: Any, count: Any) -> Any:
    """The same for an array of float32 numbers, such as hfield_data."""
    addresses = numba.carray(_addresses(sim.arrays), (index + 1,))
    return numba.carray(_narrow_pointer(addresses[index]), (count,))


@numba.njit  # type: ignore[misc]
def state_choice(random: Any, count: Any) -> Any:
    """RandomState.choice(count)."""
    return _state_choice(random, count, _none())


@numba.njit  # type: ignore[misc]
def state_permutation(random: Any, order: Any) -> Any:
    """Writes RandomState.permutation(len(order)) into order, an array of np.int64."""
    _state_permutation(random, len(order), _address_of(order))


@numba.njit  # type: ignore[misc]
def state_shuffle(random: Any, values: Any) -> Any:
    """RandomState.shuffle(values) of an array with one dimension."""
    order, old = np.empty(len(values), np.int64), values.copy()
    state_permutation(random, order)
    for i in range(len(values)):
        values[i] = old[order[i]]


@numba.njit  # type: ignore[misc]
def own(struct: Any, index: Any, count: Any) -> Any:
    """The row's own array of this index in the class's `own`, of `count` numbers. struct: start, control or outcome."""
    addresses = numba.carray(_addresses(struct.own), (index + 1,))
    return numba.carray(_pointer(addresses[index]), (count,))


@numba.njit  # type: ignore[misc]
def sim_of(start: Any) -> Any:
    """The live simulation of a reset, whose class is `current`."""
    return numba.carray(_sim(start.sim), 1)[0]


@numba.njit  # type: ignore[misc]
def contacts(sim: Any) -> Any:
    """The contacts, an array of records with the members of mjenv_contact. The class needs "contacts"."""
    return numba.carray(_contacts(sim.contacts), (sim.contact_count,))


@numba.njit  # type: ignore[misc]
def touching(sim: Any, geom: Any, other: Any) -> Any:
    """Whether two geoms have a contact whose distance is at most 0. The class needs "contacts"."""
    for contact in contacts(sim):
        first, second = contact.geom1, contact.geom2
        if contact.distance <= 0 and ((first == geom and second == other) or (first == other and second == geom)):
            return True
    return False


@numba.njit  # type: ignore[misc]
def air_time(time: Any, foot: Any, touches: Any, dt: Any) -> Any:
    """Counts how long a foot has been in the air, and returns how long the flight was that ended in this step, s; 0 if
    none did. time[foot], a carried number, becomes 0 if the foot touches the ground, and otherwise grows by dt."""
    flight = time[foot] if touches else 0.0
    time[foot] = 0.0 if touches else time[foot] + dt
    return flight


def terrain(model: Model, geom: str) -> list[float]:
    """The numbers that height and height_around need of a height field; build appends them to what it returns."""
    return [model.array_index("hfield_data"), *Terrain(model, geom).numbers]


@numba.njit  # type: ignore[misc]
def _cell(x: Any, radius: Any, count: Any) -> Any:
    return min(max((x + radius) / (2 * radius) * (count - 1), 0.0), float(count - 1))


@numba.njit  # type: ignore[misc]
def height(self: Any, first: Any, sim: Any, x: Any, y: Any) -> Any:
    """The height at x and y, m, of the terrain whose numbers begin at self[first]; all in the world's frame. sim: a
    sim, or a start, in which written own arrays count after forward or advance."""
    begin, rows, columns = int(self[first + 1]), int(self[first + 2]), int(self[first + 3])
    column = _cell(x - self[first + 7], self[first + 4], columns)
    row = _cell(y - self[first + 8], self[first + 5], rows)
    c, r = max(min(int(column), columns - 2), 0), max(min(int(row), rows - 2), 0)
    u, v = column - c, row - r
    data = shared_float32(sim, int(self[first]), begin + rows * columns)
    upper, lower = begin + r * columns, begin + min(r + 1, rows - 1) * columns
    beside = min(c + 1, columns - 1)
    near, far = np.float64(data[upper + c]), np.float64(data[lower + beside])
    # The diagonal of a cell goes from (r, c) to (r + 1, c + 1).
    if u >= v:
        corner = np.float64(data[upper + beside])
        along = u * (corner - near) + v * (far - corner)
    else:
        corner = np.float64(data[lower + c])
        along = v * (corner - near) + u * (far - corner)
    return (near + along) * self[first + 6] + self[first + 9]


@numba.njit  # type: ignore[misc]
def height_around(self: Any, first: Any, sim: Any, body: Any, x: Any, y: Any) -> Any:
    """The height at the point (x, y) in the frame of a body that is turned by the body's yaw alone, m in the world's
    frame."""
    at, mat = array(sim.xpos, 3 * sim.nbody), array(sim.xmat, 9 * sim.nbody)
    ahead, left = mat[9 * body], mat[9 * body + 3]
    norm = np.sqrt(ahead * ahead + left * left)
    cos, sin = (ahead / norm, left / norm) if norm > 0 else (1.0, 0.0)
    return height(self, first, sim, at[3 * body] + (cos * x - sin * y), at[3 * body + 1] + (sin * x + cos * y))


def _body(function: Callable[..., Any], name: str, *parameters: str) -> Any:
    """Compiles the function, which must have these parameters."""
    given = tuple(inspect.signature(function).parameters)
    if len(given) != len(parameters):
        hint = "; it cannot draw: draw in step, and carry the numbers" if name in ("observe", "carry") else ""
        raise TypeError(f"{name} takes ({', '.join(parameters)}), not ({', '.join(given)}){hint}")
    return numba.njit(function)


def _writer(function: Callable[..., Any], name: str, numbers: str) -> Any:
    """Compiles a callback that writes numbers."""
    body = _body(function, name, "self", "sim", numbers)

    def callback(self: Any, sim: Any, numbers: Any) -> int:
        return _status(body(self, numba.carray(sim, 1)[0], numbers))

    return numba.cfunc(types.int32(_NUMBERS, _SIM, _NUMBERS))(callback)


def reset(function: Callable[..., Any]) -> Any:
    """Compiles reset(self, start)."""
    body = _body(function, "reset", "self", "start")

    def callback(self: Any, start: Any) -> int:
        return _status(body(self, numba.carray(start, 1)[0]))

    return numba.cfunc(types.int32(_NUMBERS, _START))(callback)


def reset_info(function: Callable[..., Any]) -> Any:
    """Compiles reset_info(self, sim, info)."""
    return _writer(function, "reset_info", "info")


def carry(function: Callable[..., Any]) -> Any:
    """Compiles carry(self, sim, carried)."""
    return _writer(function, "carry", "carried")


def observe(function: Callable[..., Any]) -> Any:
    """Compiles observe(self, sim, observation)."""
    return _writer(function, "observe", "observation")


def step(function: Callable[..., Any]) -> Any:
    """Compiles step(self, sim, outcome)."""
    body = _body(function, "step", "self", "sim", "outcome")

    def callback(self: Any, sim: Any, outcome: Any) -> int:
        return _status(body(self, numba.carray(sim, 1)[0], numba.carray(outcome, 1)[0]))

    return numba.cfunc(types.int32(_NUMBERS, _SIM, _OUTCOME))(callback)


def _map(function: Callable[..., Any], name: str) -> Any:
    """Compiles a callback that writes an mjenv_control."""
    body = _body(function, name, "self", "sim", "control")

    def callback(self: Any, sim: Any, control: Any) -> int:
        return _status(body(self, numba.carray(sim, 1)[0], numba.carray(control, 1)[0]))

    return numba.cfunc(types.int32(_NUMBERS, _SIM, _CONTROL))(callback)


def before_step(function: Callable[..., Any]) -> Any:
    """Compiles before_step(self, sim, control)."""
    return _map(function, "before_step")


def compute_reward(function: Callable[..., Any]) -> Any:
    """Compiles compute_reward(self, achieved, desired), which returns the reward of one pair of goals, two arrays."""
    body = _body(function, "compute_reward", "self", "achieved", "desired")

    def callback(self: Any, api: Any, achieved: Any, desired: Any, size: Any, reward: Any) -> int:
        reward[0] = body(self, numba.carray(achieved, (size,)), numba.carray(desired, (size,)))
        return 0

    kinds = (_NUMBERS, types.voidptr, _NUMBERS, _NUMBERS, types.int64, _NUMBERS)
    return numba.cfunc(types.int32(*kinds))(callback)


def before_substep(function: Callable[..., Any]) -> Any:
    """Compiles before_substep(self, sim, control)."""
    return _map(function, "before_substep")
