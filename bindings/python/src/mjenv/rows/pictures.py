"""What render() returns: pictures of rows, by Gymnasium's keywords for rendering, and render_fast."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from ctypes import byref, c_float, c_int32, c_uint8, c_void_p
from typing import Any, get_args

import gymnasium
import numpy as np
from numpy.typing import NDArray

from mjenv.capi import declarations
from mjenv.capi.declarations import Status
from mjenv.capi.engine import Engine
from mjenv.capi.handle import Rows, _struct, camera_config, pointer_to
from mjenv.capi.keywords import Groups, Rendering, RenderMode
from mjenv.capi.owned import Owned
from mjenv.errors import InvalidValueError, OptionError, RenderSettingError, UnknownNameError

Colours = NDArray[np.uint8]
Depth = NDArray[np.float32]
Picture = Colours | Depth | tuple[Colours, Depth]

RENDER_MODES: tuple[str, ...] = get_args(RenderMode)
SIZE = 480  # Gymnasium's default, pixels
MAX_GEOM = 1000  # Gymnasium's default
# default_camera_config is missing here, because some ids refuse it: see rendering_of.
_KEYWORDS = tuple(name for name in Rendering.__annotations__ if name != "default_camera_config")
GROUPS = tuple(name for name in Rendering.__annotations__ if name.endswith("group"))  # of mjvOption, too
_FREE = declarations.CAMERA_FREE
# The camera that draws if no camera is named: the free one, and in Gymnasium before 1.4 the model's camera "track".
_UNNAMED = "track" if tuple(map(int, gymnasium.__version__.split(".")[:2])) < (1, 4) else None
# The library's flag for each value of mjtVisFlag, for engines whose values differ from the library's. MuJoCo 4.0 has
# inserted islands (15).
_FLAGS: dict[str, tuple[declarations.Visual | None, ...]] = {
    "4.0": (*tuple(declarations.Visual)[:15], None, *tuple(declarations.Visual)[15:])
}
# The ids whose classes in Gymnasium do not take default_camera_config.
_WITHOUT_CONFIG = (
    "Ant-v4 HalfCheetah-v4 Hopper-v4 Humanoid-v4 HumanoidStandup-v4 InvertedDoublePendulum-v4 InvertedPendulum-v4 "
    "Pusher-v4 Reacher-v4 Walker2d-v4"
).split()
_NUMBERS = ("distance", "azimuth", "elevation")
_WITHOUT_EFFECT = ("trackbodyid", "type", "fixedcamid")


def visual_flags(engine: Engine) -> tuple[declarations.Visual | None, ...]:
    """The library's flag for each value of the engine's mjtVisFlag; None for flags that the library does not draw."""
    return _FLAGS.get(engine.name, tuple(declarations.Visual))


class Pictures:
    """Draws the rows of a handle as Gymnasium's MujocoRenderer does. Pickling keeps the keywords."""

    def __init__(
        self,
        rows: Rows,
        render_mode: str | None = None,
        width: int = SIZE,
        height: int = SIZE,
        camera_id: int | None = None,
        camera_name: str | None = None,
        max_geom: int = MAX_GEOM,
        visual_options: Mapping[int, bool] | None = None,
        render_fast: bool = False,
        default_camera_config: Mapping[str, Any] | None = None,
        **groups: Groups | None,
    ) -> None:
        """Checks what Gymnasium checks at construction. The first picture loads OpenGL."""
        if render_mode is not None and not isinstance(render_mode, str):
            raise OptionError(f"render_mode is a str, not {render_mode!r}", Status.E_TYPE)
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise InvalidValueError(f"render_mode is one of {', '.join(RENDER_MODES)}, not {render_mode!r}")
        if camera_id is not None and camera_name is not None:
            raise InvalidValueError("camera_id and camera_name exclude each other")
        if camera_name is not None and not isinstance(camera_name, str):
            raise OptionError(f"camera_name is a str, not {camera_name!r}", Status.E_TYPE)
        self.mode, self.width, self.height = render_mode, _int32("width", width), _int32("height", height)
        self.max_geom = _int32("max_geom", max_geom)
        self.camera_id = None if camera_id is None else _int32("camera_id", camera_id)
        self.camera_name, self.visual_options, self.camera_config = camera_name, visual_options, default_camera_config
        self.fast, self.groups = bool(render_fast), groups
        self._rows = rows
        self._camera: int | None = None
        self._renderers: dict[int, Renderer] = {}
        self._windows: dict[int, _Window] = {}

    def draw(self, row: int = 0) -> Picture | None:
        """The picture of a row in new arrays: rgb[height, width, 3], depth[height, width], or both.

        In the mode "human", the row's window shows the picture, and the function returns None.
        """
        if self.mode is None:
            known = ", ".join(RENDER_MODES)
            raise RenderSettingError(f"the environment was made with render_mode None; render() needs one of {known}")
        if self.mode == "human":
            self._show(row)
            return None
        return self._picture(row)

    def _show(self, row: int) -> None:
        with self._rows.changing():
            if row not in self._windows:
                env = self._rows.pointer
                self._windows[row] = _Window(self._rows.engine, env, self.settings(env, _FREE))
            self._windows[row].draw(row)

    def _picture(self, row: int) -> Picture:
        if self._camera is None:
            self._camera = self._find_camera()
        # A row needs its own renderer if a free camera without "lookat" looks at what it sees first in that row.
        looks_once = self._camera == _FREE and "lookat" not in (self.camera_config or {})
        place = row if looks_once else 0
        with self._rows.changing():
            if place not in self._renderers:
                env = self._rows.pointer
                settings = self.settings(env, self._camera)
                self._renderers[place] = Renderer(self._rows.engine, env, settings)
            rgb = None if self.mode == "depth_array" else np.empty((self.height, self.width, 3), np.uint8)
            depth = None if self.mode == "rgb_array" else np.empty((self.height, self.width), np.float32)
            self._renderers[place].draw(row, rgb, depth)
        if rgb is None:
            assert depth is not None
            return depth
        return rgb if depth is None else (rgb, depth)

    def close(self) -> None:
        """Frees the renderers and windows. The next picture makes new ones."""
        for owned in (self._renderers, self._windows):
            owned.clear()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_renderers": {}, "_windows": {}}

    def _find_camera(self) -> int:
        """The index of the camera. As in Gymnasium, a name that the model lacks means the free camera."""
        if self.camera_id is not None:
            return self.camera_id
        name = _UNNAMED if self.camera_name is None else self.camera_name
        if name is None:
            return _FREE
        try:
            return self._rows.object_index("camera", name)
        except UnknownNameError:
            return _FREE

    def settings(self, env: int, camera: int) -> Any:
        """The mjenv_render_settings of an environment's pointer and a camera."""
        settings = _struct(declarations.mjenv_render_settings)
        self._rows.check(self._rows.engine.mjenv_render_defaults(env, byref(settings)))
        if camera < _FREE:
            raise InvalidValueError(f"camera_id is {camera}; -1 is the free camera", Status.E_VALUE)
        settings.width, settings.height, settings.max_geom = self.width, self.height, self.max_geom
        settings.camera = camera
        if self.fast:
            settings.samples, settings.shadows = 0, 0
        self._place_camera(settings)
        flags = visual_flags(self._rows.engine)
        for flag, value in (self.visual_options or {}).items():
            index = _key("visual_options", "flag", flag, len(flags))
            if flags[index] is None:
                raise UnknownNameError(f"visual_options has the flag {index}, which mjenv does not draw", Status.E_NAME)
            settings.visual[flags[index]] = bool(value)
        for name, shown in self.groups.items():
            _show_groups(name, getattr(settings, name), {} if shown is None else shown)
        return settings

    def _place_camera(self, settings: Any) -> None:
        """Sets the free camera by default_camera_config. Missing keys have MuJoCo's defaults, not those of the id."""
        config = dict(self.camera_config or {})
        lookat = config.pop("lookat", None)
        settings.lookat[:] = [np.nan] * 3 if lookat is None else _finite("lookat", lookat, 3)
        for name in _NUMBERS:
            setattr(settings, name, _finite(name, config.pop(name), 1)[0] if name in config else np.nan)
        for name in _WITHOUT_EFFECT:
            _index(name, config.pop(name, 0))
        if config:
            known = ", ".join(("lookat", *_NUMBERS, *_WITHOUT_EFFECT))
            raise RenderSettingError(f"default_camera_config has the key {next(iter(config))!r}; a camera has {known}")


