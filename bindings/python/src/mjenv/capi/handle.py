"""Owners of the library's handles: Options, and Rows, an environment of one or many rows.

All calls of the library go through this module, except those of steps (rows/step.py) and pictures (rows/pictures.py).
"""

from __future__ import annotations

import ctypes
import difflib
import math
import operator
import os
from collections.abc import Callable, Mapping, Sequence
from ctypes import byref, c_char_p, c_double, c_int32, c_int64, c_uint8, c_uint64, c_void_p
from functools import cached_property, partial, wraps
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from mjenv import errors
from mjenv.capi import declarations, draw_document, dtypes
from mjenv.capi.declarations import Dtype, Kind, Role, Status
from mjenv.capi.dtypes import Float64Array, laid_out
from mjenv.capi.engine import ENGINES, Engine
from mjenv.capi.keywords import RANDOMIZING, Rendering
from mjenv.capi.owned import Owned
from mjenv.capi.pointers import POINTER
from mjenv.capi.schema import Field, Option
from mjenv.capi.turns import Turn, Turns

P = ParamSpec("P")
T = TypeVar("T")
GoalRewards = Callable[[Any, Any, Any], NDArray[Any]]
# How many calls that change a row are kept prepared.
_MOST_CHANGES = 64
# The arrays of bytes in MuJoCo 4.0, which has bools where 2.2.2 has other bytes.
_BYTES = {"names", "paths", "plugin_attr", "text_data", "tex_data", "body_simple"}
_BYTES |= {"body_sameframe", "geom_sameframe", "site_sameframe"}


class Lent(Protocol):
    """An array that a reader has (mjenv.rows.blocks.Block)."""

    name: str

    def is_changed(self) -> bool: ...
    def flush(self) -> None: ...
    def read(self) -> None: ...
    def is_held(self) -> bool: ...
    def moved(self) -> bool: ...


def _struct(kind: type[Any]) -> Any:
    """A struct of this kind, with its struct_size."""
    value = kind()
    value.struct_size = ctypes.sizeof(kind)
    return value


def _text(value: bytes | None) -> str:
    return (value or b"").decode("utf-8", "surrogateescape")


def encoded(value: str, what: str) -> bytes:
    """A text for the library; what: its name in error messages."""
    if not isinstance(value, str):
        raise errors.OptionError(f"{what} is a str, not {value!r}", Status.E_TYPE)
    if "\0" in value:
        raise errors.InvalidValueError(f"{what} holds a null character", Status.E_VALUE)
    return value.encode("utf-8", "surrogateescape")


def pcg64_of(words: Any) -> dict[str, Any]:
    """The words of mjenv_get_stream as the state of a numpy.random.PCG64."""
    numbers = {"state": words[0] | words[1] << 64, "inc": words[2] | words[3] << 64}
    return {"bit_generator": "PCG64", "state": numbers, "has_uint32": words[4], "uinteger": words[5]}


def words_of(state: Mapping[str, Any]) -> list[int]:
    """What pcg64_of was made from."""
    numbers = (state["state"]["state"], state["state"]["inc"])
    halves = [x >> shift & 0xFFFFFFFFFFFFFFFF for x in numbers for shift in (0, 64)]
    return [*halves, state["has_uint32"], state["uinteger"]]


def pointer_to(array: NDArray[Any], kind: type[Any]) -> Any:
    """A typed pointer to an array's memory, valid as long as the array lives."""
    return array.ctypes.data_as(POINTER(kind))


def _int64(number: int) -> int:
    """The nearest int64. ctypes would take the lowest 64 bits of a larger number."""
    return max(-(2**63), min(number, 2**63 - 1))


def ids(engine: Engine) -> tuple[str, ...]:
    """All environment ids, sorted."""
    return tuple(_text(engine.mjenv_id_at(i)) for i in range(engine.mjenv_id_count()))


def spec_of(engine: Engine, id: str) -> Any:
    """The mjenv_spec of an id."""
    spec = _struct(declarations.mjenv_spec)
    engine.check(engine.mjenv_spec_of(encoded(id, "the id"), byref(spec)), names_id=True)
    return spec


