"""Tasks of your own in Python: Task is the class to derive from, and mjenv.register gives a task its id."""

from __future__ import annotations

import ctypes
import math
import os
from collections.abc import Mapping, Sequence
from ctypes import byref, c_double
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from mjenv.beside import value_of
from mjenv.capi import task_declarations
from mjenv.capi.declarations import Dtype, Role, Status, mjenv_field
from mjenv.capi.dtypes import DTYPES, Float64Array
from mjenv.capi.handle import encoded
from mjenv.errors import InvalidValueError

if not TYPE_CHECKING:  # with this function, type checkers would accept every name

    def __getattr__(name: str) -> Any:
        """What programs beside this package add, such as the types of what methods get."""
        if name.startswith("__"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return value_of(name)


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
    timestep and dt (s). Numbers that change from step to step must not be attributes: they belong in `state`. rng, sim
    and start are a mjenv.task.Random, Sim and Start.

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

    def reset(self, rng: Any, rows: int) -> tuple[Any, ...]:
        """Draws the initial states of `rows` rows.

        Returns qpos (rows, nq) and qvel (rows, nv), and if the task has a state, a dict with an array (rows, *shape)
        for each of its names, except that those in `kept` may be missing. rng.kept has the kept arrays of these rows,
        and rng.parameters their live parameters.
        """
        raise NotImplementedError

    def reset_row(self, start: Any) -> dict[str, Any]:
        """Replaces reset in a NumPy task with current = True: draws the initial state of one row.

        It can read and advance the row's simulation. Returns the row's part of the task's state: a dict with an array
        of each name's shape.

        A loop that waits for something must be bounded, and raise an exception when it gives up; the row then stays as
        it was.
        """
        raise NotImplementedError

    def observe(self, sim: Any) -> NDArray[Any] | Mapping[str, NDArray[Any]]:
        """Returns the observations (rows, n), or for a Gymnasium Dict a dict of groups, each (rows, n of the group).

        They must depend only on sim.
        """
        raise NotImplementedError

    def before_step(self, sim: Any, action: NDArray[Any]) -> Any:
        """Returns ctrl (rows, nu), which the simulation applies in this step. action: (rows, n).

        sim is as the last step has left it. before_step may write into the arrays of the state, for instance the
        memory of a filter.
        """
        return action

    def step(self, sim: Any, action: NDArray[Any]) -> tuple[Any, ...]:
        """Returns the rewards (rows,), which rows have terminated, bool (rows,), and the infos: a dict of arrays
        (rows, ...). Called after the simulation has advanced. action: (rows, nu).

        With autoreset_mode "next_step", the arrays also have the rows that this step resets, but their results are not
        used.
        """
        raise NotImplementedError

    def carry(self, sim: Any) -> None:
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

    def reset_info(self, sim: Any) -> dict[str, NDArray[Any]]:
        """Returns the infos of resets: a dict of arrays (rows, ...)."""
        return {}


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
