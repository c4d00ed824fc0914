"""Registers a class derived from mjenv.Task as a task of the library."""

from __future__ import annotations

import ctypes
import inspect
import math
import os
import threading
import weakref
from collections.abc import Callable, Mapping, Sequence
from ctypes import byref, c_double, c_int32, c_size_t, c_void_p
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi import declarations, task_declarations
from mjenv.capi.declarations import Dtype, Kind, Role, Status
from mjenv.capi.dtypes import Float64Array
from mjenv.capi.engine import Engine
from mjenv.capi.handle import Rows, encoded, pointer_to
from mjenv.capi.pointers import POINTER
from mjenv.errors import InvalidValueError, OptionError, TaskError, UnknownNameError
from mjenv.task import Field, Model, Random, Setting, Sim, Start, Task

# The names that mjenv_task_api.need takes. The other arrays are always available.
ON_DEMAND = "contacts cfrc_ext cfrc_int cacc geom_xpos geom_xmat cam_xpos cam_xmat light_xpos light_xdir".split()
# The arrays contact.* and the shape of one contact's part.
CONTACT: dict[str, tuple[int, ...]] = {
    **dict.fromkeys("dist includemargin dim geom1 geom2 exclude efc_address".split(), ()),
    "pos": (3,),
    "frame": (9,),
    "friction": (5,),
    "solref": (2,),
    "solimp": (5,),
    "force": (6,),
}
_METHODS = ("reset", "observe", "step", "carry", "reset_info", "before_step", "before_substep", "compute_reward")
_TYPES = {
    np.dtype(np.float64): Dtype.FLOAT64,
    np.dtype(np.float32): Dtype.FLOAT32,
    np.dtype(np.bool_): Dtype.UINT8,  # NumpyRows shows these as bools
}
_FIELD_TYPES: dict[Any, Dtype] = {
    float: Dtype.NATIVE_FLOAT,
    int: Dtype.NATIVE_INT,
    "action": Dtype.ACTION,
    np.float64: Dtype.FLOAT64,
    np.float32: Dtype.FLOAT32,
    np.int64: Dtype.INT64,
}

# Tasks are never freed, because engines may call them until the process ends.
_KEPT: list[Registered] = []