def camera_config(engine: Engine, id: str) -> dict[str, Any] | None:
    """Gymnasium's default_camera_config of an id; None where it has none."""
    spec = spec_of(engine, id)
    lookat = np.array(spec.camera_lookat)
    values = {
        "trackbodyid": math.nan if spec.camera_trackbodyid == declarations.BODY_UNSET else spec.camera_trackbodyid,
        "distance": spec.camera_distance,
        "lookat": lookat,
        "elevation": spec.camera_elevation,
    }
    return {name: value for name, value in values.items() if not np.isnan(value).any()} or None


class Options:
    """The options of one id, which have their defaults until they are set."""

    def __init__(self, engine: Engine, id: str) -> None:
        handle = c_void_p()
        self._owned = Owned(engine.mjenv_options_destroy, handle)
        engine.check(engine.mjenv_options_create(encoded(id, "the id"), byref(handle)), names_id=True)
        self.id = id
        self.pointer = handle.value
        self._engine, self._check = engine, engine.check

    def schema(self) -> dict[str, Option]:
        """All options by name, with their present values as defaults."""
        found = {}
        option = _struct(declarations.mjenv_option)
        for i in range(self._engine.mjenv_options_count(self.pointer)):
            self._check(self._engine.mjenv_options_at(self.pointer, i, byref(option)))
            name, kind = _text(option.name), Kind(option.kind)
            choices = tuple(_text(option.choices).split())
            default = self._get(option.name, kind)
            found[name] = Option(name, kind, default, option.low, option.high, choices, _text(option.doc), default)
        return found

    def set(self, values: Mapping[str, Any]) -> None:
        """Sets options from Python values. Raises OptionError or InvalidValueError."""
        schema = self.schema()
        for name, value in values.items():
            if name not in schema:
                raise unknown_option(self.id, name, schema)
            self._set(schema[name], value)

    def _get(self, name: bytes, kind: Kind) -> Any:
        if kind in (Kind.FLAG, Kind.INTEGER, Kind.STRING_OR_INT):
            integer = c_int64()
            status = self._engine.mjenv_options_get_integer(self.pointer, name, byref(integer))
            if kind != Kind.STRING_OR_INT or status == Status.OK:
                self._check(status)
                return bool(integer.value) if kind == Kind.FLAG else integer.value
        if kind == Kind.REALS:
            count = c_int64()
            self._check(self._engine.mjenv_options_get_reals(self.pointer, name, None, 0, byref(count)))
            reals = (c_double * count.value)()
            self._check(self._engine.mjenv_options_get_reals(self.pointer, name, reals, count, byref(count)))
            return reals[0] if len(reals) == 1 else tuple(reals)
        text = c_char_p()
        self._check(self._engine.mjenv_options_get_string(self.pointer, name, byref(text)))
        return _text(text.value)

    def _set(self, option: Option, value: Any) -> None:
        name = option.name.encode()
        if isinstance(value, os.PathLike):
            value = os.path.abspath(os.fspath(value))
        if isinstance(value, str):
            self._check(self._engine.mjenv_options_set_string(self.pointer, name, encoded(value, option.name)))
        elif option.kind == Kind.REALS and not _is_integer(value):
            self._set_reals(option, value)
        else:
            try:
                integer = operator.index(value)
            except TypeError:
                # operator.index refuses NumPy's bools, which are valid flags.
                if not isinstance(value, np.bool_):
                    raise self._refused(option, value) from None
                integer = int(value)
            if not -(2**63) <= integer < 2**63:
                raise errors.InvalidValueError(
                    f"option {option.name!r} of {self.id} cannot be {integer}", Status.E_VALUE
                )
            self._check(self._engine.mjenv_options_set_integer(self.pointer, name, integer))

    def _set_reals(self, option: Option, value: Any) -> None:
        try:
            given = np.array(value)
        except ValueError:  # a ragged list
            raise self._refused(option, value) from None
        if given.ndim != np.ndim(option.default) or given.dtype.kind not in "biuf":
            raise self._refused(option, value)
        reals = given.astype(np.float64).reshape(-1)
        pointer = pointer_to(reals, c_double)
        self._check(self._engine.mjenv_options_set_reals(self.pointer, option.name.encode(), pointer, reals.size))

    def _refused(self, option: Option, value: Any) -> errors.OptionError:
        kinds = {
            Kind.FLAG: "a bool",
            Kind.INTEGER: "an int",
            Kind.STRING: "a str",
            Kind.STRING_OR_INT: "a str or an int",
        }
        reals = "a float" if np.ndim(option.default) == 0 else f"{len(option.default)} floats"
        kind = kinds.get(option.kind, reals)
        return errors.OptionError(f"option {option.name!r} of {self.id} is {kind}, not {value!r}", Status.E_TYPE)


