"""Registers a NumPy task: a class derived from mjenv.Task whose methods compute over all rows at once."""

from __future__ import annotations

import ctypes
import inspect
import weakref
from collections.abc import Mapping
from ctypes import CFUNCTYPE, c_int32, c_void_p
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi import task_declarations
from mjenv.capi.declarations import Dtype, Role, Status
from mjenv.capi.dtypes import Float64Array
from mjenv.capi.engine import Engine
from mjenv.capi.pointers import POINTER
from mjenv.errors import InvalidValueError, OptionError, UnknownNameError
from mjenv.task import Model, Task
from mjenv.task.registered import Build, Registered, describe_observation, name_of, overrides
from mjenv_batch.checked import Checked, NumpyBuild, Resetting
from mjenv_batch.rows import NumpyRows
from mjenv_batch.sim import Random, Sim
from mjenv_batch.start import Start

_RESET = CFUNCTYPE(c_int32, c_void_p, POINTER(task_declarations.mjenv_start))
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
_TYPES = {
    np.dtype(np.float64): Dtype.FLOAT64,
    np.dtype(np.float32): Dtype.FLOAT32,
    np.dtype(np.bool_): Dtype.UINT8,  # NumpyRows shows these as bools
}


class NumpyRegistered(Registered):
    """A NumPy task that is registered with every engine."""

    def __init__(self, id: str, kind: type[Task]) -> None:
        self.resets_rows = overrides(kind, "reset_row")
        self._environments: weakref.WeakValueDictionary[int, Resetting] = weakref.WeakValueDictionary()
        super().__init__(id, kind)

    def open(self, engine: Engine, id: str, options: Mapping[str, Any], count: int = 1) -> NumpyRows:
        return NumpyRows(self, engine, id, options, count)

    def needed(self) -> tuple[str, ...]:
        """ "contacts" stands for all arrays contact.*."""
        if isinstance(self.kind.needs, str):
            return super().needed()
        names: list[str] = []
        for name in self.kind.needs:
            if name in ("contact", "contacts"):
                names += ["ncon", *(f"contact.{part}" for part in CONTACT)]
            elif name.startswith("contact.") and name.removeprefix("contact.") not in CONTACT:
                known = ", ".join(("contacts", *(f"contact.{part}" for part in CONTACT)))
                raise UnknownNameError(
                    f"{self.kind.__name__}: needs has {name!r}; of contacts there are {known}", Status.E_NAME
                )
            else:
                names.append(name)
        return tuple(dict.fromkeys(names))

    def check_class(self) -> None:
        kind = self.kind
        if self.resets_rows:
            if overrides(kind, "reset"):
                raise OptionError(
                    f"{kind.__name__} defines both reset and reset_row: define one of them", Status.E_TYPE
                )
            if not kind.current:
                raise OptionError(f"{kind.__name__}: reset_row simulates, which needs current = True", Status.E_TYPE)
        self.check_defined(*(() if self.resets_rows else ("reset",)), "observe", "step")
        self.check(kind)
        _check_parameters(kind)

    def check(self, task: Task | type[Task]) -> None:
        if task.before_substep is not None:
            raise OptionError(
                f"{name_of(task)}: before_substep must be machine code, "
                "because a NumPy method would call Python before each mj_step",
                Status.E_TYPE,
            )
        for name in task.own:
            if name in ("qfrc_applied", "xfrc_applied"):
                raise OptionError(
                    f"{name_of(task)}: own has {name!r}, which is for tasks in machine code", Status.E_TYPE
                )
        if len(task.action_bounds) and not overrides(task, "before_step"):
            raise OptionError(f"{name_of(task)}: action_bounds need the method before_step", Status.E_TYPE)

    def set_callbacks(self, struct: Any) -> None:
        struct.physics_only = 1
        if self.resets_rows:
            self._reset = _RESET(self._reset_row)
            struct.reset = ctypes.cast(self._reset, c_void_p).value

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

    def describe(self, task: Task, model: Model, numbers: Any, builder: Any, now: Build) -> int:
        width = self._describe_methods(task, model)
        if not isinstance(now, NumpyBuild):  # nobody steps this environment
            return 0
        now.width = width
        if now.resetting is None:
            return 0
        now.resetting.own = {name: model.array(name).shape for name in self.kind.own}
        self._environments[id(now.resetting)] = now.resetting
        return id(now.resetting)

    def _describe_methods(self, task: Task, model: Model) -> int:
        """Calls each method once, for one row in the model's initial state, to learn what it returns.

        Returns how many numbers it observes.
        """
        for name in task_declarations.CALLBACKS:
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
        describe_observation(model, parts)
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


def _type_of(values: NDArray[Any]) -> Dtype:
    return _TYPES.get(values.dtype, Dtype.FLOAT64 if values.dtype.kind == "f" else Dtype.INT64)