class Registered:
    """A task that is registered with every engine."""

    def __init__(self, id: str, kind: type[Task]) -> None:
        self.id, self.kind = id, kind
        self.settings = {name: s if isinstance(s, Setting) else Setting(s) for name, s in kind.options.items()}
        for name in (*self.settings, *kind.state):
            if hasattr(Task, name) or name in Task.__annotations__:
                raise InvalidValueError(f"{kind.__name__}: {name!r} is a name that mjenv.Task uses itself")
        for name in kind.kept:
            if isinstance(kind.kept, str) or name not in kind.state:
                raise OptionError(f"{kind.__name__}: kept has {name!r}, which is not in state", Status.E_NAME)
        self.needs = _needs_of(kind)
        taken = set(kind.state) & {name.partition(".")[0] for name in self.needs}
        if taken:
            raise InvalidValueError(f"{kind.__name__}: {sorted(taken)[0]!r} is both in state and in needs")
        own = [name for name in _METHODS if overrides(kind, name)]
        self.is_code = any(_address(getattr(kind, name)) for name in own)
        self.resets_rows = kind.reset_row is not Task.reset_row
        needed = ("observe", "step") if self.resets_rows else ("reset", "observe", "step")
        missing = [name for name in needed if name not in own]
        if self.is_code:
            _check_code(kind)
        if self.resets_rows:
            if "reset" in own:
                raise OptionError(
                    f"{kind.__name__} defines both reset and reset_row: define one of them", Status.E_TYPE
                )
            if not kind.current:
                raise OptionError(f"{kind.__name__}: reset_row simulates, which needs current = True", Status.E_TYPE)
        if missing:
            raise OptionError(f"{kind.__name__} does not define {missing[0]}", Status.E_TYPE)
        if not self.is_code:
            _check_numpy(kind)
            _check_parameters(kind)
        self._environments: weakref.WeakValueDictionary[int, Resetting] = weakref.WeakValueDictionary()
        self._statuses: dict[str, list[int]] = {}  # what each engine's mjenv_register_task has returned
        self._kept: list[Any] = []
        self._callbacks: dict[int, Any] = {}  # machine code that build has given an object, by address
        self.struct = self._described()

    def open(self, engine: Engine, id: str, options: Mapping[str, Any], count: int = 1) -> Rows:
        """Builds an environment of a task in machine code."""
        made: list[Rows] = []
        self.create(lambda: made.append(Rows(engine, id, options, count)))
        return made[0]

    def create(self, make: Callable[[], None], task: Task | None = None, resetting: Resetting | None = None) -> int:
        """Calls make, which creates an environment of this task. Returns how many numbers a NumPy task observes.

        task: the NumPy task of the environment, whose exceptions this function raises. An exception in the `build` of a
        task in machine code becomes the text of a TaskError, except for KeyboardInterrupt and the like.
        """
        now, outer = _Build(task, resetting), building.now
        try:
            building.now = now
            make()
            if not now.finished:
                raise now.interrupt()
            return now.width
        except TaskError as failure:
            if now.error is not None and (task or not isinstance(now.error, Exception)):
                raise now.error from None
            # An interrupt may also have come just before the callback returned.
            if _NO_MESSAGE in str(failure) or (not now.finished and _NO_FIELD in str(failure)):
                raise now.interrupt() from None
            raise
        finally:
            building.now = outer
            del now  # breaks the cycle of its error, the traceback and this frame

    def register(self, engine: Engine) -> None:
        """Registers the task with an engine. A second call, after an interrupt for example, does nothing."""
        function = engine["mjenv_register_task"]
        function.argtypes, function.restype = (POINTER(task_declarations.mjenv_task),), c_int32
        statuses = self._statuses.setdefault(engine.path, [])
        if Status.OK not in statuses:
            _KEPT.append(self)
            # One call of a function in C, so that no interrupt comes between the registration and storing its status.
            statuses.extend(map(function, (byref(self.struct),)))
            if statuses[-1]:
                _KEPT.remove(self)
            engine.check(statuses[-1])

    def _described(self) -> Any:
        kind = self.kind
        task = task_declarations.mjenv_task(ctypes.sizeof(task_declarations.mjenv_task), kind.revision)
        task.id, task.frame_skip, task.time_limit = encoded(self.id, "the id"), kind.frame_skip, kind.time_limit or 0
        if not hasattr(kind, "model"):
            raise OptionError(f"{kind.__name__} does not define model", Status.E_TYPE)
        model = os.fspath(kind.model)
        if "<" in model:
            task.model_text = encoded(model, "model")
        else:
            if model.startswith("./"):
                model = str(_folder_of(kind) / model)
            task.model = encoded(model, "model")
        if kind.reward_threshold is not None:
            task.has_reward_threshold, task.reward_threshold = 1, kind.reward_threshold
        if kind.camera is not None:
            task.camera = POINTER(task_declarations.mjenv_task_camera)(_camera(kind.camera))
        settings = [self._setting(name, setting) for name, setting in self.settings.items()]
        task.options, task.option_count = (
            (task_declarations.mjenv_task_option * len(settings))(*settings),
            len(settings),
        )
        self._build = task_declarations.BUILD(self._build_environment)
        task.build = ctypes.cast(self._build, c_void_p).value
        task.carry_count = sum(math.prod(shape) for shape in kind.state.values())
        if self.is_code:
            task.destroy = ctypes.cast(_libc.free, c_void_p).value
            _set_callbacks(task, kind)
        else:
            task.physics_only = 1
            if self.resets_rows:
                self._reset = task_declarations.RESET(self._reset_row)
                task.reset = ctypes.cast(self._reset, c_void_p).value
        return task

    def _reset_row(self, key: int, start: Any) -> int:
        resetting = self._environments[key]
        began = Start(start, resetting.own)
        try:
            resetting.reset_row(began)
            began.write()
            return 0
        except BaseException as error:
            resetting.error = error
            message = f"{type(error).__name__}: {error}"
            api = ctypes.cast(start.contents.api, POINTER(task_declarations.mjenv_task_api)).contents
            return int(api.fail_with(message.encode("utf-8", "replace")))
        finally:
            began.close()

    def _setting(self, name: str, setting: Setting) -> Any:
        default = setting.default
        option = task_declarations.mjenv_task_option(ctypes.sizeof(task_declarations.mjenv_task_option))
        option.name, option.doc = encoded(name, "an option's name"), setting.doc.encode()
        if isinstance(default, (int, float)):
            kinds = {bool: Kind.FLAG, int: Kind.INTEGER, float: Kind.REALS}
            option.kind = next(kind for of, kind in kinds.items() if isinstance(default, of))
            option.value = default
        elif isinstance(default, str):
            option.kind, option.text = Kind.STRING, encoded(default, name)
            option.choices = " ".join(setting.choices).encode() or None
        elif isinstance(default, (tuple, list)) and default and all(isinstance(x, (int, float)) for x in default):
            values = np.array(default, np.float64)
            self._kept.append(values)
            option.kind, option.values, option.count = Kind.REALS, pointer_to(values, c_double), len(values)
        else:
            raise OptionError(
                f"option {name!r}: the default is a bool, an int, a float, floats or a str, not {default!r}",
                Status.E_TYPE,
            )
        option.live = setting.live
        if option.kind != Kind.FLAG and (setting.low, setting.high) != (-math.inf, math.inf):
            option.low, option.high = setting.low, setting.high
        return option

    # ---- the callback build ----

    def _build_environment(self, builder: Any, user: Any, result: Any) -> int:
        # KeyboardInterrupt can come outside of the try statement, too. ctypes then prints it and returns any number.
        now, model = building.now or _Build(None), None
        try:
            model = Model(builder)
            task = now.task
            if type(task) is not self.kind:
                task = self.kind()
            self.prepare(task, model)
            numbers = task.build(model)
            _check_bounds(task)
            for name in self.needs:
                if name in ON_DEMAND:
                    model.call("need", name)
            for name in ("current", "random_state"):
                if getattr(self.kind, name):
                    model.call(name)
            for name in self.kind.own:
                model.call("own", name)
            if count := len(task.action_bounds):
                bounds = ((c_double * count)(*ends) for ends in zip(*task.action_bounds, strict=True))
                model.call("action", count, *bounds)
            (_check_code if self.is_code else _check_numpy)(task)
            self._describe_state(task, model)
            if self.is_code:
                self._describe_code(task, model)
            else:
                now.width = self._describe_numpy(task, model)
            if self.is_code:
                # build may have given the object callbacks of its own, or None.
                own = [task.__dict__[name] for name in _METHODS if name in task.__dict__]
                self._callbacks.update({_address(function): function for function in own})
                _set_callbacks(builder.contents.task.contents, task)
                result[0] = _allocated(numbers)
            elif now.resetting is not None:
                now.resetting.own = {name: model.array(name).shape for name in self.kind.own}
                result[0] = id(now.resetting)
                self._environments[id(now.resetting)] = now.resetting
            now.finished = True
            return 0
        except BaseException as error:
            now.error = error
            message = f"{type(error).__name__}: {error}"
            return int(builder.contents.api.contents.fail_with(message.encode("utf-8", "replace")))

    def prepare(self, task: Task, model: Model) -> None:
        """Gives a task the attributes that its methods use."""
        for name in ("nq", "nv", "na", "nu", "qpos0", "timestep", "dt"):
            setattr(task, name, getattr(model, name))
        for name, setting in self.settings.items():
            if not setting.live:
                setattr(task, name, model.option(name, setting.default))

    def _describe_state(self, task: Task, model: Model) -> None:
        first = 0
        for name, shape in self.kind.state.items():
            count = math.prod(shape)
            if name in task.state_bounds:
                model.call("carry_bounds", first, count, *task.state_bounds[name])
            if name in self.kind.kept:
                model.call("keep", first, count)
            first += count

    def _describe_code(self, task: Task, model: Model) -> None:
        _describe_observation(model, task.observation_fields)
        for role, fields in ((Role.INFO, task.info_fields), (Role.RESET_INFO, task.reset_info_fields)):
            for name, given in fields.items():
                field = given if isinstance(given, Field) else Field(given)
                if field.type not in _FIELD_TYPES:
                    raise OptionError(
                        f"field {name!r} has the type {field.type!r}, which does not exist", Status.E_TYPE
                    )
                model.describe(role, name, field.shape, _FIELD_TYPES[field.type], field.doc)

    def _describe_numpy(self, task: Task, model: Model) -> int:
        """Calls each method once, for one row in the model's initial state, to learn what it returns.

        Returns how many numbers it observes.
        """
        for name in _METHODS:
            if getattr(task, name) is None and (absent := getattr(Task, name)):  # build has taken it away
                setattr(task, name, absent.__get__(task))
        arrays = {name: _initial(model, name, self.kind.max_contacts)[None] for name in self.needs}
        state = {name: np.zeros((1, *shape)) for name, shape in self.kind.state.items()}
        options = {name: model.option(name, s.default) for name, s in self.settings.items() if s.live}
        live = {name: np.array([values], np.float64) for name, values in options.items()}
        own = {name: model.array(name)[None].astype(np.float64) for name in self.kind.own}
        stream = [np.random.default_rng(0)]
        sim = Sim(arrays, state, live, own, Random(stream), np.zeros((1, model.nv)))
        checked = Checked(self.id, task)
        if not self.resets_rows:
            kept = {name: state[name].copy() for name in self.kind.kept}
            _, _, drawn = checked.reset(Random([np.random.default_rng(0)], kept, live))
            for name, values in drawn.items():
                state[name][...] = values
        task.carry(sim)
        length: int = checked.observe(sim).shape[1]
        groups = checked.groups
        parts = task.observation_fields or {name: {name: count} for name, count in groups.items()}
        parts = parts or {"observation": length}
        declared = {name: _length(part) for name, part in parts.items()}
        if sum(declared.values()) != length or groups not in ({}, declared):
            raise InvalidValueError(
                f"{self.id}: observe returned {groups or length} numbers a row; observation_fields has "
                f"{declared if groups else sum(declared.values())}"
            )
        _describe_observation(model, parts)
        for name, values in checked.reset_info(sim).items():
            model.describe(Role.RESET_INFO, name, values.shape[1:], _type_of(values))
        action = np.zeros((1, len(task.action_bounds) or task.nu), np.float32)
        checked.before_step(sim, action)
        _, _, infos = checked.step(sim, action)
        for name, values in infos.items():
            # The trial action is float32, so infos that are float32 have the action's dtype.
            kind = Dtype.ACTION if values.dtype == np.float32 else _type_of(values)
            model.describe(Role.INFO, name, values.shape[1:], kind)
        return length


