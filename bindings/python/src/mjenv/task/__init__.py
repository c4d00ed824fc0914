"""Tasks of your own in Python: Task is the class to derive from, and mjenv.register gives a task its id."""

from __future__ import annotations

import ctypes
import math
import os
from collections.abc import Callable, Mapping, Sequence
from ctypes import byref, c_double, c_int64
from dataclasses import dataclass
from types import MappingProxyType, SimpleNamespace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from mjenv.capi import task_declarations
from mjenv.capi.declarations import Distribution, Dtype, Role, Status, mjenv_field
from mjenv.capi.dtypes import DTYPES, Float64Array
from mjenv.capi.handle import encoded, pointer_to
from mjenv.capi.pointers import POINTER
from mjenv.errors import InvalidValueError

# ---- What a task declares ----


@dataclass(frozen=True)
class Setting:
    """A constructor option of a task. Its type is that of the default: a bool, an int, a float, floats or a text."""

    default: Any
    doc: str = ""
    low: float = -math.inf  # the bounds of each number, both included
    high: float = math.inf
    choices: tuple[str, ...] = ()  # the valid texts; empty if any text is valid
    live: bool = False  # for a float or floats: a live parameter, which can be written while the task runs


@dataclass(frozen=True)
class Field:
    """A named part of the observation or of an info, for tasks in machine code.

    type: in an environment of one row, float and int give Python's numbers, and the others NumPy's. "action" means
    the type of the action.
    """

    shape: tuple[int, ...] = ()
    type: Any = np.float64
    doc: str = ""


