"""Converts draws, noise, delays and pushes (randomization.py) into the library's structs."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from ctypes import c_double, c_int64
from dataclasses import fields
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjenv.capi import declarations
from mjenv.capi.declarations import Distribution, Effect, Role, Status
from mjenv.capi.pointers import POINTER
from mjenv.capi.schema import Field
from mjenv.errors import InvalidValueError, OptionError, UnknownNameError
from mjenv.randomization import Delay, Noise, Offset, Push, Same, Scale, Value

# The keywords that select elements by objects, and MuJoCo's array that tells which object an element belongs to, by
# the beginning of the array's name.
_OWNERS = {
    ("body_", "body"): None,
    ("geom_", "geom"): None,
    ("site_", "site"): None,
    ("jnt_", "joint"): None,
    ("actuator_", "actuator"): None,
    ("tendon_", "tendon"): None,
    ("dof_", "joint"): "dof_jntid",
    ("geom_", "body"): "geom_bodyid",
    ("site_", "body"): "site_bodyid",
    ("jnt_", "body"): "jnt_bodyid",
    ("dof_", "body"): "dof_bodyid",
}
_KINDS: dict[str, type[Value | Same]] = {"value": Value, "scale": Scale, "offset": Offset, "same": Same}
_EFFECTS = {"value": Effect.VALUE, "scale": Effect.SCALE, "offset": Effect.OFFSET}
Made = TypeVar("Made")


class Rows(Protocol):
    """The rows whose draws are set, and whose model names objects and elements: _handle.Rows."""

    @property
    def options(self) -> Mapping[str, Any]: ...
    def fields(self, role: Role) -> Sequence[Field]: ...
    def array(self, role: Role, name: str) -> Field | None: ...
    def value(self, role: Role, name: str) -> NDArray[Any]: ...
    def object_index(self, kind: str, name: str) -> int: ...
    def text(self, name: Any) -> bytes: ...


def _made(kind: type[Made], value: Any, keyword: str) -> Made:
    """The value as a `kind`, also if it is the mapping that the JSON of a spec has made of one."""
    if isinstance(value, kind):
        return value
    if not isinstance(value, Mapping):
        raise OptionError(f"{keyword} takes mjenv.{kind.__name__}, not {value!r}", Status.E_TYPE)
    names = [one.name for one in fields(kind) if one.init]  # type: ignore[arg-type]
    unknown = [name for name in value if name not in (*names, "kind")]
    if unknown:
        raise OptionError(f"{keyword}: {kind.__name__} has no {unknown[0]!r}; it has {', '.join(names)}", Status.E_TYPE)
    return kind(**{name: value[name] for name in names if name in value})


def _several(value: Any) -> Sequence[Any]:
    return value if isinstance(value, (list, tuple)) else [value]


def draws_of(given: Any) -> list[tuple[str, Value | Same]]:
    """The draws of the keyword randomize, in their order."""
    if given is None:
        return []
    if not isinstance(given, Mapping):
        raise OptionError(f"randomize is a dict of arrays' names, not {given!r}", Status.E_TYPE)
    found = []
    for array, values in given.items():
        for value in _several(values):
            kind = value.get("kind") if isinstance(value, Mapping) else None
            if kind is not None and kind not in _KINDS:
                raise OptionError(f"randomize[{array!r}]: no kind {kind!r}; there are {', '.join(_KINDS)}")
            where, wanted = f"randomize[{array!r}]", _KINDS.get(str(kind), Value)
            found.append((array, value if isinstance(value, Same) else _made(wanted, value, where)))
    return found


def _numbers(values: Any, what: str) -> NDArray[np.float64]:
    try:
        return np.atleast_1d(np.array(values, np.float64))
    except (TypeError, ValueError):
        raise OptionError(f"{what} holds numbers, not {values!r}", Status.E_TYPE) from None


def _integers(values: Any, what: str) -> NDArray[np.int64]:
    array = np.atleast_1d(np.array(values))
    if array.ndim != 1 or (array.size and array.dtype.kind not in "iu"):
        raise OptionError(f"{what} holds integers, not {values!r}", Status.E_TYPE)
    return array.astype(np.int64)


class Lists:
    """The library's structs, with the arrays that they point to."""

    def __init__(self) -> None:
        self._kept: list[NDArray[Any]] = []

    def pointer(self, values: ArrayLike, kind: type[Any]) -> Any:
        array = np.ascontiguousarray(values, np.float64 if kind is c_double else np.int64)
        self._kept.append(array)
        return array.ctypes.data_as(POINTER(kind))

    def items(self, rows: Rows, draws: Sequence[tuple[str, Value | Same]]) -> Any:
        """An array of mjenv_randomization."""
        items = (declarations.mjenv_randomization * len(draws))()
        effect, distribution = Effect.VALUE, Distribution.UNIFORM
        for item, (array, draw) in zip(items, draws, strict=True):
            item.struct_size = ctypes.sizeof(item)
            if isinstance(draw, Same):
                factor = _numbers(draw.factor, f"randomize[{array!r}]: factor")
                if factor.size != 1 or not factor[0]:
                    raise InvalidValueError(
                        f"randomize[{array!r}]: factor is a number that is not 0, not {draw.factor!r}", Status.E_VALUE
                    )
                item.repeats, item.factor = 1, factor[0]
            else:
                parameters, distribution = _parameters(array, draw)
                effect = _EFFECTS[draw.kind]
                item.parameters, item.parameter_count = self.pointer(parameters, c_double), parameters.size
                item.shared = int(draw.shared)
            item.distribution, item.effect = distribution, effect
            item.array = rows.text(array)
            elements = _elements(rows, array, draw)
            if elements is not None:
                item.elements, item.element_count = self.pointer(elements, c_int64), elements.size
            item.constants = int(draw.set_constants)
        return items

    def perturbation(self, rows: Rows, noise: Any, delay: Any, push: Any) -> Any:
        """An mjenv_perturbation."""
        noise = Noise() if noise is None else _made(Noise, noise, "noise")
        delay = Delay() if delay is None else _made(Delay, delay, "delay")
        pushes = [_made(Push, one, "push") for one in ([] if push is None else _several(push))]
        found = declarations.mjenv_perturbation()
        found.struct_size = ctypes.sizeof(found)
        for name, role in (("action", Role.ACTION), ("observation", Role.OBSERVATION)):
            deviations = _numbers(getattr(noise, name), f"noise: {name}")
            count = sum(field.count for field in rows.fields(role))
            # The time and the history have no noise, and only the library knows the count without them.
            is_known = name == "action" or not (rows.options.get("time_aware") or rows.options.get("history"))
            if is_known and deviations.size not in (1, count):
                raise InvalidValueError(f"noise: {name} has {deviations.size} numbers, not 1 or {count}", Status.E_SIZE)
            if deviations.any():
                setattr(found, f"{name}_noise", self.pointer(deviations, c_double))
                setattr(found, f"{name}_noise_count", deviations.size)
            steps = _integers(getattr(delay, name), f"delay: {name}")
            if steps.size not in (1, 2):
                given = getattr(delay, name)
                raise OptionError(
                    f"delay: {name} is one int, or a pair of ints (least, most), not {given!r}", Status.E_TYPE
                )
            setattr(found, f"{name}_delay", int(steps[0]))
            if steps.size == 2:
                if steps[1] < steps[0]:
                    raise InvalidValueError(f"delay: {name} is {steps.tolist()}, in the wrong order", Status.E_VALUE)
                setattr(found, f"max_{name}_delay", int(steps[1]))
        if delay.redraw not in ("reset", "step"):
            raise OptionError(f"delay: redraw is 'reset' or 'step', not {delay.redraw!r}", Status.E_VALUE)
        found.redraws_delays = int(delay.redraw == "step")
        first = _numbers(delay.first_action, "delay: first_action")
        if first.any():
            found.first_action, found.first_action_count = self.pointer(first, c_double), first.size
        structs = (declarations.mjenv_push * len(pushes))()
        for struct, one in zip(structs, pushes, strict=True):
            struct.struct_size = ctypes.sizeof(struct)
            struct.body = _object(rows, "body", one.body)
            struct.is_kick = int(one.velocity is not None or one.angular_velocity is not None)
            numbers = _push_ranges(one)
            struct.low[:], struct.high[:] = numbers[:, 0].tolist(), numbers[:, 1].tolist()
            lasts = _integers(one.duration, "push: duration")
            if lasts.size not in (1, 2):
                raise OptionError(
                    f"push: duration is one int, or a pair of ints (least, most), not {one.duration!r}", Status.E_TYPE
                )
            struct.min_duration, struct.max_duration = int(lasts[0]), int(lasts[-1])
            every = _integers(one.every, "push: every")
            if every.shape != (2,):
                raise InvalidValueError("push: every is the fewest and the most steps", Status.E_SIZE)
            struct.min_steps, struct.max_steps = every.tolist()
        found.pushes, found.push_count = structs, len(pushes)
        return found