def _length(part: int | Mapping[str, int]) -> int:
    """The length of a part of the observation, or of a group of parts."""
    return sum(part.values()) if isinstance(part, Mapping) else part


def _describe_observation(model: Model, parts: Mapping[str, int | Mapping[str, int]]) -> None:
    for name, part in parts.items():
        if isinstance(part, Mapping):
            for term, length in part.items():
                model.describe(Role.OBSERVATION, term, (length,), Dtype.FLOAT64, group=name)
        else:
            model.describe(Role.OBSERVATION, name, (part,), Dtype.FLOAT64)


def overrides(task: Task | type[Task], name: str) -> bool:
    """Whether the class, or the object, has a method of its own of this name, which is not None."""
    found = getattr(task, name)
    return found is not None and getattr(found, "__func__", found) is not getattr(Task, name)


def _check_code(task: Task | type[Task]) -> None:
    """Raises OptionError unless all methods that the class, or the object, has are machine code."""
    own = [name for name in _METHODS if overrides(task, name)]
    python = [name for name in own if not _address(getattr(task, name))]
    if python:
        code = next(name for name in _METHODS if _address(getattr(task, name)))
        raise OptionError(f"{_name(task)}: {code} is machine code, so {python[0]} must be, too", Status.E_TYPE)


def _set_callbacks(struct: Any, task: Task | type[Task]) -> None:
    for name in _METHODS:
        setattr(struct, name, _address(getattr(task, name)) or None)