class Task:
    """A robot and what it has to do. Derive a class from it and register it with mjenv.register.

    There are two kinds of tasks. All methods of a class are of the same kind.

    NumPy: the methods compute with arrays whose first axis is the row, over all rows of an environment at once. The
    library simulates the rows on its threads; the methods run on the calling thread. Each environment has its own
    object of the class. Its attributes are the options, and nq, nv, na, nu, qpos0 (the model's initial positions),
    timestep and dt (s). Numbers that change from step to step must not be attributes: they belong in `state`.

    Machine code: reset, observe and step, and optionally carry, reset_info, before_step, before_substep and
    compute_reward, are functions that numba.cfunc has compiled, functions of a shared object (ctypes), or addresses.
    They have the types of mjenv/task.h, and run for one row on the library's threads, without Python. Their argument
    `self` points to the float64 numbers that build returns. observation_fields, info_fields and reset_info_fields list
    what they write.

    A method under an option: build replaces it in its object, by another one or by None, if the task can lack it
    (`if not self.servo: self.before_step = None`).
    """

    model: ClassVar[str | os.PathLike[str]]
    """A built-in model ("hopper.xml"), a path that begins with "/", "~" or "./" (the folder of the class's file), or
    the text of an MJCF model."""
    frame_skip: ClassVar[int] = 1
    """How many times a step calls mj_step."""
    time_limit: ClassVar[int | None] = None
    """The number of steps after which an episode is truncated."""
    reward_threshold: ClassVar[float | None] = None
    """The return from which the task counts as solved."""
    camera: ClassVar[Mapping[str, Any] | None] = None
    """Gymnasium's default_camera_config."""
    revision: ClassVar[int] = 0
    """Increase it when the task changes, so that snapshots of the old task are refused."""
    options: ClassVar[Mapping[str, Any]] = {}
    """The constructor options: name and default, or name and Setting."""
    current: ClassVar[bool] = False
    """Whether the methods see what belongs to the new state, as after mj_step1. Otherwise they see what mj_step leaves:
    what it computes (xpos, contacts, ...) is one timestep older than qpos."""
    random_state: ClassVar[bool] = False
    """Whether each row has a stream of NumPy's RandomState besides its Generator. reset_row draws from it (which needs
    `current`), or a reset in machine code."""
    own: ClassVar[Sequence[str]] = ()
    """The arrays of mjModel that the task writes for its rows: NumPy in reset_row (`start.own`, which needs `current`)
    and in step (`sim.own`), machine code in reset and step. Machine code also "qfrc_applied" and
    "xfrc_applied", which before_step, before_substep and step write. The numbers are float64; where MuJoCo has float32
    (hfield_data, geom_rgba), they are rounded."""
    action_bounds: Sequence[tuple[float, float]] = ()
    """The action space, which before_step turns into ctrl: the bounds of each number of an action. build may set it.
    Empty: actions are ctrl."""
    needs: ClassVar[Sequence[str]] = ("qpos", "qvel")
    """NumPy: the arrays of mjData that `sim` has. "contacts" means `sim.ncon` and all of `sim.contact`; a single one is
    "contact.geom1", which is `sim.contact.geom1` (rows, greatest number of contacts), of which a row's first ncon
    count. "model.body_mass" is `sim.model.body_mass` (rows, nbody): the row's own values of an array of mjModel, with
    what was drawn and written. Machine code: the arrays that task.h marks as on demand."""
    max_contacts: ClassVar[int] = 0
    """NumPy: for how many contacts of a row sim.contact has room (the option max_contacts). The arrays hold a row's
    first contacts, and 0 behind them; sim.ncon counts all. 0: for the model's nconmax, which may be hundreds; on MuJoCo
    4.0 for 500, if nconmax is not set."""
    state: ClassVar[Mapping[str, tuple[int, ...]]] = {}
    """Name and shape of the numbers that a row remembers from step to step. Snapshots and copies of rows hold them."""
    state_bounds: Mapping[str, tuple[float, float]] = {}
    """Names in state and their bounds (low, high), which contain 0. build may set it. A method that writes another
    number fails, and snapshots with another number are refused. Bound what the task uses as an index or a size,
    because a snapshot may come from a stranger."""
    kept: ClassVar[Sequence[str]] = ()
    """Names in state that stay after resets: a terrain's level, for instance. They are 0 until a row's first reset. A
    NumPy task's step and carry write them, and reset finds them in rng.kept and may return new values."""
    observation_fields: Mapping[str, int | Mapping[str, int]] = {}
    """Names and lengths of the observation's parts. build may set it. A group of parts, such as "policy" or "critic",
    has a dict of them instead of a length; the observation is then a Gymnasium Dict (the option observation). A NumPy
    task may leave it empty."""
    info_fields: Mapping[str, Field | tuple[int, ...]] = {}
    """Machine code: the numbers of the info, in the order in which step writes them."""
    reset_info_fields: Mapping[str, Field | tuple[int, ...]] = {}
    """Machine code: the numbers of a reset's info."""

    nq: int
    nv: int
    na: int
    nu: int
    qpos0: Float64Array
    timestep: float
    dt: float
    before_substep: ClassVar[Any] = None
    """Machine code: called before each mj_step of a step."""

    def build(self, model: Model) -> Sequence[float] | None:
        """Prepares an environment: looks up names in the model, for example. Machine code: returns the numbers to which
        `self` points."""
        return None

    def reset(self, rng: Random, rows: int) -> tuple[Any, ...]:
        """Draws the initial states of `rows` rows.

        Returns qpos (rows, nq) and qvel (rows, nv), and if the task has a state, a dict with an array (rows, *shape)
        for each of its names, except that those in `kept` may be missing. rng.kept has the kept arrays of these rows,
        and rng.parameters their live parameters.
        """
        raise NotImplementedError

    def reset_row(self, start: Start) -> dict[str, Any]:
        """Replaces reset in a NumPy task with current = True: draws the initial state of one row.

        It can read and advance the row's simulation. Returns the row's part of the task's state: a dict with an array
        of each name's shape.

        A loop that waits for something must be bounded, and raise an exception when it gives up; the row then stays as
        it was.
        """
        raise NotImplementedError

    def observe(self, sim: Sim) -> NDArray[Any] | Mapping[str, NDArray[Any]]:
        """Returns the observations (rows, n), or for a Gymnasium Dict a dict of groups, each (rows, n of the group).

        They must depend only on sim.
        """
        raise NotImplementedError

    def before_step(self, sim: Sim, action: NDArray[Any]) -> Any:
        """Returns ctrl (rows, nu), which the simulation applies in this step. action: (rows, n).

        sim is as the last step has left it. before_step may write into the arrays of the state, for instance the
        memory of a filter.
        """
        return action

    def step(self, sim: Sim, action: NDArray[Any]) -> tuple[Any, ...]:
        """Returns the rewards (rows,), which rows have terminated, bool (rows,), and the infos: a dict of arrays
        (rows, ...). Called after the simulation has advanced. action: (rows, nu).

        With autoreset_mode "next_step", the arrays also have the rows that this step resets, but their results are not
        used.
        """
        raise NotImplementedError

    def carry(self, sim: Sim) -> None:
        """Writes what the next step needs to know about the present simulation into the arrays of the state in sim.

        Called after each reset and step, and after set_state. Must depend only on sim.
        """

    def compute_reward(self, achieved_goal: NDArray[Any], desired_goal: NDArray[Any], info: Any) -> NDArray[Any]:
        """Returns the rewards (...) of goals (..., n).

        For tasks whose observation has the groups observation, achieved_goal and desired_goal. Hindsight experience
        replay gets them by env.compute_reward, as in gymnasium-robotics. step may call it, too. Machine code gets no
        info, and computes the reward of one pair of goals.
        """
        raise NotImplementedError

    def reset_info(self, sim: Sim) -> dict[str, NDArray[Any]]:
        """Returns the infos of resets: a dict of arrays (rows, ...)."""
        return {}


