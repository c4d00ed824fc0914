"""A model as sets of equal shapes, each of which a viewer draws at many places at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv_viewer import shapes
from mjenv_viewer.shapes import Shape

Array = NDArray[Any]

GROUPS = 6  # mjNGROUP; greater numbers count as the last
OWN_COLOUR = (0.5, 0.5, 0.5, 1)  # MuJoCo's default colour; a geom that has it takes the colour of its material
_CUBE, _SKYBOX = 1, 2  # mjtTexture; 0 is 2D


@dataclass(frozen=True)
class Texture:
    pixels: Array  # uint8[height, width, 3 or 4]
    is_cube: bool
    repeat: tuple[float, float]
    is_uniform: bool  # whether the texture repeats for each unit of length, and not for each object


@dataclass(frozen=True)
class Look:
    """How a surface looks."""

    colour: tuple[float, float, float, float]
    texture: Texture | None
    shininess: float
    specular: float
    emission: float


@dataclass(frozen=True)
class Batch:
    """Objects of one kind ("geom" or "site") and group that have the same shape and look."""

    kind: str
    group: int
    shape: Shape
    look: Look
    objects: Array  # their numbers
    bodies: Array  # the body of each
    is_floor: bool  # a plane of the world, which all rows share


@dataclass(frozen=True)
class Scene:
    batches: tuple[Batch, ...]
    bodies: tuple[str, ...]  # their names, "" where they have none
    radius: float  # of the robot about the first body that moves, in metres


def scene_of(model: Any, data: Any) -> Scene:
    """Reads the arrays of a model. data: of a state that shows the whole robot."""
    names = tuple(str(model.body(body).name) for body in range(model.nbody))
    radius = _radius(model, data)
    batches = [*_batches(model, "geom", radius), *_batches(model, "site", radius)]
    return Scene(tuple(batches), names, radius)


def _radius(model: Any, data: Any) -> float:
    moves = np.flatnonzero(np.asarray(model.body_weldid) > 0)
    geoms = np.flatnonzero(np.isin(model.geom_bodyid, moves) & (np.asarray(model.geom_rbound) > 0))
    if not geoms.size:
        return max(float(model.stat.extent), 0.5)
    away = np.asarray(data.geom_xpos)[geoms] - np.asarray(data.xpos)[moves[0]]
    radius = float(np.max(np.linalg.norm(away, axis=1) + np.asarray(model.geom_rbound)[geoms]))
    extent = float(model.stat.extent)
    return radius if radius > extent / 20 else extent / 3  # so that a point mass is shown with its surroundings


def _batches(model: Any, kind: str, radius: float) -> list[Batch]:
    """Groups objects that are drawn in the same way."""
    count = int(getattr(model, f"n{kind}"))
    types, sizes, groups, materials, colours, owners = (
        np.asarray(getattr(model, f"{kind}_{name}")) for name in ("type", "size", "group", "matid", "rgba", "bodyid")
    )
    data = np.asarray(model.geom_dataid) if kind == "geom" else np.full(count, -1)
    found: dict[tuple[Any, ...], list[int]] = {}
    for number in range(count):
        colour = colours[number]
        material = int(materials[number])
        if material >= 0 and tuple(colour) == OWN_COLOUR:
            colour = np.asarray(model.mat_rgba)[material]
        if colour[3] <= 0:
            continue
        group = min(max(int(groups[number]), 0), GROUPS - 1)
        world = bool(owners[number] == 0 and types[number] == shapes.PLANE)
        key = (group, int(types[number]), *sizes[number], int(data[number]), material, *map(float, colour), world)
        found.setdefault(key, []).append(number)
    looks: dict[int, Texture | None] = {}
    batches = []
    for key, numbers in found.items():
        group, geom_type, x, y, z, mesh, material, red, green, blue, alpha, world = key
        reach = max(20.0, 20 * radius)
        shape = shapes.of_geom(model, geom_type, np.array([x, y, z]), mesh, reach)
        if shape is None or not len(shape.faces):
            continue
        if material not in looks:
            looks[material] = texture_of(model, material)
        shine = [
            float(getattr(model, f"mat_{name}")[material]) if material >= 0 else default for name, default in _SHINE
        ]
        look = Look((red, green, blue, alpha), looks[material], *shine)
        objects = np.array(numbers)
        batches.append(Batch(kind, group, shape, look, objects, owners[objects], world))
    return batches


# The numbers of materials, and MuJoCo's defaults for objects without a material.
_SHINE = (("shininess", 0.5), ("specular", 0.5), ("emission", 0.0))


def texture_of(model: Any, material: int) -> Texture | None:
    """The texture of a material."""
    if material < 0:
        return None
    # MuJoCo 4.0 has several textures for a material: the second one has the colours.
    chosen = np.atleast_1d(np.asarray(model.mat_texid)[material])
    number = int(chosen[1] if chosen.size > 1 else chosen[0])
    if number < 0 or int(model.tex_type[number]) == _SKYBOX:
        return None
    width, height = int(model.tex_width[number]), int(model.tex_height[number])
    channels = int(model.tex_nchannel[number]) if hasattr(model, "tex_nchannel") else 3
    if channels not in (3, 4):
        return None
    first = int(model.tex_adr[number])
    bytes_ = np.asarray(model.tex_data if hasattr(model, "tex_data") else model.tex_rgb)
    pixels = bytes_[first : first + width * height * channels].reshape(height, width, channels).astype(np.uint8)
    across, along = (float(number) for number in model.mat_texrepeat[material])
    is_cube = int(model.tex_type[number]) == _CUBE
    return Texture(pixels, is_cube, (across, along), bool(model.mat_texuniform[material]))


def cube_colours(texture: Texture, vertices: Array) -> Array:
    """The colour that a cube texture has in the direction of each vertex: uint8[n, 3]."""
    side = texture.pixels.shape[1]
    x, y, z = vertices.T
    magnitudes = np.abs(vertices)
    axis = magnitudes.argmax(axis=1)
    # The sides are, from the top, those of +x, -x, +y, -y, +z and -z; u and v are OpenGL's.
    positive = vertices[np.arange(len(vertices)), axis] >= 0
    signs = np.where(positive, 1, -1)
    u = np.select([axis == 0, axis == 1], [-signs * z, x], signs * x)
    v = np.select([axis == 0, axis == 1], [-y, signs * z], -y)
    longest = np.maximum(magnitudes.max(axis=1), 1e-12)
    sides = texture.pixels.shape[0] // side
    face = (2 * axis + ~positive) % max(sides, 1)
    column = (((u / longest + 1) / 2) * (side - 1)).astype(int)
    row = (((v / longest + 1) / 2) * (side - 1)).astype(int) + face * side
    return texture.pixels[row, column, :3]