def _needs_of(kind: type[Task]) -> tuple[str, ...]:
    """The arrays that a task needs. "contacts" stands for all arrays contact.* in a NumPy task."""
    if isinstance(kind.needs, str):
        raise OptionError(f"{kind.__name__}: needs is a sequence of names, not {kind.needs!r}", Status.E_TYPE)
    names: list[str] = []
    for name in kind.needs:
        if _address(kind.observe):
            names.append("contacts" if name.startswith("contact") else name)
        elif name in ("contact", "contacts"):
            names += ["ncon", *(f"contact.{part}" for part in CONTACT)]
        elif name.startswith("contact.") and name.removeprefix("contact.") not in CONTACT:
            known = ", ".join(("contacts", *(f"contact.{part}" for part in CONTACT)))
            raise UnknownNameError(f"{kind.__name__}: needs has {name!r}; of contacts there are {known}", Status.E_NAME)
        else:
            names.append(name)
    return tuple(dict.fromkeys(names))


def _check_numpy(task: Task | type[Task]) -> None:
    """Refuses what only tasks in machine code can have."""
    if task.before_substep is not None:
        raise OptionError(
            f"{_name(task)}: before_substep must be machine code, "
            "because a NumPy method would call Python before each mj_step",
            Status.E_TYPE,
        )
    for name in task.own:
        if name in ("qfrc_applied", "xfrc_applied"):
            raise OptionError(f"{_name(task)}: own has {name!r}, which is for tasks in machine code", Status.E_TYPE)
    if len(task.action_bounds) and not overrides(task, "before_step"):
        raise OptionError(f"{_name(task)}: action_bounds need the method before_step", Status.E_TYPE)


