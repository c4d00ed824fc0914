"""Registers a class derived from mjenv.Task, whose methods are machine code, as a task of the library.

A program beside the wrapper may derive from Registered a class for tasks whose methods are Python.
"""

from __future__ import annotations

import ctypes
import inspect
import math
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from ctypes import CFUNCTYPE, byref, c_double, c_int32, c_size_t, c_void_p
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mjenv.capi import declarations, task_declarations
from mjenv.capi.declarations import Dtype, Kind, Role, Status
from mjenv.capi.engine import Engine
from mjenv.capi.handle import Rows, encoded
from mjenv.capi.pointers import POINTER
from mjenv.capi.task_declarations import CALLBACKS
from mjenv.errors import InvalidValueError, OptionError, TaskError
from mjenv.task import Field, Model, Setting, Task

# The names that mjenv_task_api.need takes. The other arrays are always available.
ON_DEMAND = "contacts cfrc_ext cfrc_int cacc geom_xpos geom_xmat cam_xpos cam_xmat light_xpos light_xdir".split()
_FIELD_TYPES: dict[Any, Dtype] = {
    float: Dtype.NATIVE_FLOAT,
    int: Dtype.NATIVE_INT,
    "action": Dtype.ACTION,
    np.float64: Dtype.FLOAT64,
    np.float32: Dtype.FLOAT32,
    np.int64: Dtype.INT64,
}

_BUILD = CFUNCTYPE(c_int32, POINTER(task_declarations.mjenv_builder), c_void_p, POINTER(c_void_p))

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
        self.needs = self.needed()
        taken = set(kind.state) & {name.partition(".")[0] for name in self.needs}
        if taken:
            raise InvalidValueError(f"{kind.__name__}: {sorted(taken)[0]!r} is both in state and in needs")
        self.check_class()
        self._statuses: dict[str, list[int]] = {}  # what each engine's mjenv_register_task has returned
        self._kept: list[Any] = []
        self._callbacks: dict[int, Any] = {}  # machine code that build has given an object, by address
        self.struct = self._described()

    def needed(self) -> tuple[str, ...]:
        """The arrays that the task needs."""
        if isinstance(self.kind.needs, str):
            raise OptionError(
                f"{self.kind.__name__}: needs is a sequence of names, not {self.kind.needs!r}", Status.E_TYPE
            )
        names = ("contacts" if name.startswith("contact") else name for name in self.kind.needs)
        return tuple(dict.fromkeys(names))

    def check_class(self) -> None:
        """Raises OptionError unless the class is such a task."""
        self.check(self.kind)
        self.check_defined("reset", "observe", "step")

    def check(self, task: Task | type[Task]) -> None:
        """Raises OptionError if the class, or the object that build has prepared, has what such a task cannot have."""
        own = [name for name in (*CALLBACKS, "reset_row") if overrides(task, name)]
        if python := [name for name in own if not _address(getattr(task, name))]:
            code = next(name for name in CALLBACKS if _address(getattr(task, name)))
            raise OptionError(f"{name_of(task)}: {code} is machine code, so {python[0]} must be, too", Status.E_TYPE)

    def check_defined(self, *names: str) -> None:
        """Raises OptionError unless the class has these methods."""
        for name in names:
            if not overrides(self.kind, name):
                raise OptionError(f"{self.kind.__name__} does not define {name}", Status.E_TYPE)

    def open(self, engine: Engine, id: str, options: Mapping[str, Any], count: int = 1) -> Rows:
        """Builds an environment."""
        made: list[Rows] = []
        self.create(lambda: made.append(Rows(engine, id, options, count)), Build())
        return made[0]

    def create(self, make: Callable[[], None], now: Build) -> None:
        """Calls make, which creates an environment of this task.

        Raises what the callback has raised, if it is KeyboardInterrupt or the like, or if `now` says so. Otherwise it
        becomes the text of a TaskError.
        """
        outer = building.now
        try:
            building.now = now
            make()
            if not now.finished:
                raise now.interrupt()
        except TaskError as failure:
            if now.error is not None and (now.raises or not isinstance(now.error, Exception)):
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
        self._build = _BUILD(self._build_environment)
        task.build = ctypes.cast(self._build, c_void_p).value
        task.carry_count = sum(math.prod(shape) for shape in kind.state.values())
        self.set_callbacks(task)
        return task

    def set_callbacks(self, struct: Any) -> None:
        """Fills in the callbacks of the mjenv_task, except build."""
        struct.destroy = ctypes.cast(_libc.free, c_void_p).value
        _set_methods(struct, self.kind)

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
            option.kind, option.values, option.count = Kind.REALS, values.ctypes.data, len(values)
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
        now = building.now or Build()
        try:
            model = Model(builder)
            task = now.task if type(now.task) is self.kind else self.kind()
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
            self.check(task)
            self._describe_state(task, model)
            result[0] = self.describe(task, model, numbers, builder, now)
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

    def describe(self, task: Task, model: Model, numbers: Any, builder: Any, now: Build) -> int:
        """Describes what the methods return. Returns the callbacks' self. numbers: what build has returned."""
        describe_observation(model, task.observation_fields)
        for role, fields in ((Role.INFO, task.info_fields), (Role.RESET_INFO, task.reset_info_fields)):
            for name, given in fields.items():
                field = given if isinstance(given, Field) else Field(given)
                if field.type not in _FIELD_TYPES:
                    raise OptionError(
                        f"field {name!r} has the type {field.type!r}, which does not exist", Status.E_TYPE
                    )
                model.describe(role, name, field.shape, _FIELD_TYPES[field.type], field.doc)
        # build may have given the object callbacks of its own, or None.
        own = [task.__dict__[name] for name in CALLBACKS if name in task.__dict__]
        self._callbacks.update({_address(function): function for function in own})
        _set_methods(builder.contents.task.contents, task)
        return _allocated(numbers)


def describe_observation(model: Model, parts: Mapping[str, int | Mapping[str, int]]) -> None:
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


def is_code(kind: type[Task]) -> bool:
    """Whether the class has a method in machine code."""
    return any(_address(getattr(kind, name)) for name in CALLBACKS if overrides(kind, name))


def _set_methods(struct: Any, task: Task | type[Task]) -> None:
    for name in CALLBACKS:
        setattr(struct, name, _address(getattr(task, name)) or None)


def name_of(task: Task | type[Task]) -> str:
    return (task if isinstance(task, type) else type(task)).__name__


def _check_bounds(task: Task) -> None:
    for name, (low, high) in task.state_bounds.items():
        if name not in task.state:
            raise OptionError(f"state_bounds has {name!r}, which is not in state", Status.E_NAME)
        if not low <= 0 <= high:
            raise InvalidValueError(f"state_bounds of {name!r} are {(low, high)}, but must contain 0")


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
class Build:
    """An environment that is being built."""

    task: Task | None = None  # the environment's object of the class; None: a new one
    raises: bool = False  # whether Registered.create raises every exception of the callback as it is
    error: BaseException | None = None  # what the callback has raised
    finished: bool = False  # whether the callback has described the task

    def interrupt(self) -> BaseException:
        """The exception that ended the callback."""
        return self.error or KeyboardInterrupt()


class _Building(threading.local):
    now: Build | None = None


# On each thread: the environment that is being built.
building = _Building()
# Texts in the library's error if ctypes has ended the callback, because _build_environment always sets another message.
# The second comes if ctypes returned 0, for which the library takes an unfinished build as finished.
_NO_MESSAGE, _NO_FIELD = "without a message", "there is no field of the observation"
