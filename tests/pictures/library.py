"""Rows and renderers through the C interface alone, for comparison with Gymnasium's."""

from __future__ import annotations

import os
from ctypes import POINTER, byref, c_double, c_float, c_uint8, c_uint64, c_void_p, sizeof
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi import declarations

LIBRARY = declarations.Library(os.environ["MJENV_LIBRARY"])

Picture = tuple[NDArray[np.uint8], NDArray[np.float32]]


def check(status: int) -> None:
    if status:
        raise RuntimeError(f"{declarations.Status(status).name}: {LIBRARY.mjenv_last_error().decode()}")


def _pointer(array: NDArray[Any], ctype: Any) -> Any:
    return array.ctypes.data_as(POINTER(ctype))


class Env:
    """An environment of one or several rows."""

    def __init__(self, id: str, rows: int = 1, **options: int) -> None:
        chosen = c_void_p()
        check(LIBRARY.mjenv_options_create(id.encode(), byref(chosen)))
        for name, value in options.items():
            check(LIBRARY.mjenv_options_set_integer(chosen, name.encode(), value))
        self.handle = c_void_p()
        check(LIBRARY.mjenv_create(chosen, rows, byref(self.handle)))
        LIBRARY.mjenv_options_destroy(chosen)
        self.rows = rows

    def close(self) -> None:
        LIBRARY.mjenv_destroy(self.handle)

    def reset(self, seed: int) -> None:
        """Row i gets seed + i."""
        check(LIBRARY.mjenv_seed(self.handle, None, (c_uint64 * self.rows)(*range(seed, seed + self.rows)), self.rows))
        check(LIBRARY.mjenv_reset(self.handle, None, None))

    def step(self, action: NDArray[np.float32]) -> None:
        action = np.ascontiguousarray(action, np.float32)
        check(LIBRARY.mjenv_step(self.handle, None, action.ctypes.data, action.size, declarations.Dtype.FLOAT32, None))

    def set_state(self, qpos: NDArray[np.float64], qvel: NDArray[np.float64]) -> None:
        arrays = (_pointer(qpos, c_double), qpos.size, _pointer(qvel, c_double), qvel.size)
        check(LIBRARY.mjenv_set_state(self.handle, 0, *arrays))


class Renderer:
    """Gymnasium's arguments by their names, default_camera_config by its keys."""

    def __init__(self, env: Env, width: int, height: int, visual_options: dict[int, bool] | None = None, **given: Any):
        settings = declarations.mjenv_render_settings(struct_size=sizeof(declarations.mjenv_render_settings))
        check(LIBRARY.mjenv_render_defaults(env.handle, byref(settings)))
        settings.width, settings.height = width, height
        for name, value in given.items():
            setattr(settings, name, tuple(value) if name == "lookat" else value)
        for flag, value in (visual_options or {}).items():
            settings.visual[flag] = value
        self.handle = c_void_p()
        check(LIBRARY.mjenv_renderer_create(env.handle, byref(settings), byref(self.handle)))
        self.shape = (height, width)

    def close(self) -> None:
        LIBRARY.mjenv_renderer_destroy(self.handle)

    def colours(self, row: int = 0) -> NDArray[np.uint8]:
        rgb = np.empty((*self.shape, 3), np.uint8)
        check(LIBRARY.mjenv_render(self.handle, row, _pointer(rgb, c_uint8), rgb.size, None, 0))
        return rgb

    def render(self, row: int = 0) -> Picture:
        rgb, depth = np.empty((*self.shape, 3), np.uint8), np.empty(self.shape, np.float32)
        colours = (_pointer(rgb, c_uint8), rgb.size)
        check(LIBRARY.mjenv_render(self.handle, row, *colours, _pointer(depth, c_float), depth.size))
        return rgb, depth
