"""Writes the pictures of an environment as a video."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mjenv.gym.env import Environment

GIF_RATE = 30  # pictures per second at most, because viewers play faster animations too slowly


class Mp4:
    """A video at the speed of the simulation. Needs imageio and imageio-ffmpeg."""

    def __init__(self, path: Path, rate: int) -> None:
        import imageio.v2  # type: ignore[import-not-found, unused-ignore]

        # The encoding of colours needs even sizes, to which imageio rescales the pictures.
        self._writer: Any = imageio.v2.get_writer(path, format="FFMPEG", fps=rate, macro_block_size=2)

    def add(self, env: Environment) -> None:
        self._writer.append_data(env.render())

    def close(self) -> None:
        self._writer.close()


class Gif:
    """An animation at the speed of the simulation, with at most GIF_RATE pictures per second. Needs imageio."""

    def __init__(self, path: Path, rate: int) -> None:
        import imageio.v2

        self._every, self._count = math.ceil(rate / GIF_RATE), 0
        self._writer: Any = imageio.v2.get_writer(path, mode="I", duration=1000 * self._every / rate, loop=0)

    def add(self, env: Environment) -> None:
        if self._count % self._every == 0:
            self._writer.append_data(env.render())
        self._count += 1

    def close(self) -> None:
        self._writer.close()