def unknown_option(id: str, name: str, schema: Mapping[str, Option]) -> errors.OptionError:
    """The exception for an option that the id does not have. It suggests the three most similar keywords."""
    known = {*schema, *Rendering.__annotations__, *RANDOMIZING, "engine"} - {name}
    similar = " or ".join(map(repr, difflib.get_close_matches(name, sorted(known))))
    hint = f"Did you mean {similar}? " if similar else ""
    # Begins with Python's words, by which programs recognise a keyword that they can do without.
    return errors.OptionError(
        f"{id} got an unexpected keyword argument {name!r}. {hint}mjenv.options({id!r}) lists all", Status.E_NAME
    )


def _is_integer(value: Any) -> bool:
    """Whether a number is an int, which Gymnasium's infos keep. An int too large for the library becomes a float."""
    return isinstance(value, (int, np.integer)) and -(2**63) <= int(value) < 2**63


class Batch:
    """The arrays that reset and step write, and the mjenv_batch that points to them."""

    def __init__(self, rows: int, obs_shape: tuple[int, ...], info_count: int, dtype: Dtype = Dtype.FLOAT64) -> None:
        self.obs: NDArray[Any] = np.zeros((rows, *obs_shape), np.float32 if dtype == Dtype.FLOAT32 else np.float64)
        self.info, self.reward = np.zeros(rows * info_count), np.zeros(rows)
        self.ended = np.zeros((2, rows), np.bool_)  # terminated, truncated
        self.status = np.zeros(rows, np.int32)
        self.struct = _struct(declarations.mjenv_batch)
        self.struct.obs_dtype = dtype
        self.struct.rows, self.struct.obs_count, self.struct.info_count = rows, math.prod(obs_shape), info_count
        self.struct.obs = self.obs.ctypes.data
        self.struct.reward = pointer_to(self.reward, c_double)
        self.struct.info = pointer_to(self.info, c_double)
        self.struct.terminated = pointer_to(self.ended[0], c_uint8)
        self.struct.truncated = pointer_to(self.ended[1], c_uint8)
        self.struct.status = pointer_to(self.status, c_int32)


def check_goals(id: str, achieved: NDArray[Any], desired: NDArray[Any]) -> None:
    if achieved.shape != desired.shape or not achieved.ndim:
        raise errors.InvalidValueError(
            f"{id}: compute_reward: the goals have the shapes {achieved.shape} and {desired.shape}, which must"
            " be equal",
            Status.E_SIZE,
        )


class Changing:
    """with rows.changing(): a call that depends on the state and may change it, in its turn."""

    __slots__ = ("_rows", "_turn")

    def __init__(self, rows: Rows) -> None:
        self._rows, self._turn = rows, list[Turn]()

    def __enter__(self) -> None:
        if self._rows.lent:
            self._rows.flush()
        self._turn.append(self._rows.enter())

    def __exit__(self, *_: object) -> None:
        try:
            self._rows.moved()
        finally:
            self._rows.leave(self._turn.pop())


def in_turn(method: Callable[Concatenate[Any, P], T]) -> Callable[Concatenate[Any, P], T]:
    """The method of rows, which takes the turn to call the library."""

    @wraps(method)
    def called(self: Any, /, *given: P.args, **named: P.kwargs) -> T:
        turn = [self.enter()]
        try:
            return method(self, *given, **named)
        finally:
            self.leave(turn.pop())

    return called


