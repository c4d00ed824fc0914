"""The vertices of skins, which bodies move as their bones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv_viewer.scene import GROUPS, OWN_COLOUR

Array = NDArray[Any]


@dataclass(frozen=True)
class Bone:
    body: int
    position: Array  # of the body when the skin was bound to it
    turn: Array  # its rotation matrix then
    vertices: Array  # the numbers of those that it moves
    weights: Array  # [n, 1]


@dataclass(frozen=True)
class Skin:
    group: int
    colour: Array  # RGBA
    rest: Array  # the vertices [n, 3] when the skin was bound
    faces: Array  # [m, 3]
    inflate: float  # how far the vertices are moved along their normals
    bones: tuple[Bone, ...]

    def vertices(self, positions: Array, turns: Array) -> Array:
        """The vertices as in MuJoCo: each is the weighted mean of the points to which its bones carry it.

        positions[nbody, 3], turns[nbody, 3, 3]: the positions and rotation matrices of the bodies.
        """
        found, weights = np.zeros(self.rest.shape), np.zeros((len(self.rest), 1))
        for bone in self.bones:
            turn = turns[bone.body] @ bone.turn.T
            moved = (self.rest[bone.vertices] - bone.position) @ turn.T + positions[bone.body]
            np.add.at(found, bone.vertices, bone.weights * moved)
            np.add.at(weights, bone.vertices, bone.weights)
        found /= np.maximum(weights, 1e-12)
        return found + self.inflate * self._normals(found) if self.inflate else found

    def _normals(self, vertices: Array) -> Array:
        a, b, c = (vertices[self.faces[:, corner]] for corner in range(3))
        of_faces = np.cross(b - a, c - a)
        total = np.zeros(vertices.shape)
        for corner in range(3):
            np.add.at(total, self.faces[:, corner], of_faces)
        unit: Array = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
        return unit


def skins_of(model: Any) -> tuple[Skin, ...]:
    """The skins of a model."""

    def part(kind: str, skin: int) -> slice:
        first = int(getattr(model, f"skin_{kind}adr")[skin])
        return slice(first, first + int(getattr(model, f"skin_{kind}num")[skin]))

    def bone(number: int) -> Bone:
        first = int(model.skin_bonevertadr[number])
        chosen = slice(first, first + int(model.skin_bonevertnum[number]))
        return Bone(
            int(model.skin_bonebodyid[number]),
            np.asarray(model.skin_bonebindpos)[number].astype(float),
            _matrix(np.asarray(model.skin_bonebindquat)[number]),
            np.asarray(model.skin_bonevertid)[chosen],
            np.asarray(model.skin_bonevertweight)[chosen, None].astype(float),
        )

    def skin(number: int) -> Skin:
        colour, material = np.asarray(model.skin_rgba)[number], int(model.skin_matid[number])
        if material >= 0 and tuple(colour) == OWN_COLOUR:
            colour = np.asarray(model.mat_rgba)[material]
        bones = part("bone", number)
        return Skin(
            min(max(int(model.skin_group[number]), 0), GROUPS - 1),
            colour,
            np.asarray(model.skin_vert)[part("vert", number)].astype(float),
            np.asarray(model.skin_face)[part("face", number)],
            float(model.skin_inflate[number]),
            tuple(bone(each) for each in range(bones.start, bones.stop)),
        )

    return tuple(skin(number) for number in range(int(model.nskin)))


def _matrix(quaternion: Array) -> Array:
    w, x, y, z = (float(part) for part in quaternion / np.linalg.norm(quaternion))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
