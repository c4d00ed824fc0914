"""For Jupyter: shows the viewer in a frame, and environments as a picture with their spaces and options."""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np
from gymnasium.spaces import Dict
from numpy.typing import NDArray

import mjenv
from mjenv_viewer.parts import observation_parts
from mjenv_viewer.picture import rows_of

Array = NDArray[Any]

_SIZE = 200  # pixels
# Keywords of make that a picture of one row must not have.
_LEFT_OUT = ("autoreset_mode", "copy", "dtype", "num_envs", "num_threads", "render_mode", "vectorization_mode")


def frame(address: str, height: int = 600) -> str:
    """The page at an address."""
    return f'<iframe src="{escape(address)}" width="100%" height="{height}" style="border: 0"></iframe>'


def _box(space: Any) -> str:
    if isinstance(space, Dict):
        return ", ".join(f"{name}: {_box(part)}" for name, part in space.items())
    return f"Box {space.shape} {space.dtype}"


def html_of(env: Any) -> str:
    """Describes an environment: its id, a picture of its first row if there is OpenGL, its spaces and its options."""
    row = rows_of(env)[0]
    id = env.spec.id
    chosen = {name: value for name, value in env.spec.kwargs.items() if name not in _LEFT_OUT}
    spaces = [("actions", getattr(env, "single_action_space", env.action_space))]
    spaces += [("observations", getattr(env, "single_observation_space", env.observation_space))]
    lines = [("engine", f"MuJoCo {env.engine}"), ("step", f"{row.dt:g} s")]
    if hasattr(env, "num_envs"):
        lines.insert(0, ("rows", str(env.num_envs)))
    lines += [(name, _box(space)) for name, space in spaces]
    parts = ", ".join(f"{name} [{place.start}:{place.stop}]" for name, place in observation_parts(row).items())
    lines += [("observation", parts)]
    schema = mjenv.options(id, env.engine)
    lines += [(name, _short(chosen[name])) for name in schema if name in chosen]
    defaults = [(name, _short(option.default)) for name, option in schema.items() if name not in chosen]
    options = f"<details><summary>Options with their defaults</summary>{_table(defaults)}</details>"
    image = _image(row, id, chosen)
    picture = f'<img width="{_SIZE}" height="{_SIZE}" alt="" src="data:image/png;base64,{image}">' if image else ""
    left, right = f"<b>{escape(id)}</b><br>{picture}", f"{_table(lines)}{options}"
    return f'<div style="display: flex; gap: 1em"><div>{left}</div><div>{right}</div></div>'


def _table(lines: Sequence[tuple[str, str]]) -> str:
    return (
        f"<table>{''.join(f'<tr><td>{escape(name)}</td><td>{escape(text)}</td></tr>' for name, text in lines)}</table>"
    )


def _short(value: Any) -> str:
    return str(value) if len(str(value)) < 60 else str(value)[:57] + "..."


def _image(row: Any, id: str, chosen: dict[str, Any]) -> str | None:
    """A picture of the row, drawn by a copy so that this environment keeps its state; None without OpenGL."""
    try:
        settings = {"render_mode": "rgb_array", "width": _SIZE, "height": _SIZE}
        other = mjenv.make(id, **{**chosen, **settings, "engine": row.engine})
        try:
            other.reset(seed=0)
            other.set_state(row.data.qpos, row.data.qvel)
            return base64.b64encode(_png(other.render())).decode()  # type: ignore[arg-type]
        finally:
            other.close()
    except (mjenv.Error, OSError):
        return None


def _png(pixels: Array) -> bytes:
    """uint8[height, width, 3] as a PNG, without a package for pictures."""
    height, width, _ = pixels.shape
    lines = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], axis=1)

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(lines.tobytes()))
        + chunk(b"IEND", b"")
    )