class _Drawing:
    """The owner of a handle that draws: an mjenv_renderer, or another kind."""

    _kind = "renderer"

    def __init__(self, engine: Engine, env: int, settings: Any) -> None:
        create, destroy = (getattr(engine, f"mjenv_{self._kind}_{verb}") for verb in ("create", "destroy"))
        handle = c_void_p()
        self._owned = Owned(destroy, handle)
        engine.check(create(env, byref(settings), byref(handle)))
        self._engine, self._pointer = engine, handle.value


class Renderer(_Drawing):
    def draw(self, row: int, rgb: Colours | None, depth: Depth | None) -> None:
        colours = (None, 0) if rgb is None else (pointer_to(rgb, c_uint8), rgb.size)
        depths = (None, 0) if depth is None else (pointer_to(depth, c_float), depth.size)
        self._engine.check(self._engine.mjenv_render(self._pointer, row, *colours, *depths))

    def draw_segmentation(self, row: int, objects: NDArray[np.int32]) -> None:
        """Writes the index and the mjtObj of the object that each pixel shows to objects[height, width, 2]."""
        pixels = pointer_to(objects, c_int32)
        self._engine.check(self._engine.mjenv_render_segmentation(self._pointer, row, pixels, objects.size))


class _Window(_Drawing):
    _kind = "window"

    def draw(self, row: int) -> None:
        self._engine.check(self._engine.mjenv_window_draw(self._pointer, row))