def _name(task: Task | type[Task]) -> str:
    return (task if isinstance(task, type) else type(task)).__name__


# The parameters of the methods of NumPy tasks.
_PARAMETERS = {
    "build": ("model",),
    "reset": ("rng", "rows"),
    "reset_row": ("start",),
    "observe": ("sim",),
    "before_step": ("sim", "action"),
    "step": ("sim", "action"),
    "carry": ("sim",),
    "reset_info": ("sim",),
    "compute_reward": ("achieved_goal", "desired_goal", "info"),
}


def _check_parameters(kind: type[Task]) -> None:
    for name, parameters in _PARAMETERS.items():
        try:
            signature = inspect.signature(getattr(kind, name).__get__(object(), kind))
        except (ValueError, AttributeError):  # a callable without a readable signature
            continue
        try:
            signature.bind(*parameters)
        except TypeError:
            wanted, given = (", ".join(("self", *names)) for names in (parameters, signature.parameters))
            hint = (
                "; it cannot draw: draw in step, and keep the numbers in state" if name in ("observe", "carry") else ""
            )
            raise OptionError(f"{kind.__name__}: {name} takes ({wanted}), not ({given}){hint}", Status.E_TYPE) from None


def _initial(model: Model, name: str, contacts: int) -> Float64Array:
    """An array in the model's initial state. Arrays of contacts are zeros, because only a reset finds contacts."""
    name = name.removeprefix("model.")
    columns = CONTACT.get(name.removeprefix("contact.")) if name.startswith("contact.") else None
    if columns is None:
        return np.asarray(model.array(name), np.float64)
    most = int(model.array("nconmax"))
    most = 500 if most < 0 else most  # -1 on MuJoCo 4.0, where the library then has room for 500
    return np.zeros((min(contacts or most, most), *columns))


class Resetting:
    """Calls a NumPy task's reset_row for the library."""

    own: Mapping[str, tuple[int, ...]] = {}

    def __init__(self, id: str, task: Task) -> None:
        self._checked, self._task = Checked(id, task), task
        self.row = 0  # which it resets
        self.error: BaseException | None = None
        self.state: dict[str, Float64Array] = {}

    def reset_row(self, start: Start) -> None:
        task, checked = self._task, self._checked
        names = {name: shape for name, shape in task.state.items() if name not in task.kept}
        found = task.reset_row(start) or {}
        if not isinstance(found, dict) or set(found) != set(names):
            shown = sorted(found) if isinstance(found, dict) else _kind(found)
            raise checked.wrong("reset_row", f"the state is {shown}, not a dict of {sorted(names)}", self.row)
        self.state = {}
        for name, shape in names.items():
            self.state[name] = checked.floats("reset_row", name, found[name], shape, self.row)[None]
        checked.bounded("reset_row", self.state, (self.row,))