class Sim:
    """The rows' simulations: of all rows, or after a reset of those that were reset. Its attributes are

    - an array (rows, *shape) for each name in needs: a read-only view;
    - an array (rows, *shape) for each name in state, into which step and carry may write;
    - parameters: the live parameters by name, (rows,) or (rows, n), read-only;
    - own: the rows' own arrays of the model by name, (rows, *shape). step may write into `sim.own[name]`, which it must
      look up in each step. The next step uses the new numbers, and resets keep them;
    - rng: draws from all rows' own streams, in step;
    - kick: (rows, nv), 0 at the beginning of step. What step writes into it is added to qvel after the step, so carry,
      observe and the next step see it, but arrays that MuJoCo has computed belong to the old velocities.

    After a step, what MuJoCo computes from qpos and qvel (xpos, sensordata, ...) is one timestep older than these, as
    in Gymnasium. With the integrator RK4, all but sensordata belongs to the last of its four stages instead. In a task
    with current = True, positions, velocities, contacts and their sensors belong to the new state.
    """

    parameters: Mapping[str, Float64Array]
    own: Mapping[str, Float64Array]
    rng: Random
    kick: Float64Array

    def __init__(
        self,
        arrays: Mapping[str, Float64Array],
        state: Mapping[str, Float64Array],
        parameters: Mapping[str, Float64Array],
        own: Mapping[str, Float64Array],
        rng: Random,
        kick: Float64Array,
    ) -> None:
        self.own, self.rng, self.kick = own, rng, kick
        self.parameters = MappingProxyType({name: _read_only(array) for name, array in parameters.items()})
        for name, array in arrays.items():
            group, _, part = name.rpartition(".")
            of = self.__dict__.setdefault(group, SimpleNamespace()).__dict__ if group else self.__dict__
            of[part] = _read_only(array)
        self.__dict__.update(state)

    def __getattr__(self, name: str) -> Float64Array:
        raise AttributeError(f"sim has no {name!r}: it has {', '.join(self.__dict__)}. The task's needs list arrays")


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    view = array.view()
    view.flags.writeable = False
    return view