class Rows:
    """An owned environment handle of one or many rows. Pickling keeps every row's episode and random stream.

    One thread at a time calls the library with the handle: every call stands between enter and leave (_turns.py).
    """

    def __init__(self, engine: Engine, id: str, options: Mapping[str, Any], count: int = 1) -> None:
        chosen = Options(engine, id)
        # The options that were not given, with their defaults.
        self.schema: dict[str, Any] = {name: option.default for name, option in chosen.schema().items()}
        chosen.set({name: value for name, value in options.items() if name not in RANDOMIZING})
        handle = c_void_p()
        self._owned: Owned | None = Owned(engine.mjenv_destroy, handle)
        engine.check(engine.mjenv_create(chosen.pointer, count, byref(handle)))
        self.engine: Engine = engine
        self.check: Callable[[int], None] = engine.check
        self.id: str = id
        self.options: dict[str, Any] = dict(options)
        self.count: int = count
        self.closed: bool = False
        self.turns: Turns = Turns()
        self.leave: Callable[[Turn], None] = self.turns.give_back
        self.lent: list[Lent] = []  # the arrays that readers may have changed, or may hold
        self._mirrors: dict[str, NDArray[Any]] = {}  # the library's pointers to them end with the handle
        self._changes: dict[Any, Any] = {}  # the calls that _changing has prepared
        self._pointer: int | None = handle.value
        self._fields: dict[Role, tuple[Field, ...]] = {}
        self._arrays: dict[Role, dict[str, Field]] = {}
        self._indices: dict[tuple[str, str], int] = {}  # of objects by kind and name
        self._written: dict[str, bool] = {}  # whether the library writes the array of this name
        self._frame_skip: int = self._info().frame_skip
        nq = (c_double * 1)()
        self._read_into(nq, 0, "nq", 1)
        self._init_qpos = (c_double * int(nq[0]))()
        self._read_into(self._init_qpos, 0, "qpos0", len(self._init_qpos))
        # Whether the task computes the rewards of goals. The library refuses even no goals if it does not.
        self.has_goals: bool = engine.mjenv_compute_reward(self._pointer, nq, nq, 0, nq, 0) == Status.OK
        draws = {name: options[name] for name in RANDOMIZING if options.get(name) is not None}
        if draws:
            self.randomize(**draws)

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.engine.name, self.id, self.options, self.count, self.snapshot(declarations.ALL_ROWS))

    # ---- calls ----

    def enter(self) -> Turn:
        """Takes the turn to call the library, which is given back as _turns.py shows.

        Raises BusyError if another call has the turn.
        """
        try:
            return self.turns.take()
        except IndexError:
            raise self.busy() from None

    @property
    def pointer(self) -> int:
        """The handle, for a caller that has the turn. Raises ClosedError after close."""
        if self._pointer is None:
            raise self.gone()
        return self._pointer

    @in_turn
    def call(self, function: Callable[..., int], *arguments: Any) -> None:
        """Calls function(handle, *arguments) and raises unless it returns MJENV_OK."""
        self.check(function(self.pointer, *arguments))

    def flush(self) -> None:
        """Writes what readers have changed in arrays. Called before every call that depends on the state."""
        changed = [block for block in self.lent if block.is_changed()]
        if not changed:
            return
        for block in changed:
            block.flush()
        names = {block.name for block in changed}
        readers = [block for block in self.lent if block.name in names]
        if len(readers) > len(names):
            for block in readers:
                block.read()

    def moved(self) -> None:
        """Shows readers the present state. Called after every call that may have changed it, which has the turn."""
        if self.lent and not self.closed:
            self.lent = [block for block in self.lent if block.moved()]

    def changing(self) -> Changing:
        """The turn for a call that depends on the state and may change it."""
        return Changing(self)

    def change(self, function: Callable[..., int], *arguments: Any) -> None:
        """The same as call, for such a call."""
        self.changer(lambda: function(self.pointer, *arguments))(self)

    def changer(self, call: Callable[[], int], buffers: Sequence[Any] = ()) -> Callable[..., None]:
        """The same for a call without arguments, as a function that takes these rows, which it does not keep alive, and
        up to two arrays, which it first copies into the buffers."""
        take, leave, check = self.turns.take_free, self.leave, self.check
        first, second = (*buffers, None, None)[:2]

        def change(rows: Rows, array: Any = None, other: Any = None) -> None:
            if rows.lent:
                rows.flush()
            try:
                turn = [take()]
            except IndexError:
                turn = [rows.enter()]
            try:
                if rows.closed:
                    raise rows.gone()
                if first is not None:
                    first[...] = array
                    if second is not None:
                        second[...] = other
                status = call()
                if status:
                    check(status)
            finally:
                try:
                    if rows.lent:
                        rows.moved()
                finally:
                    leave(turn.pop())

        return change

    def prepared(self, function: str, *arguments: Any) -> Callable[[], int]:
        """The same call as a function, with arguments that are converted once. Its caller must have the turn."""
        types = getattr(self.engine, function).argtypes
        converted = (kind.from_param(value) for kind, value in zip(types, (self.pointer, *arguments), strict=True))
        return partial(self.engine[function], *converted)

    def busy(self) -> errors.BusyError:
        return errors.BusyError(f"another thread is inside this {self.id}", Status.E_BUSY)

    def gone(self) -> errors.ClosedError:
        return errors.ClosedError(f"this {self.id} was closed")

    @in_turn
    def close(self) -> None:
        """Frees the handle. Closing twice is fine."""
        self.closed, self._pointer, self._owned = True, None, None

    def only(self, row: int) -> NDArray[np.bool_]:
        """The mask of one row."""
        mask = np.zeros(self.count, np.bool_)
        mask[row] = True
        return mask

    # ---- outputs of all rows; the caller must have the turn ----

    def reset(self, mask: NDArray[np.bool_] | None, out: Any) -> None:
        """Begins new episodes of the masked rows, of all without a mask."""
        self.check(self.engine.mjenv_reset(self.pointer, None if mask is None else pointer_to(mask, c_uint8), out))

    def observe(self, out: Any) -> None:
        """Writes the observations of the rows as they are."""
        self.check(self.engine.mjenv_observe(self.pointer, out))

    def observe_row(self, row: int, out: Any) -> None:
        """Writes that of one row alone."""
        self.check(self.engine.mjenv_observe_row(self.pointer, row, out))

    def rollout(self, actions: NDArray[Any], steps: int, out: Any) -> None:
        """Plays `steps` actions of each row."""
        address, code = actions.ctypes.data, dtypes.FLOATS[actions.dtype]
        self.check(self.engine.mjenv_rollout(self.pointer, address, actions.size, code, steps, out))

    @property
    def goal_rewards(self) -> GoalRewards:
        """compute_reward. Raises AttributeError if the task has no goals, because programs tell by that if it has."""
        if not self.has_goals:
            raise AttributeError(f"{self.id} has no compute_reward, because its task has none")
        return self.compute_reward

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> NDArray[Any]:
        """The rewards that the task computes for goals. Only NumPy tasks use info."""
        achieved, desired = (laid_out(goals, np.float64) for goals in (achieved_goal, desired_goal))
        check_goals(self.id, achieved, desired)
        rewards = np.empty(achieved.shape[:-1])
        goals = [pointer_to(array, c_double) for array in (achieved, desired)]
        to = pointer_to(rewards, c_double), rewards.size
        self.call(self.engine.mjenv_compute_reward, *goals, achieved.size, *to)
        return rewards

    def check_sendable(self) -> None:
        """Raises if rows cannot be stepped one by one, as send steps them."""

    # ---- what the environment consists of ----

    def frame_skip(self) -> int:
        return self._frame_skip

    @cached_property
    def ctrl_shape(self) -> tuple[int]:
        """The shape of mjData's ctrl."""
        return (int(self.value(Role.MODEL, "nu")),)

    @cached_property
    def init_qpos(self) -> Float64Array:
        """The model's qpos0 before any write, as in Gymnasium; read-only."""
        values = np.array(self._init_qpos)
        values.flags.writeable = False
        return values

    def lanes(self) -> tuple[int, str]:
        """How many rows a thread steps together, and why rows are stepped one by one."""
        info = self._info()
        return info.lanes, _text(info.lanes_reason)

    @in_turn
    def lane_stages(self) -> dict[str, str]:
        """How lanes compute each stage of a step."""
        text = self.engine.mjenv_lane_stages_of(self.pointer)
        if text is None:
            raise self.engine.last_error(Status.E_ARGUMENT)
        return dict(line.split(": ", 1) for line in _text(text).splitlines())

    @in_turn
    def _info(self) -> Any:
        info = _struct(declarations.mjenv_info)
        self.check(self.engine.mjenv_info_of(self.pointer, byref(info)))
        return info

    def fields(self, role: Role) -> tuple[Field, ...]:
        """The fields of a role. They are read once, because DATA and MODEL have hundreds."""
        if role not in self._fields:
            self._fields[role] = tuple(self._read_fields(role))
        return self._fields[role]

    def size(self, role: Role) -> int:
        """How many numbers the fields of a role have."""
        return sum(field.count for field in self.fields(role))

    @in_turn
    def _read_fields(self, role: Role) -> list[Field]:
        field, found = _struct(declarations.mjenv_field), []
        for i in range(self.engine.mjenv_field_count(self.pointer, role)):
            self.check(self.engine.mjenv_field_at(self.pointer, role, i, byref(field)))
            given = field.offset, field.count, Dtype(field.dtype), _text(field.doc)
            found.append(Field(_text(field.name), tuple(field.shape[: field.ndim]), *given))
        return found

    def array(self, role: Role, name: str) -> Field | None:
        """The array of mjData (Role.DATA) or mjModel (Role.MODEL) with MuJoCo's name."""
        if role not in self._arrays:
            self._arrays[role] = {field.name: field for field in self.fields(role)}
        return self._arrays[role].get(name)

    def value(self, role: Role, name: str, row: int = 0) -> NDArray[Any]:
        """A read-only copy of an array of mjData (Role.DATA) or mjModel (Role.MODEL) that every model has."""
        field = self.array(role, name)
        assert field is not None
        return self.read(row, field)

    @in_turn
    def bounds(self, role: Role) -> tuple[Float64Array, Float64Array]:
        """The lower and the upper bounds of the space of observations or actions, in its shape."""
        space = _struct(declarations.mjenv_space)
        self.check(self.engine.mjenv_space_of(self.pointer, role, byref(space)))
        low, high = (np.array(bounds[: space.count], np.float64) for bounds in (space.low, space.high))
        shape = tuple(space.shape[: space.ndim])
        return low.reshape(shape), high.reshape(shape)

    def timestep(self, row: int = 0) -> float:
        """The seconds that one mj_step simulates."""
        return float(self._read(row, "opt.timestep", 1)[0])

    def object_index(self, kind: str, name: str) -> int:
        if (kind, name) not in self._indices:
            index = c_int64()
            self.call(self.engine.mjenv_object_index, kind.encode(), encoded(name, "the name"), byref(index))
            self._indices[kind, name] = index.value
        return self._indices[kind, name]

    @in_turn
    def object_name(self, kind: str, index: int) -> str:
        name = c_char_p()
        status = self.engine.mjenv_object_name(self.pointer, kind.encode(), _int64(index), byref(name))
        self.check(Status.E_NAME if status == Status.E_VALUE else status)
        return _text(name.value)

    # ---- random streams ----

    def seed(self, row: int, seed: int) -> None:
        """Gives a row the stream of numpy.random.default_rng(seed), for a seed >= 0 of any size."""
        count = max(1, (seed.bit_length() + 63) // 64)
        words = (c_uint64 * count)(*((seed >> 64 * i) & 0xFFFFFFFFFFFFFFFF for i in range(count)))
        self.call(self.engine.mjenv_seed_row, row, words, count)

    def seed_rows(self, seeds: NDArray[np.uint64], mask: NDArray[np.bool_]) -> None:
        """Gives each masked row the stream of its seed."""
        self.call(self.engine.mjenv_seed, pointer_to(mask, c_uint8), pointer_to(seeds, c_uint64), seeds.size)

    def stream(self, row: int) -> dict[str, Any]:
        """A row's random stream, as the state of a numpy.random.PCG64."""
        words = (c_uint64 * 6)()
        self.call(self.engine.mjenv_get_stream, row, words, 6)
        return pcg64_of(words)

    def set_stream(self, row: int, state: Mapping[str, Any]) -> None:
        self.call(self.engine.mjenv_set_stream, row, (c_uint64 * 6)(*words_of(state)), 6)

    # ---- the state of rows ----

    def read(self, row: int, field: Field) -> NDArray[Any]:
        """A read-only copy of an array of mjData or mjModel, in MuJoCo's shape and dtype."""
        self.flush()
        array = self._read(row, field.name, field.count).astype(self.dtype_of(field), copy=False)
        array = array.reshape(field.shape)
        array.flags.writeable = False
        return array

    def dtype_of(self, field: Field) -> type[np.generic]:
        """The dtype in MuJoCo's Python package."""
        is_bool = field.type == Dtype.UINT8 and self.engine.name != "2.2.2" and field.name not in _BYTES
        return np.bool_ if is_bool else dtypes.DTYPES[field.type]

    def is_written(self, field: Field) -> bool:
        """Whether the library writes the array. It checks the name before the count, here one too many."""
        if field.name not in self._written:
            self._written[field.name] = self._writes(field.name, np.empty(field.count + 1))
        return self._written[field.name]

    @in_turn
    def _writes(self, name: str, values: Float64Array) -> bool:
        given = name.encode(), pointer_to(values, c_double), values.size
        status = self.engine.mjenv_write_row(self.pointer, 0, *given)
        if status not in (Status.E_SIZE, Status.E_NAME):
            self.check(status)  # rows are under way, for instance
        return bool(status == Status.E_SIZE)

    def is_copied(self, name: str) -> bool:
        """Whether a subclass has a copy of the array, which `write` keeps up to date."""
        return False

    def mirror(self, field: Field) -> NDArray[Any]:
        """An array of row 0 that the library keeps up to date, and from which it takes what is written there."""
        if field.name not in self._mirrors:  # the library would leave the memory that it already has
            memory = np.empty(field.shape, self.dtype_of(field))
            name = field.name.encode()
            self.call(self.engine.mjenv_mirror, 0, name, memory.ctypes.data, memory.nbytes)
            self._mirrors[field.name] = memory
        return self._mirrors[field.name]

    def _read(self, row: int, name: str, size: int) -> Float64Array:
        values = np.empty(size)
        self._read_into(pointer_to(values, c_double), row, name, size)
        return values

    def _read_into(self, values: Any, row: int, name: str, size: int) -> None:
        self.call(self.engine.mjenv_read, row, name.encode(), values, size, byref(c_int64()))

    def write(self, row: int, name: str, values: Any, by_reader: bool = False) -> None:
        """Writes an array of a row's mjModel or mjData. by_reader: a lent array calls, and tells its reader."""
        self._write(self.engine.mjenv_write_row, row, name, values, by_reader)

    def write_rows(self, mask: NDArray[np.bool_] | None, name: str, values: Any, by_reader: bool = False) -> None:
        """Writes an array of the masked rows, of all without a mask: values[rows, ...]."""
        selected = None if mask is None else pointer_to(mask, c_uint8)
        self._write(self.engine.mjenv_write, selected, name, values, by_reader)

    def _write(self, function: Callable[..., int], rows: Any, name: str, values: Any, by_reader: bool) -> None:
        numbers = laid_out(values, np.float64)
        call = self.call if by_reader else self.change
        call(function, rows, encoded(name, "the array"), pointer_to(numbers, c_double), numbers.size)

    def set_constants(self, row: int) -> None:
        """Calls mj_setConst for a row, or for all rows (-1)."""
        if row == declarations.ALL_ROWS:
            self.change(self.engine.mjenv_set_constants, None)
        else:
            self.change(self.engine.mjenv_set_constants_row, row)

    def randomize(self, **parts: Any) -> None:
        """Replaces parts of the document: randomize, or noise, delay and push."""
        self.change(self.engine.mjenv_randomize, draw_document.written(**parts))
        self.options.update(parts)

    def randomization(self) -> dict[str, Any]:
        """The document of all parts that are set."""
        document = c_char_p()
        self.call(self.engine.mjenv_randomization, byref(document))
        return draw_document.parts_of(document.value or b"{}")

    def _draw_of(self, array: str, number: int) -> tuple[str, int]:
        """The name of the array with the parameters of a draw, such as draws[0], and their number.

        array, number: the draw is item `number` of this array in randomize.
        """
        draws = draw_document.draws_of(self.options.get("randomize"))
        found = [index for index, name in enumerate(draws) if name == array]
        if not 0 <= number < len(found):
            names = ", ".join(dict.fromkeys(draws)) or "nothing"
            raise errors.UnknownNameError(f"resets draw {names}, but no item {number} of {array!r}", Status.E_NAME)
        name, count = f"draws[{found[number]}]", c_int64()
        self.call(self.engine.mjenv_read, 0, name.encode(), None, 0, byref(count))
        return name, count.value

    def draw_range(self, array: str, number: int) -> Float64Array:
        """The parameters from which each row draws: (rows, n)."""
        name, count = self._draw_of(array, number)
        return np.stack([self._read(row, name, count) for row in range(self.count)])

    def set_draw_range(self, array: str, parameters: Any, number: int, mask: NDArray[np.bool_] | None) -> None:
        """Replaces the parameters of the masked rows, of all without a mask: (n,), or (rows, n)."""
        name, _ = self._draw_of(array, number)
        self.write_rows(mask, name, parameters)

    @property
    def draws_in_steps(self) -> bool:
        """Whether noise, pushes or delays may draw from the random streams in steps."""
        return any(self.options.get(name) is not None for name in ("noise", "push", "delay"))

    def set_state(self, row: int, qpos: Any, qvel: Any) -> None:
        """Sets the state of a row, or with ALL_ROWS of all: qpos[rows, nq]."""
        q, v = np.asarray(qpos), np.asarray(qvel)
        dimensions = 2 if row == declarations.ALL_ROWS else 1
        if q.ndim != dimensions or v.ndim != dimensions:
            raise errors.InvalidValueError(
                f"qpos and qvel have the shapes {q.shape} and {v.shape}, not one dimension each"
            )
        key = row, q.shape, v.shape
        (self._changes.get(key) or self._changing("mjenv_set_state", *key))(self, q, v)

    def reset_data(self, row: int) -> None:
        """Calls mj_resetData for a row."""
        (self._changes.get((row,)) or self._changing("mjenv_reset_data", row))(self)

    def simulate(self, row: int, ctrl: NDArray[Any], frames: int) -> None:
        key = row, ctrl.shape, frames
        (self._changes.get(key) or self._changing("mjenv_simulate", *key))(self, ctrl)

    def _changing(self, function: str, row: int, *given: Any) -> Callable[..., None]:
        """The function that changes a row by a function of the library, prepared for these shapes of arrays and this
        number."""
        shapes = [shape for shape in given if isinstance(shape, tuple)]
        numbers = [number for number in given if not isinstance(number, tuple)]
        if numbers != [*map(_int64, numbers)]:
            text = f"n_frames is {numbers[0]}, which does not fit into 64 bits"
            raise errors.InvalidValueError(text, Status.E_VALUE)
        buffers = [np.zeros(shape) for shape in shapes]
        arrays = [part for buffer in buffers for part in (pointer_to(buffer, c_double), buffer.size)]
        first = pointer_to(self.only(row), c_uint8) if function == "mjenv_reset_data" else row
        change = self.changer(Rows.prepared(self, function, first, *arrays, *numbers), buffers)
        if len(self._changes) == _MOST_CHANGES:
            self._changes.clear()
        self._changes[(row, *given)] = change
        return change

    def copy_row(self, source: int, mask: NDArray[np.bool_]) -> None:
        self.change(self.engine.mjenv_copy_row, pointer_to(mask, c_uint8), source)

    def snapshot(self, row: int) -> bytes:
        size = c_int64()
        with self.changing():
            self.check(self.engine.mjenv_snapshot(self.pointer, row, None, 0, byref(size)))
            image = ctypes.create_string_buffer(size.value)
            self.check(self.engine.mjenv_snapshot(self.pointer, row, image, size, byref(size)))
        return image.raw

    def restore(self, row: int, image: bytes) -> None:
        self.change(self.engine.mjenv_restore, row, image, len(image))


# The functions that build environments of tasks that were registered in Python, by id.
OPENERS: dict[str, Callable[[Engine, str, Mapping[str, Any], int], Rows]] = {}


def open_rows(engine: Engine, id: str, options: Mapping[str, Any], count: int = 1) -> Rows:
    """Builds an environment of any id."""
    return OPENERS.get(id, Rows)(engine, id, options, count)


def _restored(engine: str, id: str, options: Mapping[str, Any], count: int, image: bytes, *_: type) -> Rows:
    """_: a class, so that unpickling imports its module, which registers the id."""
    rows = open_rows(ENGINES.get(engine), id, options, count)
    rows.restore(declarations.ALL_ROWS, image)
    return rows