class Checked:
    """Calls a NumPy task's methods and checks what they return."""

    def __init__(self, id: str, task: Task) -> None:
        self._id, self.task, self._rows = id, task, 0  # how many rows the arrays of the last sim have
        self.kind = type(task)
        # The groups of the observation and their lengths, which the first call of observe sets.
        self.groups: dict[str, int] = {}
        self._observed = False

    def reset(self, rng: Random, chosen: Any = (0,)) -> tuple[Float64Array, Float64Array, dict[str, Float64Array]]:
        """chosen: the rows whose episodes begin."""
        task, rows = self.task, rng.rows
        found = task.reset(rng, rows)
        names = tuple(name for name in self.kind.state if name not in self.kind.kept)
        kept = set(self.kind.kept)
        size = 3 if names else 2
        if not isinstance(found, tuple) or not (len(found) == size or (not names and len(found) == 3)):
            what = "qpos, qvel and a dict of the state" if names else "qpos and qvel"
            raise self.wrong("reset", f"returned {_kind(found)}, not {what}")
        qpos = self.floats("reset", "qpos", found[0], (rows, task.nq))
        qvel = self.floats("reset", "qvel", found[1], (rows, task.nv))
        for name, values in (("qpos", qpos), ("qvel", qvel)):
            if not (finite := np.isfinite(values).all(axis=1)).all():
                raise self.wrong("reset", f"{name} has a number that is not finite", chosen[np.argmin(finite)])
        given = found[2] if len(found) == 3 else {}
        if not isinstance(given, dict) or set(given) - kept != set(names):
            shown = sorted(given) if isinstance(given, dict) else _kind(given)
            raise self.wrong("reset", f"the state is {shown}, not a dict of {sorted(names)}")
        shapes = self.kind.state
        state = {name: self.floats("reset", name, values, (rows, *shapes[name])) for name, values in given.items()}
        return qpos, qvel, state

    def bounded(self, method: str, state: Mapping[str, Float64Array], rows: Any) -> None:
        """Fails if the method has written a number out of its bounds, because a snapshot would be refused."""
        for name in (name for name in self.task.state_bounds if name in state):
            (low, high), values = self.task.state_bounds[name], state[name].reshape(len(rows), -1)
            outside = ~((low <= values) & (values <= high))  # NaN, too
            if outside.any():
                row = rows[np.argmax(outside.any(axis=1))]
                raise self.wrong(method, f"the state {name!r} has {values[outside][0]}, not {low} to {high}", row)

    def observe(self, sim: Sim) -> NDArray[Any]:
        self._rows = len(sim.kick)
        found = self.task.observe(sim)
        given = {f"group {name!r} is": part for name, part in found.items()} if isinstance(found, Mapping) else None
        parts = [self._numbers(what, part) for what, part in ({"returned": found} if given is None else given).items()]
        groups = {name: part.shape[1] for name, part in zip(found, parts, strict=True)} if given is not None else {}
        if self._observed and list(groups.items()) != list(self.groups.items()):
            raise self.wrong("observe", f"returned the groups {groups}, but at first {self.groups}")
        self.groups, self._observed = groups, True
        return np.concatenate(parts, axis=1) if parts else np.zeros((self._rows, 0))

    def _numbers(self, what: str, values: Any) -> NDArray[Any]:
        array = np.asarray(values)
        if array.ndim != 2 or len(array) != self._rows or array.dtype.kind not in "fiub":
            raise self.wrong("observe", f"{what} {_kind(array)}, not numbers of the shape ({self._rows}, n)")
        return array

    def reset_info(self, sim: Sim) -> dict[str, NDArray[Any]]:
        self._rows = len(sim.kick)
        return self._infos("reset_info", self.task.reset_info(sim))

    def before_step(self, sim: Sim, action: NDArray[Any]) -> NDArray[Any]:
        self._rows = len(sim.kick)
        ctrl = np.asarray(self.task.before_step(sim, action))
        if ctrl.shape != (self._rows, self.task.nu) or ctrl.dtype.kind not in "fiub":
            raise self.wrong(
                "before_step", f"ctrl is {_kind(ctrl)}, not numbers of the shape {(self._rows, self.task.nu)}"
            )
        return np.ascontiguousarray(ctrl, ctrl.dtype if ctrl.dtype == np.float32 else np.float64)

    def step(self, sim: Sim, action: NDArray[Any]) -> tuple[Float64Array, NDArray[np.bool_], dict[str, NDArray[Any]]]:
        self._rows = len(sim.kick)
        found = self.task.step(sim, action)
        if not isinstance(found, tuple) or len(found) != 3:
            raise self.wrong("step", f"returned {_kind(found)}, not a reward, terminated and an info")
        reward = self.floats("step", "the reward", found[0], (self._rows,))
        terminated = np.asarray(found[1])
        if terminated.dtype != np.bool_ or terminated.shape != (self._rows,):
            raise self.wrong("step", f"terminated is {_kind(terminated)}, not bool of the shape {(self._rows,)}")
        return reward, terminated, self._infos("step", found[2])

    def _infos(self, method: str, infos: Any) -> dict[str, NDArray[Any]]:
        if not isinstance(infos, dict):
            raise self.wrong(method, f"the info is {_kind(infos)}, not a dict of arrays")
        arrays = {name: np.asarray(values) for name, values in infos.items()}
        for name, values in arrays.items():
            if not values.ndim or len(values) != self._rows or values.dtype.kind not in "fiub":
                raise self.wrong(
                    method, f"info {name!r} is {_kind(values)}, not numbers of the shape ({self._rows}, ...)"
                )
        return arrays

    def floats(
        self, method: str, what: str, values: Any, shape: tuple[int, ...], row: int | None = None
    ) -> Float64Array:
        array = np.asarray(values)
        if array.shape != shape or array.dtype.kind not in "fiub":
            raise self.wrong(method, f"{what} is {_kind(array)}, not numbers of the shape {shape}", row)
        return array.astype(np.float64, copy=False)

    def wrong(self, method: str, why: str, row: int | None = None) -> TaskError:
        return TaskError(f"{'' if row is None else f'row {row}: '}{self._id}: {method}: {why}", Status.E_TASK)