class Start:
    """The initial state of one row, which reset_row changes. It is valid until reset_row returns.

    qpos, qvel and act are the state of the simulation, at first the model's qpos0 and zeros. The other arrays of the
    simulation are attributes of sim, with MuJoCo's names and shapes: `start.sim.site_xpos[3]`. They are up to date at
    the beginning and after forward, advance and restart. own: the row's own arrays of the model, by the names in `own`,
    with what earlier resets and steps have written. rng and random_state draw from the row's streams, one number at a
    time.
    """

    qpos: Float64Array
    qvel: Float64Array
    act: Float64Array
    own: Mapping[str, Float64Array]

    def __init__(self, raw: Any, own: Mapping[str, tuple[int, ...]]) -> None:
        self._struct = struct = raw.contents
        self._raw = raw
        self._api = ctypes.cast(struct.api, POINTER(task_declarations.mjenv_task_api)).contents
        arrays = ctypes.cast(struct.own, POINTER(ctypes.c_void_p))
        memory = {name: _memory(arrays[i], shape) for i, (name, shape) in enumerate(own.items())}
        self.own = MappingProxyType({name: view.copy() for name, view in memory.items()})
        # The library's arrays, and copies of them, because the caller may keep arrays after the reset.
        self._arrays = [(view, self.own[name]) for name, view in memory.items()]
        for name, size in (("qpos", struct.nq), ("qvel", struct.nv), ("act", struct.na)):
            view = _memory(getattr(struct, name), (size,))
            setattr(self, name, view.copy())
            self._arrays.append((view, getattr(self, name)))
        self.rng, self.random_state = Draws(self), StateDraws(self)
        self.sim = _RowSim(self)

    def forward(self) -> None:
        """Calls mj_forward with actuation disabled, on the state that reset_row has written."""
        self._simulate(lambda: self._api.forward(self._raw))

    def advance(self, count: int) -> None:
        """Simulates timesteps, and then computes the stages of mj_step1.

        With the integrator Euler, the first timestep uses the arrays that were computed last (mj_step2), even if qpos
        was written since.
        """
        self._simulate(lambda: self._api.advance(self._raw, count))

    def restart(self) -> None:
        """Begins again: calls mj_resetData and forward. The row's own arrays keep their values."""
        self._simulate(lambda: self._api.restart(self._raw))

    @property
    def contact_count(self) -> int:
        """The number of contacts that the last forward, advance or restart has found."""
        return int(self.opened()._api.contact_count(self._raw))

    @property
    def time(self) -> float:
        """The simulation's time, s."""
        return float(_memory(self.opened()._struct.time, (1,))[0])

    @time.setter
    def time(self, seconds: float) -> None:
        _memory(self.opened()._struct.time, (1,))[0] = seconds

    def opened(self) -> Start:
        if self._raw is None:
            raise RuntimeError("reset_row has returned, so its start cannot be used any more")
        return self

    def write(self) -> None:
        """Passes what reset_row has written to the library."""
        for view, values in self.opened()._arrays:
            view[...] = values

    def close(self) -> None:
        self._raw, self._arrays = None, []

    def _simulate(self, call: Callable[[], int]) -> None:
        self.write()
        failed = call()
        for view, values in self._arrays:
            values[...] = view
        if failed:
            raise RuntimeError("the simulation failed")  # the library's error says why


class _RowSim:
    """Copies of the arrays of one row's simulation."""

    def __init__(self, start: Start) -> None:
        self._start = start

    def __getattr__(self, name: str) -> Float64Array:
        if name not in _ROW_SHAPES:
            raise AttributeError(f"sim has no {name!r}: in reset_row it has {', '.join(_ROW_SHAPES)}")
        raw = ctypes.cast(self._start.opened()._struct.sim, POINTER(task_declarations.mjenv_sim)).contents
        shape = tuple(int(getattr(raw, size)) if isinstance(size, str) else size for size in _ROW_SHAPES[name])
        address = getattr(raw, name)
        if not address and 0 not in shape:
            raise AttributeError(f"{name} is computed on demand: name it in needs")
        return _memory(address, shape).copy()


# The shapes of the arrays in mjenv_sim.
_ROW_SHAPES: Mapping[str, tuple[int | str, ...]] = {
    **dict.fromkeys(("qvel", "qacc", "qfrc_actuator", "qfrc_passive", "qfrc_bias", "qfrc_constraint"), ("nv",)),
    **dict.fromkeys(("qpos", "qpos0"), ("nq",)),
    "act": ("na",),
    **dict.fromkeys(("ctrl", "actuator_length", "actuator_velocity", "actuator_force"), ("nu",)),
    **dict.fromkeys(("xpos", "xipos", "subtree_com"), ("nbody", 3)),
    "xquat": ("nbody", 4),
    **dict.fromkeys(("xmat", "ximat"), ("nbody", 9)),
    "cinert": ("nbody", 10),
    **dict.fromkeys(("cvel", "cfrc_ext"), ("nbody", 6)),
    **dict.fromkeys(("xanchor", "xaxis"), ("njnt", 3)),
    "geom_xpos": ("ngeom", 3),
    "geom_xmat": ("ngeom", 9),
    "site_xpos": ("nsite", 3),
    "site_xmat": ("nsite", 9),
    "sensordata": ("nsensordata",),
    **dict.fromkeys(("ten_length", "ten_velocity"), ("ntendon",)),
    "body_mass": ("nbody",),
}


def _memory(address: int | None, shape: tuple[int, ...]) -> Float64Array:
    """The library's array at this address."""
    size = math.prod(shape)
    if not size or not address:
        return np.zeros(shape)
    return np.ctypeslib.as_array((c_double * size).from_address(address)).reshape(shape)