_STILL = ((0.0, 0.0),) * 3  # ranges that draw nothing


def _push_ranges(push: Push) -> NDArray[np.float64]:
    """The six ranges of a push: of the force and the torque, or of the two velocities."""
    kinds = {"force": push.force, "torque": push.torque}
    if push.velocity is not None or push.angular_velocity is not None:
        if any(_numbers(values, f"push: {name}").any() for name, values in kinds.items()):
            raise OptionError(
                "push: a push has either a force and a torque, or velocities; for both, use two pushes", Status.E_VALUE
            )
        kinds = {"velocity": push.velocity or _STILL, "angular_velocity": push.angular_velocity or _STILL}
    ranges = [_numbers(values, f"push: {name}") for name, values in kinds.items()]
    if any(values.shape != (3, 2) for values in ranges):
        raise InvalidValueError(f"push: {' and '.join(kinds)} are three ranges (low, high) each", Status.E_SIZE)
    return np.concatenate(ranges)


def _int64(value: Any, what: str) -> int:
    number = _integers(value, what)
    if number.size != 1:
        raise OptionError(f"{what} is an int, not {value!r}", Status.E_TYPE)
    return int(number[0])


def _parameters(array: str, draw: Value) -> tuple[NDArray[np.float64], Distribution]:
    """The parameters of a draw's distribution."""
    where = f"randomize[{array!r}]"
    wanted = {
        "uniform": ("low", "high"),
        "log_uniform": ("low", "high"),
        "normal": ("mean", "std"),
        "truncated_normal": ("mean", "std", "low", "high"),
        "choice": ("choices",),
    }
    name = "choice" if draw.choices is not None and draw.distribution == "uniform" else draw.distribution
    if name not in wanted:
        raise OptionError(f"{where}: no distribution {name!r}; there are {', '.join(wanted)}", Status.E_VALUE)
    given = [one for one in ("low", "high", "mean", "std", "choices") if getattr(draw, one) is not None]
    if sorted(given) != sorted(wanted[name]):
        takes, has = " and ".join(wanted[name]), " and ".join(given) or "none of them"
        raise OptionError(f"{where}: {name} takes {takes}, not {has}", Status.E_TYPE)
    if name == "choice":
        return _numbers(draw.choices, f"{where}: choices"), Distribution.CHOICE
    values = [_numbers(getattr(draw, one), f"{where}: {one}") for one in wanted[name]]
    if any(value.size != 1 for value in values):
        raise OptionError(f"{where}: {' and '.join(wanted[name])} are one number each", Status.E_TYPE)
    return np.concatenate(values), Distribution[name.upper()]


