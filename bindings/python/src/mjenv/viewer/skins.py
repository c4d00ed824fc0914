"""The vertices of skins, which bones move."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def _matrix(quaternion: Array) -> Array:
    w, x, y, z = (float(part) for part in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def skins_of(row: Any, offset: Array) -> list[tuple[Array, Array, Array]]:
    """For each skin of a row in the shown groups: its vertices, its faces and its colour. As in MuJoCo, a vertex is the
    weighted mean of where its bones carry it."""
    model, data = row.model, row.data
    positions, turns = np.asarray(data.xpos), np.asarray(data.xmat).reshape(-1, 3, 3)
    found = []
    for skin in range(int(model.nskin)):
        first, count = int(model.skin_vertadr[skin]), int(model.skin_vertnum[skin])
        start, length = int(model.skin_faceadr[skin]), int(model.skin_facenum[skin])
        rest = np.asarray(model.skin_vert)[first : first + count].astype(float)
        vertices, weights = np.zeros((count, 3)), np.zeros((count, 1))
        bones = int(model.skin_boneadr[skin])
        for bone in range(bones, bones + int(model.skin_bonenum[skin])):
            body = int(model.skin_bonebodyid[bone])
            begin = int(model.skin_bonevertadr[bone])
            end = begin + int(model.skin_bonevertnum[bone])
            which = np.asarray(model.skin_bonevertid)[begin:end]
            weight = np.asarray(model.skin_bonevertweight)[begin:end, None]
            turn = turns[body] @ _matrix(np.asarray(model.skin_bonebindquat)[bone]).T
            moved = (rest[which] - np.asarray(model.skin_bonebindpos)[bone]) @ turn.T + positions[body]
            vertices[which] += weight * moved
            weights[which] += weight
        faces = np.asarray(model.skin_face)[start : start + length]
        found.append((vertices / np.maximum(weights, 1e-12) + offset, faces, np.asarray(model.skin_rgba)[skin]))
    return found