class _Stream:
    def __init__(self, start: Start) -> None:
        self._start = start

    def _draw(self, name: str, *arguments: Any) -> Any:
        start = self._start.opened()
        return getattr(start._api, name)(start._struct.random, *arguments)


class Draws(_Stream):
    """The row's stream in reset_row: methods of numpy.random.Generator that draw one number."""

    def random(self) -> float:
        return float(self._draw("random"))

    def uniform(self, low: float, high: float) -> float:
        return float(self._draw("uniform", low, high))

    def standard_normal(self) -> float:
        return float(self._draw("normal"))

    def normal(self, loc: float, scale: float) -> float:
        return loc + scale * self.standard_normal()

    def integers(self, low: int, high: int) -> int:
        return int(self._draw("integers", low, high))


class StateDraws(_Stream):
    """The row's RandomState in reset_row: methods of numpy.random.RandomState that draw one number."""

    def rand(self) -> float:
        return float(self._draw("state_rand"))

    def uniform(self, low: float, high: float) -> float:
        return float(self._draw("state_uniform", low, high))

    def randn(self) -> float:
        return float(self._draw("state_randn"))

    def randint(self, low: int, high: int) -> int:
        return int(self._draw("state_randint", low, high))

    def choice(self, a: Any, p: Sequence[float] | None = None) -> Any:
        items = np.asarray(a)
        count = len(items) if items.ndim else int(items)
        if p is not None and len(p) != count:
            raise InvalidValueError(f"choice: p has {len(p)} probabilities, not {count}")
        at = int(self._draw("state_choice", count, None if p is None else (c_double * count)(*p)))
        return items[at] if items.ndim else at

    def permutation(self, x: Any) -> NDArray[Any]:
        items = np.arange(x) if isinstance(x, (int, np.integer)) else np.asarray(x)
        order = np.empty(len(items), np.int64)
        self._draw("state_permutation", len(order), pointer_to(order, c_int64))
        return items[order]

    def shuffle(self, x: Any) -> None:
        """x: an array, whose first axis is shuffled, or a list."""
        order = self.permutation(len(x))
        x[:] = x[order] if isinstance(x, np.ndarray) else [x[at] for at in order]


Size = int | tuple[int, ...]
Drawing = Callable[[np.random.Generator, tuple[int, ...]], Any]


class Random:
    """The random streams of the rows that are reset, with methods of numpy.random.Generator.

    The first element of size is the number of rows. Each row's numbers come from its own stream, so they do not depend
    on which other rows are reset. rows: how many there are. streams: each row's Generator, which is slower. kept,
    parameters: in reset, copies of the rows' kept arrays and live parameters, by name.
    """

    def __init__(
        self,
        streams: Sequence[np.random.Generator],
        kept: Mapping[str, Float64Array] = MappingProxyType({}),
        parameters: Mapping[str, Float64Array] = MappingProxyType({}),
    ) -> None:
        self._streams, self.kept, self.parameters = tuple(streams), kept, parameters

    @property
    def streams(self) -> tuple[np.random.Generator, ...]:
        return self._streams

    @property
    def rows(self) -> int:
        return len(self._streams)

    def random(self, size: Size) -> Float64Array:
        return self.uniform(0.0, 1.0, size)  # the same draws

    def uniform(self, low: Any, high: Any, size: Size) -> Float64Array:
        kind = None if np.ndim(low) or np.ndim(high) else Distribution.UNIFORM
        drawn: Float64Array = self._draw(size, lambda stream, shape: stream.uniform(low, high, shape), kind, low, high)
        return drawn

    def standard_normal(self, size: Size) -> Float64Array:
        drawn: Float64Array = self._draw(size, lambda stream, shape: stream.standard_normal(shape), Distribution.NORMAL)
        return drawn

    def normal(self, loc: Any, scale: Any, size: Size) -> Float64Array:
        if not np.ndim(loc) and not np.ndim(scale) and scale >= 0:
            return np.asarray(loc + scale * self.standard_normal(size))
        drawn: Float64Array = self._draw(size, lambda stream, shape: stream.normal(loc, scale, shape))
        return drawn

    def integers(self, low: Any, high: Any, size: Size) -> NDArray[np.int64]:
        small = not np.ndim(low) and not np.ndim(high) and max(abs(int(low)), abs(int(high))) <= 2**53
        kind = Distribution.INTEGERS if small else None
        drawn: Any = self._draw(size, lambda stream, shape: stream.integers(low, high, shape), kind, low, high)
        return np.asarray(drawn, np.int64)

    def _shape(self, size: Size) -> tuple[int, ...]:
        shape = size if isinstance(size, tuple) else (size,)
        if not shape or shape[0] != self.rows:
            raise InvalidValueError(f"size is {size}, but its first element must be {self.rows} rows")
        return shape

    def _draw(self, size: Size, draw: Drawing, kind: Distribution | None = None, low: Any = 0, high: Any = 0) -> Any:
        """kind, low, high: what mjenv_draw would draw; None if it cannot."""
        shape = self._shape(size)
        return np.stack([draw(stream, shape[1:]) for stream in self.streams])


