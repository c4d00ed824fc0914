"""The triangles of MuJoCo's geom types, each in the frame of its geom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

# mjtGeom, which is the same in all versions.
PLANE, HFIELD, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH = range(8)
# Geoms without triangles in mjModel, such as signed distance fields, are drawn as their mesh, if they have one.
_AROUND = 24  # corners of a circle
_UP = 8  # rings of a hemisphere


@dataclass(frozen=True)
class Shape:
    """Triangles: vertices[n, 3], faces[m, 3], and if the shape can have a 2D texture, its coordinates uv[n, 2].

    A coordinate of 1 is the texture's whole width or height.
    """

    vertices: Array
    faces: Array
    uv: Array | None = None


def sphere(radii: Any) -> Shape:
    """An ellipsoid."""
    return _scaled(_round(0.0), radii)


def capsule(radius: float, half: float) -> Shape:
    shape = _round(half / radius)
    return _scaled(shape, (radius,) * 3)


def _scaled(shape: Shape, factors: Any) -> Shape:
    return Shape(shape.vertices * np.asarray(factors), shape.faces)


def _round(half: float) -> Shape:
    """A sphere of radius 1, cut in two halves that are moved apart along z."""
    latitudes = np.linspace(-np.pi / 2, np.pi / 2, 2 * _UP + 1)
    lower, upper = latitudes[: _UP + 1], latitudes[_UP:]
    around = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)
    rings = []
    for part, shift in ((lower, -half), (upper, half)):
        for latitude in part:
            ring = [np.cos(latitude) * np.cos(around), np.cos(latitude) * np.sin(around)]
            rings.append(np.stack([*ring, np.full(_AROUND, np.sin(latitude) + shift)], axis=1))
    return Shape(np.concatenate(rings), _between(len(rings)))


def _between(rings: int) -> Array:
    """The triangles between rings of vertices, one ring above the other."""
    low, here = np.meshgrid(np.arange(rings - 1), np.arange(_AROUND), indexing="ij")
    following = (here + 1) % _AROUND
    a, b = low * _AROUND + here, low * _AROUND + following
    c, d = b + _AROUND, a + _AROUND
    return np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])


def cylinder(radius: float, half: float) -> Shape:
    around = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)
    ring = np.stack([radius * np.cos(around), radius * np.sin(around), np.zeros(_AROUND)], axis=1)
    up = np.array([0, 0, half])
    low, high = ring - up, ring + up
    # The rings at the ends exist twice, because the side and the lid have different normals there.
    vertices = np.concatenate([low, high, low, high, [[0, 0, -half], [0, 0, half]]])
    here = np.arange(_AROUND)
    following = (here + 1) % _AROUND
    bottom = np.stack([np.full(_AROUND, 4 * _AROUND), 2 * _AROUND + following, 2 * _AROUND + here], axis=1)
    top = np.stack([np.full(_AROUND, 4 * _AROUND + 1), 3 * _AROUND + here, 3 * _AROUND + following], axis=1)
    return Shape(vertices, np.concatenate([_between(2), bottom, top]))


def box(half: Any) -> Shape:
    """Each side has vertices and a texture of its own."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    vertices: list[Array] = []
    faces: list[Array] = []
    for axis in range(3):
        for sign in (-1, 1):
            side = np.empty((4, 3))
            side[:, axis] = sign
            side[:, (axis + 1) % 3], side[:, (axis + 2) % 3] = corners.T
            first = 4 * len(vertices)
            order = [[0, 1, 2], [0, 2, 3]] if sign > 0 else [[0, 2, 1], [0, 3, 2]]
            vertices.append(side)
            faces.append(np.array(order) + first)
    uv = np.tile((corners + 1) / 2, (6, 1))
    return Shape(np.concatenate(vertices) * np.asarray(half), np.concatenate(faces), uv)


def plane(half_x: float, half_y: float) -> Shape:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    vertices = np.concatenate([corners * (half_x, half_y), np.zeros((4, 1))], axis=1)
    return Shape(vertices, np.array([[0, 1, 2], [0, 2, 3]]), corners * (0.5, 0.5) + 0.5)


def height_field(model: Any, number: int) -> Shape:
    """The surface of a height field, without its sides and bottom."""
    rows, columns, first = (int(getattr(model, f"hfield_{name}")[number]) for name in ("nrow", "ncol", "adr"))
    x, y, top, _ = model.hfield_size[number]
    heights = np.asarray(model.hfield_data)[first : first + rows * columns].reshape(rows, columns)
    across, along = np.meshgrid(np.linspace(-x, x, columns), np.linspace(-y, y, rows))
    vertices = np.stack([across, along, heights * top], axis=-1).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    a = (row * columns + column).reshape(-1)
    faces = np.concatenate([np.stack([a, a + 1, a + columns + 1], 1), np.stack([a, a + columns + 1, a + columns], 1)])
    return Shape(vertices, faces, vertices[:, :2] / (2 * x, 2 * y) + 0.5)


def mesh(model: Any, number: int) -> Shape:
    """A mesh. A vertex with several texture coordinates is repeated for each of them."""
    first, count = int(model.mesh_vertadr[number]), int(model.mesh_vertnum[number])
    start, length = int(model.mesh_faceadr[number]), int(model.mesh_facenum[number])
    vertices = np.asarray(model.mesh_vert)[first : first + count]
    faces = np.asarray(model.mesh_face)[start : start + length]
    place = int(model.mesh_texcoordadr[number])
    if place < 0:
        return Shape(vertices, faces)
    coordinates = np.asarray(model.mesh_texcoord)[place:]
    if hasattr(model, "mesh_facetexcoord"):  # MuJoCo 4.0: the triangles name their coordinates
        pairs = np.stack([faces.reshape(-1), np.asarray(model.mesh_facetexcoord)[start : start + length].reshape(-1)])
        unique, which = np.unique(pairs, axis=1, return_inverse=True)
        return Shape(vertices[unique[0]], which.reshape(-1, 3), coordinates[unique[1]])
    return Shape(vertices, faces, coordinates[:count])


def of_geom(model: Any, kind: int, size: Array, data: int, reach: float) -> Shape | None:
    """The shape of a geom or site; None if it has no shape. reach: half of the side of an infinite plane."""
    x, y, z = (float(number) for number in size)
    if kind == PLANE:
        return plane(x or reach, y or reach)
    if kind == HFIELD:
        return height_field(model, data)
    if kind == SPHERE:
        return sphere((x, x, x))
    if kind == CAPSULE:
        return capsule(x, y)
    if kind == ELLIPSOID:
        return sphere((x, y, z))
    if kind == CYLINDER:
        return cylinder(x, y)
    if kind == BOX:
        return box((x, y, z))
    return mesh(model, data) if data >= 0 else None


def arrow() -> Shape:
    """An arrow of length 1 and radius 1 along z, to be scaled."""
    around = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)
    ring = np.stack([np.cos(around), np.sin(around), np.zeros(_AROUND)], axis=1)
    neck, tip = np.array([0, 0, 0.75]), np.array([0, 0, 1])
    rings = [ring * 0, ring / 2, ring / 2 + neck, ring + neck, ring * 0 + tip]
    return Shape(np.concatenate(rings), _between(len(rings)))


def unit_cylinder() -> Shape:
    """A cylinder of radius 1 and length 1 that stands on the origin, to be scaled."""
    shape = cylinder(1.0, 0.5)
    return Shape(shape.vertices + np.array([0, 0, 0.5]), shape.faces)
