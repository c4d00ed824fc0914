"""What changes from picture to picture: the poses of geoms and sites, and the marks of MuJoCo's switches."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

_PULLEY = -2  # in wrap_obj


@dataclass(frozen=True)
class Pose:
    """A row at one moment."""

    position: dict[str, Array]  # by kind, "geom" or "site": [n, 3]
    turn: dict[str, Array]  # quaternions [n, 4]
    root: Array  # where the robot is
    marks: dict[str, Marks] = field(default_factory=dict)


@dataclass(frozen=True)
class Marks:
    """Cylinders, arrows or balls: their origins, orientations, and sizes along their own axes."""

    position: Array
    turn: Array
    size: Array
    group: Array


def quaternions(matrices: Array) -> Array:
    """Rotation matrices [n, 9] as quaternions [n, 4], by the formula that divides by the greatest component."""
    m = np.asarray(matrices).reshape(-1, 3, 3)
    xx, yy, zz = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    squares = np.stack([1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz], axis=1)
    a, b, c = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    d, e, f = m[:, 1, 0] + m[:, 0, 1], m[:, 0, 2] + m[:, 2, 0], m[:, 2, 1] + m[:, 1, 2]
    w, x, y, z = squares.T
    choices = np.stack([np.stack(q, 1) for q in ((w, a, b, c), (a, x, d, e), (b, d, y, f), (c, e, f, z))], axis=1)
    chosen: Array = choices[np.arange(len(m)), squares.argmax(axis=1)]
    unit: Array = chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
    return unit


def along(directions: Array) -> Array:
    """The quaternions that rotate the z-axis to these directions [n, 3], which can have any length."""
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    unit = np.where(lengths > 1e-12, directions / np.maximum(lengths, 1e-12), (0.0, 0.0, 1.0))
    found = np.stack([1 + unit[:, 2], -unit[:, 1], unit[:, 0], np.zeros(len(unit))], axis=1)
    found[unit[:, 2] < -1 + 1e-9] = (0, 1, 0, 0)
    turned: Array = found / np.linalg.norm(found, axis=1, keepdims=True)
    return turned


def pose_of(data: Any, root: int, sites: bool) -> Pose:
    """The poses of a row's geoms and sites."""
    position, turn = {"geom": np.asarray(data.geom_xpos)}, {"geom": quaternions(data.geom_xmat)}
    if sites:
        position["site"], turn["site"] = np.asarray(data.site_xpos), quaternions(data.site_xmat)
    return Pose(position, turn, np.asarray(data.xpos)[root])


# ---- MuJoCo's switches. Each gives the marks of one row. ----


def tendons(model: Any, data: Any) -> Marks:
    """The path of each tendon, as straight lines between its points."""
    points = np.asarray(data.wrap_xpos).reshape(-1, 3)
    objects = np.asarray(data.wrap_obj).reshape(-1)
    begins: list[int] = []
    owners: list[int] = []
    for tendon, (first, count) in enumerate(zip(data.ten_wrapadr, data.ten_wrapnum, strict=True)):
        for place in range(int(first), int(first) + int(count) - 1):
            if objects[place] != _PULLEY and objects[place + 1] != _PULLEY:
                begins.append(place)
                owners.append(tendon)
    begin = np.array(begins, int)
    vectors = points[begin + 1] - points[begin] if begins else np.zeros((0, 3))
    width = np.asarray(model.tendon_width)[owners]
    size = np.stack([width, width, np.linalg.norm(vectors, axis=1)], axis=1)
    return Marks(points[begin], along(vectors), size, np.asarray(model.tendon_group)[owners])


def joints(model: Any, data: Any, scale: float) -> Marks:
    """An arrow along the axis of each hinge and slide."""
    chosen = np.flatnonzero(np.asarray(model.jnt_type) >= 2)  # mjJNT_FREE and mjJNT_BALL have no axis
    axes = np.asarray(data.xaxis)[chosen]
    size = np.tile([0.06 * scale, 0.06 * scale, 0.6 * scale], (len(chosen), 1))
    return Marks(np.asarray(data.xanchor)[chosen], along(axes), size, np.asarray(model.jnt_group)[chosen])


def centres_of_mass(model: Any, data: Any, scale: float) -> Marks:
    """A ball at the centre of mass of each tree of bodies, that is, of each robot."""
    bodies = np.arange(model.nbody)
    chosen = bodies[(np.asarray(model.body_rootid) == bodies) & (bodies > 0)]
    position = np.asarray(data.subtree_com)[chosen]
    turn = np.tile([1.0, 0, 0, 0], (len(chosen), 1))
    return Marks(position, turn, np.full((len(chosen), 3), 0.1 * scale), np.zeros(len(chosen), int))


def contacts(data: Any, scale: float) -> Marks:
    """A disc at each contact, across its normal."""
    contact = data.contact
    position, normal = np.asarray(contact.pos).reshape(-1, 3), np.asarray(contact.frame).reshape(-1, 9)[:, :3]
    size = np.tile([0.12 * scale, 0.12 * scale, 0.03 * scale], (len(position), 1))
    return Marks(position, along(normal), size, np.zeros(len(position), int))


def contact_forces(model: Any, data: Any, scale: float) -> Marks:
    """An arrow for the force of each contact. A force as great as the robot's weight is 2 * scale long."""
    position, force = forces_of(data)
    weight = max(float(np.sum(model.body_mass)) * max(float(np.linalg.norm(model.opt.gravity)), 1e-6), 1e-9)
    length = np.minimum(np.linalg.norm(force, axis=1) / weight * 2 * scale, 4 * scale)
    size = np.stack([np.full(len(length), 0.06 * scale) * (length > 0), np.full(len(length), 0.06 * scale), length], 1)
    return Marks(position, along(force), size, np.zeros(len(position), int))


def forces_of(data: Any) -> tuple[Array, Array]:
    """The places of the contacts, and the force of each in the world's axes."""
    contact = data.contact
    frames, force = np.asarray(contact.frame).reshape(-1, 3, 3), np.asarray(contact.force)[:, :3]
    return np.asarray(contact.pos), np.einsum("nij,ni->nj", frames, force)
