"""What the methods of NumPy tasks get: the rows' simulations, and their random streams."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi.declarations import Distribution
from mjenv.capi.dtypes import Float64Array
from mjenv.errors import InvalidValueError


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
        return self.each(size, draw)

    def each(self, size: Size, draw: Drawing) -> Any:
        """What a function draws from each row's stream."""
        shape = self._shape(size)
        return np.stack([draw(stream, shape[1:]) for stream in self.streams])


# ---- Building an environment ----