# ---- Building an environment ----


class Model:
    """The model, for a task's build: its sizes nq, nv, nu, nbody and so on, names and arrays.

    timestep: of one mj_step, s. dt: of one step, s. qpos0: (nq,) the initial positions.
    """

    def __init__(self, builder: Any) -> None:
        self._builder = builder
        self._api = builder.contents.api.contents
        sim = builder.contents.sim.contents
        self.nq, self.nv, self.na, self.nu, self.nbody, self.njnt = sim.nq, sim.nv, sim.na, sim.nu, sim.nbody, sim.njnt
        self.ngeom, self.nsite, self.ntendon, self.nsensordata = sim.ngeom, sim.nsite, sim.ntendon, sim.nsensordata
        self.timestep, self.dt = sim.timestep, sim.dt
        self.qpos0: Float64Array = self.array("qpos0")

    def index(self, kind: str, name: str) -> int:
        """The index of a named "body", "joint", "site" and so on. If the model lacks it, building fails."""
        return int(self._api.index(self._builder, encoded(kind, "kind"), encoded(name, "the name")))

    def array_index(self, name: str) -> int:
        """Makes an array of mjData or mjModel available to machine code. Returns its index in mjenv_sim.arrays."""
        return int(self._api.array(self._builder, encoded(name, "the name"), None))

    def array(self, name: str) -> NDArray[Any]:
        """A copy of an array of mjModel, or of mjData in the model's initial state."""
        field = mjenv_field()
        field.struct_size = ctypes.sizeof(field)
        index = self._api.array(self._builder, encoded(name, "the name"), byref(field))
        if not field.name:
            raise InvalidValueError(f"the model has no array {name!r}", Status.E_NAME)
        shape = tuple(field.shape[: field.ndim])
        if not field.count:
            return np.zeros(shape)
        address = self._builder.contents.sim.contents.arrays[index]
        dtype = np.dtype(DTYPES[field.dtype])
        copied = ctypes.string_at(address, field.count * dtype.itemsize)
        return np.frombuffer(copied, dtype).reshape(shape).copy()

    def call(self, function: str, *arguments: Any) -> None:
        """Calls mjenv_build_FUNCTION of task.h."""
        given = (encoded(value, "the name") if isinstance(value, str) else value for value in arguments)
        getattr(self._api, function)(self._builder, *given)

    def parameter_index(self, name: str) -> int:
        """The index of a live parameter's first number in mjenv_sim.parameters, for machine code."""
        return int(self._api.parameter(self._builder, encoded(name, "the name")))

    def option(self, name: str, default: Any) -> Any:
        """The value of an option that a task has declared with that default."""
        text = name.encode()
        if isinstance(default, str):
            return self._api.text(self._builder, text).decode()
        if isinstance(default, (bool, int)):
            return type(default)(self._api.integer(self._builder, text))
        count = np.size(default)
        values = (c_double * count)()
        self._api.reals(self._builder, text, values, count)
        if np.ndim(default):
            return tuple(values)
        return int(values[0]) if self._api.is_integer(self._builder, text) else values[0]

    def describe(
        self, role: Role, name: str, shape: tuple[int, ...], kind: Dtype, doc: str = "", group: str = ""
    ) -> None:
        field = task_declarations.mjenv_task_field(ctypes.sizeof(task_declarations.mjenv_task_field), role)
        field.name, field.doc, field.dtype = encoded(name, "a field's name"), doc.encode(), kind
        field.group = encoded(group, "a group's name")
        field.ndim = len(shape)
        field.shape[: len(shape)] = shape
        self._api.field(self._builder, byref(field))
