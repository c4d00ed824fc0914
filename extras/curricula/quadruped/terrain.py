"""Draws the heights of the rough ground as terrain.png: python terrain.py

The ground is a table of patches of 6 m by 6 m. From left to right the levels become harder; each of the three rows has
one type of ground: bumps, steps and waves.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

HERE = Path(__file__).resolve().parent
LEVELS, TYPES, CELLS = 6, 3, 60  # patches, and cells of 0.1 m along the side of a patch
HEIGHT = 0.25  # m, of the brightest cell


def smooth(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """The means of each cell and its neighbours."""
    padded = np.pad(heights, 1, mode="edge")
    return np.asarray(sum(padded[i : i + CELLS, j : j + CELLS] for i in range(3) for j in range(3)) / 9)


def patch(kind: int, hardness: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """The heights of one patch in metres. hardness: 0 to 1."""
    if kind == 0:
        return 0.18 * hardness * smooth(rng.uniform(0, 1, (CELLS, CELLS)))
    if kind == 1:
        tiles = rng.uniform(0, 0.07 * hardness, (CELLS // 6, CELLS // 6))
        return np.kron(tiles, np.ones((6, 6)))
    along, across = np.meshgrid(np.arange(CELLS), np.arange(CELLS))
    waves = np.sin(along * (2 * np.pi / 30)) + np.sin(across * (2 * np.pi / 20))
    return 0.045 * hardness * (waves + 2)


def heights() -> NDArray[np.float64]:
    """The heights of the whole ground in metres. The first row has the least y."""
    rng = np.random.default_rng(0)
    rows = [
        np.concatenate([patch(kind, level / (LEVELS - 1), rng) for level in range(LEVELS)], axis=1)
        for kind in range(TYPES)
    ]
    ground = np.concatenate(rows, axis=0)
    ground[0, 0], ground[-1, -1] = 0, HEIGHT  # because MuJoCo scales heights to 0 to 1
    return ground


def png(pixels: NDArray[np.uint8]) -> bytes:
    """A grey picture with 8 bits for each pixel."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    lines = b"".join(b"\0" + line.tobytes() for line in pixels)
    header = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines, 9)) + chunk(b"IEND", b"")


def picture() -> bytes:
    pixels = np.round(heights() * (255 / HEIGHT)).astype(np.uint8)
    return png(pixels[::-1])  # MuJoCo's pictures begin with the greatest y


if __name__ == "__main__":
    (HERE / "terrain.png").write_bytes(picture())
