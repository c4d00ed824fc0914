"""Helpers for NumPy tasks of walking robots: contacts and air times of feet, and the heights of a terrain.

task.hpp has the same helpers for C++, with equal bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjenv.errors import InvalidValueError
from mjenv.task import Model

_HEIGHT_FIELD = 1  # mjGEOM_HFIELD


def touching(sim: Any, geoms: Sequence[int], other: int) -> NDArray[np.bool_]:
    """For each row and each of these geoms, whether it touches the other geom: (rows, geoms).

    Two geoms touch if they have a contact whose distance is at most 0. The task needs "ncon", "contact.geom1",
    "contact.geom2" and "contact.dist". Raises InvalidValueError if a row has more contacts than sim.contact has room
    for (the task's max_contacts).
    """
    contact: Any = sim.contact
    room = contact.geom1.shape[1]
    if (sim.ncon > room).any():
        row = int(np.argmax(sim.ncon > room))
        raise InvalidValueError(f"row {row} has {int(sim.ncon[row])} contacts, but the task has room for {room}")
    most = int(sim.ncon.max(initial=0))
    geom1, geom2 = contact.geom1[:, :most], contact.geom2[:, :most]
    near = (np.arange(most) < sim.ncon[:, None]) & (contact.dist[:, :most] <= 0)
    first, second = geom1 == other, geom2 == other
    partner = np.where(near & (first | second), np.where(first, geom2, geom1), -1)
    return np.asarray((partner[:, :, None] == np.asarray(geoms)).any(axis=1))


def air_time(time: NDArray[np.float64], touching: NDArray[np.bool_], dt: float) -> NDArray[np.float64]:
    """Counts the time that feet have been in the air, and returns the flight times of feet that land in this step, s.

    time: (rows, feet), a part of the task's state, which is updated: 0 for a foot that touches the ground, and
    otherwise dt times the number of steps since it did. The result is 0 for a foot that does not land in this step.
    """
    flights = np.where(touching, time, 0)
    time[...] = np.where(touching, 0, time + dt)
    return flights


class Terrain:
    """A height field whose geom is fixed to the world and not rotated. A task makes it in build.

    The surface consists of the triangles with which other geoms collide. Beyond the edge, the heights are those of the
    edge. If the task writes its rows' "hfield_data" (`own`), pass sim.own["hfield_data"] as `data`; by default, the
    heights are those of the model.
    """

    def __init__(self, model: Model, geom: str) -> None:
        at = model.index("geom", geom)
        is_fixed = model.array("geom_bodyid")[at] == 0 and model.array("geom_quat")[at, 0] == 1
        if model.array("geom_type")[at] != _HEIGHT_FIELD or not is_fixed:
            raise InvalidValueError(f"geom {geom!r} is no height field that is fixed to the world and not turned")
        field = model.array("geom_dataid")[at]
        self._rows, self._columns = (int(model.array(name)[field]) for name in ("hfield_nrow", "hfield_ncol"))
        self._size, self._position = model.array("hfield_size")[field], model.array("geom_pos")[at]
        first = int(model.array("hfield_adr")[field])
        self._part = slice(first, first + self._rows * self._columns)
        self._data = model.array("hfield_data").copy()
        # What machine code computes heights from.
        self.numbers = [*map(float, (first, self._rows, self._columns, *self._size[:3], *self._position))]

    def height(self, x: ArrayLike, y: ArrayLike, data: NDArray[Any] | None = None) -> NDArray[np.float64]:
        """The heights of the surface at x and y, m; all in the world's frame.

        x, y: (rows,) or (rows, points). data: the hfield_data of one row, or of each row (rows, numbers).
        """
        numbers = (self._data if data is None else data)[..., self._part]

        def at(index: NDArray[np.int64]) -> NDArray[np.float64]:
            if numbers.ndim == 1:
                return np.asarray(numbers[index], np.float64)
            found = np.take_along_axis(numbers, index.reshape(len(numbers), -1), axis=1)
            return found.reshape(index.shape).astype(np.float64)

        column = self._cell(np.asarray(x) - self._position[0], self._size[0], self._columns)
        row = self._cell(np.asarray(y) - self._position[1], self._size[1], self._rows)
        c = np.clip(column.astype(np.int64), 0, max(self._columns - 2, 0))
        r = np.clip(row.astype(np.int64), 0, max(self._rows - 2, 0))
        u, v = column - c, row - r
        below, beside = np.minimum(r + 1, self._rows - 1) * self._columns, np.minimum(c + 1, self._columns - 1)
        near, far = at(r * self._columns + c), at(below + beside)
        # The diagonal of a cell goes from (r, c) to (r + 1, c + 1).
        corner = np.where(u >= v, at(r * self._columns + beside), at(below + c))
        along = np.where(u >= v, u * (corner - near) + v * (far - corner), v * (corner - near) + u * (far - corner))
        return np.asarray((near + along) * self._size[2] + self._position[2])

    def around(
        self, position: ArrayLike, mat: ArrayLike, points: ArrayLike, data: NDArray[Any] | None = None
    ) -> NDArray[np.float64]:
        """The heights at points around a body: (rows, points), m.

        position, mat: the body's xpos (rows, 3) and xmat (rows, 9). points: (points, 2), x and y in a frame at the body
        that is rotated by the body's yaw alone, m. data: as in height.
        """
        at, axes, (x, y) = np.asarray(position), np.asarray(mat).reshape(-1, 9), np.transpose(points)
        ahead, left = axes[:, 0], axes[:, 3]
        norm = np.sqrt(ahead * ahead + left * left)
        upright = norm > 0
        divisor = np.where(upright, norm, 1)
        cos, sin = np.where(upright, ahead / divisor, 1)[:, None], np.where(upright, left / divisor, 0)[:, None]
        return self.height(at[:, 0:1] + (cos * x - sin * y), at[:, 1:2] + (sin * x + cos * y), data)

    @staticmethod
    def _cell(x: NDArray[np.float64], radius: float, count: int) -> NDArray[np.float64]:
        return np.clip((x + radius) / (2 * radius) * (count - 1), 0.0, float(count - 1))