def _check_bounds(task: Task) -> None:
    for name, (low, high) in task.state_bounds.items():
        if name not in task.state:
            raise OptionError(f"state_bounds has {name!r}, which is not in state", Status.E_NAME)
        if not low <= 0 <= high:
            raise InvalidValueError(f"state_bounds of {name!r} are {(low, high)}, but must contain 0")


def _kind(value: Any) -> str:
    """Describes a value that a method returned, for error messages."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} of the shape {value.shape}"
    return f"{len(value)} values" if isinstance(value, tuple) else type(value).__name__


def _type_of(values: NDArray[Any]) -> Dtype:
    return _TYPES.get(values.dtype, Dtype.FLOAT64 if values.dtype.kind == "f" else Dtype.INT64)


def _address(function: Any) -> int:
    """The address of machine code; 0 for a function of Python."""
    if isinstance(function, staticmethod):
        function = function.__func__
    if isinstance(function, int):
        return function
    if isinstance(function, ctypes._CFuncPtr):  # type: ignore[attr-defined, unused-ignore]
        return ctypes.cast(function, c_void_p).value or 0
    address = getattr(function, "address", 0)  # numba's
    return address if isinstance(address, int) else 0


def _folder_of(kind: type[Task]) -> Path:
    """The folder of a class's file; the current folder if it was typed into an interpreter."""
    try:
        return Path(inspect.getfile(kind)).resolve().parent
    except (OSError, TypeError):
        return Path.cwd()


def _camera(config: Mapping[str, Any]) -> Any:
    camera = task_declarations.mjenv_task_camera(ctypes.sizeof(task_declarations.mjenv_task_camera))
    unknown = set(config) - {"trackbodyid", "distance", "lookat", "elevation"}
    if unknown:
        raise OptionError(f"camera has no {sorted(unknown)[0]!r}", Status.E_NAME)
    camera.trackbodyid = config.get("trackbodyid", declarations.BODY_UNSET)
    camera.distance = config.get("distance", math.nan)
    camera.elevation = config.get("elevation", math.nan)
    camera.lookat[:] = config.get("lookat", (math.nan,) * 3)
    return camera


_libc = ctypes.CDLL("msvcrt" if os.name == "nt" else None)
_libc.malloc.argtypes, _libc.malloc.restype = (c_size_t,), c_void_p


def _allocated(numbers: Sequence[float] | None) -> int:
    """The address of a copy of the numbers, which the library frees with the environment."""
    values = np.array([] if numbers is None else numbers, np.float64).reshape(-1)
    address = _libc.malloc(max(values.nbytes, 1))
    if not address:
        raise MemoryError
    ctypes.memmove(address, values.ctypes.data, values.nbytes)
    return int(address)


@dataclass
class _Build:
    """An environment that is being built."""

    task: Task | None  # a NumPy task
    resetting: Resetting | None = None  # of a NumPy task with reset_row
    error: BaseException | None = None  # what the callback has raised
    finished: bool = False  # whether the callback has described the task
    width: int = 0  # how many numbers a NumPy task observes

    def interrupt(self) -> BaseException:
        """The exception that ended the callback."""
        return self.error or KeyboardInterrupt()


class _Building(threading.local):
    now: _Build | None = None


# On each thread: the environment that is being built.
building = _Building()
# Texts in the library's error if ctypes has ended the callback, because _build_environment always sets another message.
# The second comes if ctypes returned 0, for which the library takes an unfinished build as finished.
_NO_MESSAGE, _NO_FIELD = "without a message", "there is no field of the observation"
