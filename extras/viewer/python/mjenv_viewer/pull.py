"""A body that the user pulls by a spring, as in MuJoCo's viewer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv_viewer.poses import Marks, along

Array = NDArray[Any]

_FREQUENCY = 10.0  # rad/s, the spring's frequency: MuJoCo's default stiffness is 100 for each kilogram
_LEAST_MASS = 1e-6


@dataclass
class Grip:
    row: int
    body: int
    point: Array  # the point that is held, in the body's axes
    aim: Array  # where the point is pulled to
    before: Array | None = None  # where the point was one step ago


class Pull:
    """Writes xfrc_applied of the row whose body is pulled, and zeros once it is released."""

    def __init__(self) -> None:
        self.grip: Grip | None = None
        self._written: int | None = None

    def grab(self, row: int, body: int, data: Any, point: Any, aim: Any) -> None:
        turn = np.asarray(data.xmat)[body].reshape(3, 3)
        held = turn.T @ (np.asarray(point) - np.asarray(data.xpos)[body])
        self.grip = Grip(row, body, held, np.asarray(aim, float))

    def move(self, aim: Any) -> None:
        if self.grip:
            self.grip.aim = np.asarray(aim, float)

    def release(self) -> None:
        self.grip = None

    def apply(self, rows: Any, dt: float) -> None:
        """Writes the force before a step of dt seconds, which stays the same during the step."""
        grip = self.grip
        if self._written is not None and (grip is None or grip.row != self._written):
            rows[self._written].data.xfrc_applied[...] = 0
            self._written = None
        if grip is None:
            return
        row = rows[grip.row]
        data = row.data
        point = self.point(data)
        speed = np.zeros(3) if grip.before is None else (point - grip.before) / dt
        grip.before = point
        mass = 1 / max(float(row.model.body_invweight0[grip.body][0]), _LEAST_MASS)
        frequency = min(_FREQUENCY, 0.5 / dt)  # with a stiffer spring, the oscillation would grow from step to step
        force = mass * (frequency**2 * (grip.aim - point) - 2 * frequency * speed)
        wrench = np.zeros(np.asarray(data.xfrc_applied).shape)
        wrench[grip.body] = [*force, *np.cross(point - np.asarray(data.xipos)[grip.body], force)]
        data.xfrc_applied[...] = wrench
        self._written = grip.row

    def point(self, data: Any) -> Array:
        """Where the held point is now."""
        assert self.grip
        turn = np.asarray(data.xmat)[self.grip.body].reshape(3, 3)
        held: Array = np.asarray(data.xpos)[self.grip.body] + turn @ self.grip.point
        return held

    def marks(self, data: Any, scale: float) -> Marks:
        """The spring."""
        assert self.grip
        point = self.point(data)
        vector = (self.grip.aim - point)[None]
        size = np.array([[0.02 * scale, 0.02 * scale, float(np.linalg.norm(vector))]])
        return Marks(point[None], along(vector), size, np.zeros(1, int))