def rendering_of(engine: Engine, id: str, options: dict[str, Any]) -> dict[str, Any]:
    """The arguments of Pictures, which it removes from the options.

    It leaves default_camera_config if Gymnasium's class of the id lacks it, which is then refused as an unknown option.
    """
    config = camera_config(engine, id)
    if id not in _WITHOUT_CONFIG:
        config = options.pop("default_camera_config", config)
    given = {name: options.pop(name) for name in _KEYWORDS if name in options}
    return {**given, "default_camera_config": config}


def _show_groups(name: str, flags: Any, given: Groups) -> None:
    """Sets the flags of the groups that a mapping names, or of all groups."""
    if not isinstance(given, (Mapping, Sequence, np.ndarray)) or isinstance(given, (str, bytes)):
        raise OptionError(f"{name} is {{group: bool}} or a bool for each group, not {given!r}", Status.E_TYPE)
    if not isinstance(given, Mapping):
        if len(given) != len(flags):
            raise InvalidValueError(
                f"{name} is {{group: bool}} or {len(flags)} bools, one for each group, not {given!r}", Status.E_SIZE
            )
        given = dict(enumerate(given))
    for group, shown in given.items():
        flags[_key(name, "group", group, len(flags))] = bool(shown)


def _int32(name: str, value: Any) -> int:
    if not isinstance(value, (int, np.integer)) or not -(2**31) <= value < 2**31:
        raise OptionError(f"{name} is a 32-bit int, not {value!r}", Status.E_TYPE)
    return int(value)


def _index(name: str, value: Any) -> int:
    try:
        return operator.index(value)
    except TypeError:
        raise OptionError(f"{name} is an int, not {value!r}", Status.E_TYPE) from None


def _key(name: str, what: str, key: Any, count: int) -> int:
    index = _index(f"a key of {name}", key)
    if not 0 <= index < count:
        raise UnknownNameError(f"{name} has the {what} {index}; there are 0..{count - 1}", Status.E_NAME)
    return index


def _finite(name: str, value: Any, count: int) -> NDArray[np.float64]:
    try:
        numbers = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise OptionError(f"{name} of default_camera_config cannot be {value!r}", Status.E_TYPE) from None
    if numbers.size != count or not np.isfinite(numbers).all():
        raise InvalidValueError(
            f"{name} of default_camera_config is {count} finite number(s), not {value!r}", Status.E_VALUE
        )
    return numbers.reshape(-1)
