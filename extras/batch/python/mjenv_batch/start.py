"""The start of one row's episode, which reset_row gets."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Mapping, Sequence
from ctypes import c_double, c_int64
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi import task_declarations
from mjenv.capi.dtypes import Float64Array
from mjenv.capi.handle import pointer_to
from mjenv.capi.pointers import POINTER
from mjenv.errors import InvalidValueError


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
        self.check_open()
        return int(self._api.contact_count(self._raw))

    @property
    def time(self) -> float:
        """The simulation's time, s."""
        self.check_open()
        return float(_memory(self._struct.time, (1,))[0])

    @time.setter
    def time(self, seconds: float) -> None:
        self.check_open()
        _memory(self._struct.time, (1,))[0] = seconds

    def check_open(self) -> None:
        if self._raw is None:
            raise RuntimeError("reset_row has returned, so its start cannot be used any more")

    def draw(self, name: str, *arguments: Any) -> Any:
        """Calls the function of mjenv_task_api with this name on the row's streams."""
        self.check_open()
        return getattr(self._api, name)(self._struct.random, *arguments)

    def simulation(self) -> Any:
        """The mjenv_sim of the row."""
        self.check_open()
        return ctypes.cast(self._struct.sim, POINTER(task_declarations.mjenv_sim)).contents

    def write(self) -> None:
        """Passes what reset_row has written to the library."""
        self.check_open()
        for view, values in self._arrays:
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
        raw = self._start.simulation()
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
        self._draw = start.draw


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
