"""Poses between two poses, for steps that are longer than the time from picture to picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv_viewer.poses import Pose

Array = NDArray[Any]


def between(first: Pose, last: Pose, place: float) -> Pose:
    """The pose at a place from 0 (first) to 1 (last). Contacts and other marks are those of the last pose."""
    if first.position.keys() != last.position.keys():  # something was switched on or off in between
        return last
    position = {kind: (1 - place) * first.position[kind] + place * found for kind, found in last.position.items()}
    turn = {kind: _turned(first.turn[kind], found, place) for kind, found in last.turn.items()}
    return Pose(position, turn, (1 - place) * first.root + place * last.root, last.marks)


def _turned(first: Array, last: Array, place: float) -> Array:
    """Quaternions between two, on the shorter way: q and -q are the same rotation, and the nearer one is taken."""
    sign = np.where(np.sum(first * last, axis=1, keepdims=True) < 0, -1.0, 1.0)
    mixed: Array = (1 - place) * sign * first + place * last
    unit: Array = mixed / np.maximum(np.linalg.norm(mixed, axis=1, keepdims=True), 1e-12)
    return unit