def _object(rows: Rows, kind: str, name: Any) -> int:
    """The number of an object."""
    if isinstance(name, str):
        return rows.object_index(kind, name)
    return _int64(name, kind)


def _elements(rows: Rows, array: str, draw: Value | Same) -> NDArray[np.int64] | None:
    """The indices of the elements that are drawn, in the order of the draws; None for all elements."""
    where = f"randomize[{array!r}]"
    kinds = ("body", "geom", "joint", "actuator", "site", "tendon")
    chosen = [kind for kind in kinds if getattr(draw, kind) is not None]
    if len(chosen) + (draw.elements is not None) > 1:
        raise OptionError(f"{where}: give one of {', '.join((*kinds, 'elements'))}", Status.E_TYPE)
    if draw.elements is not None:
        if draw.columns is not None:
            raise OptionError(f"{where}: elements are of the flattened array, which has no columns", Status.E_TYPE)
        return _integers(draw.elements, f"{where}: elements")
    if not chosen and draw.columns is None:
        return None
    found = rows.array(Role.MODEL, array)
    if found is None:
        raise UnknownNameError(f"{where}: mjModel has no such array", Status.E_NAME)
    numbers = np.arange(found.count).reshape(found.shape)
    if chosen:
        numbers = numbers[_objects(rows, array, chosen[0], getattr(draw, chosen[0]), numbers.shape[:1])]
    if draw.columns is not None:
        columns = _integers(draw.columns, f"{where}: columns")
        if numbers.ndim != 2 or (columns.size and not 0 <= columns.min() <= columns.max() < numbers.shape[1]):
            shape = "no columns" if numbers.ndim != 2 else f"the columns 0 to {numbers.shape[1] - 1}"
            raise InvalidValueError(f"{where}: it has {shape}, not {draw.columns!r}", Status.E_VALUE)
        numbers = numbers[:, columns]
    return numbers.reshape(-1).astype(np.int64)


def _objects(rows: Rows, array: str, kind: str, names: Any, shape: tuple[int, ...]) -> NDArray[np.intp]:
    """The rows of the array that belong to the objects."""
    where = f"randomize[{array!r}]"
    owners = {found: owner for (prefix, found), owner in _OWNERS.items() if array.startswith(prefix)}
    if kind not in owners:
        choices = f"{', '.join(owners)}" if owners else "elements"
        raise OptionError(f"{where}: its elements are not selected by {kind}, but by {choices}", Status.E_TYPE)
    numbers = [_object(rows, kind, name) for name in _several(names)]
    owner = owners[kind]
    of_elements = np.arange(*shape) if owner is None else rows.value(Role.MODEL, owner).reshape(-1)
    found = [np.flatnonzero(of_elements == number) for number in numbers]
    for name, indices in zip(_several(names), found, strict=True):
        if not indices.size:
            raise InvalidValueError(f"{where}: no element belongs to {kind} {name!r}", Status.E_VALUE)
    return np.concatenate(found)
