"""env.physics of mjenv_dm_control.suite, with the interface of dm_control.mujoco.Physics."""

from __future__ import annotations

import logging
import operator
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from ctypes import byref
from functools import partial
from importlib import import_module
from types import FunctionType, MethodType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjenv.capi import declarations
from mjenv.capi.declarations import Role, Status
from mjenv.capi.engine import Engine
from mjenv.capi.handle import Batch
from mjenv.errors import InvalidValueError, OptionError, PhysicsError, UnknownNameError
from mjenv.gym.env import Environment
from mjenv.rows.arrays import Arrays, Data, Model
from mjenv.rows.pictures import GROUPS, Pictures, Renderer, visual_flags
from mjenv_dm_control._named import Named, Names
from mjenv_dm_control._pointers import Pointers

# Enough for each scene of the suite with everything visible.
_MAX_GEOM = 10_000
# A simulation keeps the renderers used last, one for each size, camera and set of options.
_MAX_RENDERERS = 8
# MuJoCo's mjtRndFlag by their names in render_flag_overrides, as settings of the library.
_RENDER_FLAGS = {
    "shadow": "shadows",
    "wireframe": "wireframe",
    "reflection": "reflections",
    "additive": "additive",
    "skybox": "skybox",
    "fog": "fog",
    "haze": "haze",
    "cull_face": "cull_face",
}
# MuJoCo's mjtWarning. MuJoCo 4.0 has no mjWARN_VGEOMFULL.
_WARNINGS = ("INERTIA", "CONTACTFULL", "CNSTRFULL", "VGEOMFULL", "BADQPOS", "BADQVEL", "BADQACC", "BADCTRL")
_KINDS = {"camera": "cam", "joint": "jnt", "material": "mat", "texture": "tex", "equality": "eq"}
# MuJoCo's mjtObj, in its order. MuJoCo 4.0 has "flex" before "mesh".
_OBJECTS = (
    "unknown body xbody joint dof geom site camera light mesh skin hfield texture material pair exclude equality "
    "tendon actuator sensor numeric text tuple key"
).split()


class NamedStructs(NamedTuple):
    """physics.named."""

    model: Named
    data: Named


class PhysicsView(Arrays):
    """physics.model.vis.global_. offwidth and offheight, the size of the buffer in which programs draw with model.ptr,
    can be written. physics.render needs no such buffer."""

    _pointers: Pointers

    def __init__(self, pointers: Pointers) -> None:
        super().__init__(pointers.rows, 0, Role.MODEL, partial(pointers.release, model=True), "vis.global.")
        object.__setattr__(self, "_pointers", pointers)

    def __getattr__(self, name: str) -> Any:
        return self._pointers.buffer[name] if name in self._pointers.buffer else super().__getattr__(name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name in ("offwidth", "offheight"):
            self._pointers.buffer[name] = operator.index(value)
            self._pointers.release(model=True)
        else:
            super().__setattr__(name, value)


class PhysicsModel(Model):
    """physics.model: mjModel by MuJoCo's names, and the names of its objects."""

    _pointers: Pointers
    objects: Names

    def __init__(self, pointers: Pointers) -> None:
        super().__init__(pointers.rows, 0, partial(pointers.release, model=True))
        object.__setattr__(self, "objects", Names(self))
        object.__setattr__(self, "_pointers", pointers)
        object.__setattr__(self.vis, "global_", PhysicsView(pointers))

    @property
    def ptr(self) -> Any:
        """The simulation's mujoco.MjModel, for functions of MuJoCo's Python package, which must be installed.

        Each access brings it up to date. What is written to it does not change the simulation.
        """
        return self._pointers.model

    @property
    def name(self) -> str:
        """The name of the model."""
        return str(self.names.split(b"\0")[0].decode())

    def name2id(self, name: str, object_type: str | int) -> int:
        """The index of the object of that name. object_type: "body", "joint", "material" and so on, or an mjtObj."""
        names = self._names_of(object_type)
        if name not in names:
            raise UnknownNameError(f"there is no {object_type} {name!r}, but {', '.join(filter(None, names))}")
        return names.index(name)

    def id2name(self, object_id: int, object_type: str | int) -> str:
        """The name of the object with that index; "" if it has none."""
        names = self._names_of(object_type)
        if not 0 <= object_id < len(names):
            raise UnknownNameError(f"there is no {object_type} {object_id}; there are {len(names)}")
        return names[object_id]

    def _names_of(self, object_type: str | int) -> list[str]:
        kind = object_type if isinstance(object_type, str) else self._kind_of(int(object_type))
        try:
            return self.objects.of(_KINDS.get(kind, kind))
        except AttributeError:
            raise UnknownNameError(f"there are no objects of type {object_type!r}", Status.E_NAME) from None

    def _kind_of(self, number: int) -> str:
        kinds = [*_OBJECTS]
        if self._pointers.rows.engine.name != "2.2.2":
            kinds.insert(kinds.index("mesh"), "flex")
        return kinds[number] if 0 <= number < len(kinds) else ""


class PhysicsData(Data):
    """physics.data: mjData by MuJoCo's names."""

    _pointers: Pointers

    def __init__(self, pointers: Pointers) -> None:
        super().__init__(pointers.rows, 0, pointers.release)
        object.__setattr__(self, "_pointers", pointers)

    def __getattr__(self, name: str) -> Any:
        self._pointers.commit()
        return super().__getattr__(name)

    @property
    def contact(self) -> Any:
        self._pointers.commit()
        return super().contact

    @property
    def ptr(self) -> Any:
        """The simulation's mujoco.MjData, for functions of MuJoCo's Python package, which must be installed.

        Each access brings it up to date. What is written to its inputs, such as qpos and xfrc_applied, changes the
        simulation.
        """
        return self._pointers.data


class Physics:
    """The simulation of an environment.

    data, model: mjData and mjModel by MuJoCo's names. Their arrays show the present state. Assignments to arrays or
    their elements change the simulation, except for arrays that MuJoCo computes. If dm_control is installed, the
    methods that it adds for the domain are here, too: torso_upright() of walker, for example. Pickling and
    copy.deepcopy make a copy().
    """

    def __init__(self, env: Environment, domain: str) -> None:
        self._env, self._domain = env, domain
        if domain == "quadruped":  # what its methods in dm_control remember
            self._sensor_types_to_names: dict[Any, list[str]] = {}
            self._hinge_names: list[str] = []
        self._raises = True
        self.pointers = Pointers(env)
        self.model = PhysicsModel(self.pointers)
        self.data = PhysicsData(self.pointers)
        self.named = NamedStructs(
            Named(self.model, Role.MODEL, self.model.objects), Named(self.data, Role.DATA, self.model.objects)
        )
        self._renderers: dict[Any, Renderer] = {}

    def __getattr__(self, name: str) -> Any:
        method = None if name.startswith("__") else _methods_of(self.__dict__.get("_domain")).get(name)
        if method is None:
            raise AttributeError(
                f"physics has no {name!r}; docs/from-dm_control.md lists what dm_control's has and mjenv's lacks. The "
                "methods of a domain need dm_control (pip install dm_control)"
            )
        return MethodType(method, self)

    def __getstate__(self) -> dict[str, Any]:
        self.pointers.commit()
        return {"env": self._env, "domain": self._domain}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state)  # type: ignore[misc]
        with self.suppress_physics_errors():
            self.after_reset()  # as dm_control does

    def copy(self, share_model: bool = False) -> Physics:
        """A simulation of its own with the same state and model, after after_reset(). share_model has no effect."""
        return deepcopy(self)

    # ---- the state ----

    def timestep(self) -> float:
        """The seconds that one mj_step simulates."""
        return float(self.model.opt.timestep)

    def time(self) -> float:
        """The seconds of the episode."""
        return float(self.data.time)

    def control(self) -> NDArray[np.float64]:
        """A copy of the controls, float64[nu]."""
        return np.array(self.data.ctrl)

    def activation(self) -> NDArray[np.float64]:
        """A copy of the states of actuators, float64[na]."""
        return np.array(self.data.act)

    def position(self) -> NDArray[np.float64]:
        """A copy of the positions, float64[nq]."""
        return np.array(self.data.qpos)

    def velocity(self) -> NDArray[np.float64]:
        """A copy of the velocities, float64[nv]."""
        return np.array(self.data.qvel)

    def state(self) -> NDArray[np.float64]:
        """qpos, qvel and act, one after the other: float64[nq + nv + na]."""
        return np.concatenate([self.data.qpos, self.data.qvel, self.data.act])

    get_state = state

    def set_state(self, physics_state: NDArray[np.float64]) -> None:
        """Writes what state() returned. forward() then computes what follows from it."""
        sizes = [len(getattr(self.data, name)) for name in ("qpos", "qvel", "act")]
        if np.shape(physics_state) != (sum(sizes),):
            shape = np.shape(physics_state)
            raise InvalidValueError(f"Input physics state has shape {shape}. Expected {(sum(sizes),)}.", Status.E_SIZE)
        parts = np.split(np.asarray(physics_state, np.float64), np.cumsum(sizes)[:-1])
        for name, values in zip(("qpos", "qvel", "act"), parts, strict=True):
            if len(values):
                setattr(self.data, name, values)

    def set_control(self, control: ArrayLike) -> None:
        """Writes the controls that the next steps take, float64[nu]."""
        self.data.ctrl = np.broadcast_to(np.asarray(control, np.float64), self.data.ctrl.shape)

    def step(self, nstep: int = 1) -> None:
        """Simulates nstep timesteps under the present controls."""
        self.pointers.release()
        self._env.do_simulation(np.array(self.data.ctrl), nstep)
        self.report(self.data.warnings)

    def forward(self) -> None:
        """Computes what follows from positions and velocities, with the actuators switched off."""
        self.pointers.release()
        self._env.set_state(np.array(self.data.qpos), np.array(self.data.qvel))
        self.report(self.data.warnings)

    def after_reset(self) -> None:
        """Computes what follows from the state that was written in reset_context."""
        self.forward()

    def reset(self, keyframe_id: int | None = None) -> None:
        """Sets the simulation to the model's initial state, as mj_resetData does."""
        if keyframe_id is not None:
            raise InvalidValueError("the suite's models have no keyframes; keyframe_id must be None")
        self.pointers.release()
        self.data.time = 0
        for name in ("act", "ctrl", "qacc_warmstart", "qfrc_applied", "xfrc_applied"):
            if getattr(self.data, name).size:
                setattr(self.data, name, np.zeros(getattr(self.data, name).shape))
        self._env.set_state(np.array(self.model.qpos0), np.zeros(self.model.nv))
        self.report(self.data.warnings)

    def observe(self) -> NDArray[np.float64]:
        """The library's observation of the present state: all terms, one after the other."""
        self.pointers.commit()
        env = self._env
        batch = Batch(1, env.observation_space.shape, 0)
        with env.handle.changing():
            env.handle.observe(byref(batch.struct))
        observation: NDArray[np.float64] = batch.obs[0]
        return observation

    @contextmanager
    def reset_context(self) -> Iterator[Physics]:
        """with physics.reset_context(): begins with the initial state, and ends with what follows from the state that
        was written inside."""
        self.reset()
        yield self
        self.after_reset()

    @contextmanager
    def suppress_physics_errors(self) -> Iterator[None]:
        """with physics.suppress_physics_errors(): MuJoCo's warnings are logged, and the simulation goes on."""
        before, self._raises = self._raises, False
        try:
            yield
        finally:
            self._raises = before

    def report(self, warnings: NDArray[Any]) -> None:
        """Raises PhysicsError if MuJoCo has given warnings. Inside suppress_physics_errors, logs them instead.

        warnings: data.warnings. If dm_control is loaded, the exception is also dm_control's PhysicsError.
        """
        kinds = [kind for kind in _WARNINGS if kind != "VGEOMFULL" or len(warnings) == len(_WARNINGS)]
        given = [f"mjWARN_{kind}" for kind, is_given in zip(kinds, warnings, strict=True) if is_given]
        if not given:
            return
        message = f"Physics state is invalid. Warning(s) raised: {', '.join(given)}"
        if self._raises:
            raise _error_class()(message, Status.DIVERGED)
        logging.getLogger(__name__).warning(message)

    def free(self) -> None:
        """Frees the simulation."""
        self._renderers.clear()
        self._env.close()

    # ---- pictures ----

    def render(
        self,
        height: int = 240,
        width: int = 320,
        camera_id: int | str = -1,
        overlays: Any = (),
        depth: bool = False,
        segmentation: bool = False,
        scene_option: Any = None,
        render_flag_overrides: Mapping[Any, bool] | None = None,
        scene_callback: Any = None,
    ) -> NDArray[Any]:
        """The picture of a camera, in a new array, the top row first.

        Returns uint8[height, width, 3]; with depth=True float32[height, width], in metres; with segmentation=True
        int32[height, width, 2], the index and the mjtObj of the object that each pixel shows, -1 and -1 where nothing
        is. camera_id: an index or a name; -1 is the free camera. scene_option: a mujoco.MjvOption or an object with its
        attributes. render_flag_overrides: {"wireframe": True} and the like, or with mujoco's mjtRndFlag as keys.
        overlays and scene_callback need dm_control's own Physics.
        """
        self.pointers.commit()
        if len(overlays) or scene_callback is not None:
            raise OptionError("overlays and scene_callback need dm_control's own Physics", Status.E_NAME)
        if depth and segmentation:
            raise InvalidValueError("`segmentation` and `depth` cannot both be `True`.")
        if render_flag_overrides and (depth or segmentation):
            raise InvalidValueError("`render_flag_overrides` are not supported for depth or segmentation rendering.")
        camera = self.model.name2id(camera_id, "camera") if isinstance(camera_id, str) else int(camera_id)
        if not -1 <= camera < self.model.ncam:
            raise InvalidValueError(f"camera_id is {camera}; the model has {self.model.ncam} cameras, and -1 is free")
        flags = tuple(sorted(_flag(key, value) for key, value in (render_flag_overrides or {}).items()))
        renderer = self._renderer((height, width, camera, _shown(scene_option), flags))
        with self._env.handle.changing():
            if segmentation:
                objects = np.empty((height, width, 2), np.int32)
                renderer.draw_segmentation(0, objects)
                return objects
            if not depth:
                rgb = np.empty((height, width, 3), np.uint8)
                renderer.draw(0, rgb, None)
                return rgb
            buffer = np.empty((height, width), np.float32)
            renderer.draw(0, None, buffer)
        extent, planes = self.model.stat.extent, self.model.vis.map
        near, far = planes.znear * extent, planes.zfar * extent
        metres: NDArray[np.float32] = near / (1 - buffer * (1 - near / far))
        return metres

    def _renderer(self, key: tuple[int, int, int, Any, Any]) -> Renderer:
        """The renderer for a size, a camera, mjvOption and flags. The last ones used are kept."""
        found = self._renderers.pop(key, None)
        if found is None:
            found = self._make_renderer(*key)
            if len(self._renderers) >= _MAX_RENDERERS:
                self._renderers.pop(next(iter(self._renderers)))
        self._renderers[key] = found
        return found

    def _make_renderer(self, height: int, width: int, camera: int, shown: Any, flags: Any) -> Renderer:
        view, stat = self.model.vis.global_, self.model.stat
        free = {"lookat": stat.center, "distance": 1.5 * stat.extent}
        free |= {"azimuth": view.azimuth, "elevation": view.elevation}
        rows = self._env.handle
        pictures = Pictures(rows, "rgb_array", width, height, max_geom=_MAX_GEOM, default_camera_config=free)
        turn = [rows.enter()]
        try:
            settings = pictures.settings(rows.pointer, camera)
            if shown is None:
                settings.visual[declarations.Visual.RANGEFINDER] = 0  # as dm_control's MjvOption
            else:
                _show(settings, rows.engine, *shown)
            for name, value in flags:
                setattr(settings, name, value)
            return Renderer(rows.engine, rows.pointer, settings)
        finally:
            rows.leave(turn.pop())


def _shown(option: Any) -> Any:
    """What an mjvOption says, as a key."""
    if option is None:
        return None
    groups = tuple(tuple(map(bool, getattr(option, name))) for name in GROUPS if hasattr(option, name))
    return tuple(map(bool, option.flags)), groups, int(option.label), int(option.frame)


def _show(settings: Any, engine: Engine, flags: tuple[bool, ...], groups: Any, label: int, frame: int) -> None:
    """Sets what an mjvOption says."""
    for flag, value in zip(visual_flags(engine), flags, strict=False):
        if flag is not None:
            settings.visual[flag] = value
    for name, shown in zip(GROUPS, groups, strict=True):
        getattr(settings, name)[:] = [*map(int, shown)]
    settings.label, settings.frame = _label_of(engine, label), frame


def _label_of(engine: Engine, kind: int) -> declarations.Label:
    """The library's label for one of the engine's mjtLabel."""
    labels: list[declarations.Label | None] = list(declarations.Label)
    if engine.name != "2.2.2":  # MuJoCo 4.0 has inserted flexes and contact points
        labels.insert(declarations.Label.SKIN, None)
        labels.insert(len(labels) - 1, None)
    found = labels[kind] if 0 <= kind < len(labels) else None
    if found is None:
        raise UnknownNameError(f"label is {kind}, which mjenv does not draw", Status.E_NAME)
    return found


def _flag(key: Any, value: bool) -> tuple[str, int]:
    """The setting of a flag in render_flag_overrides, and its value."""
    name = key if isinstance(key, str) else getattr(key, "name", "").removeprefix("mjRND_").lower()
    if name not in _RENDER_FLAGS:
        raise UnknownNameError(f"render_flag_overrides has {key!r}; there are {', '.join(_RENDER_FLAGS)}")
    return _RENDER_FLAGS[name], int(bool(value))


def _methods_of(domain: str | None) -> dict[str, Any]:
    """The methods that dm_control's Physics of a domain adds to those of all."""
    try:
        kind = import_module(f"dm_control.suite.{domain}").Physics
    except (ImportError, AttributeError):
        return {}
    return {name: value for name, value in vars(kind).items() if isinstance(value, FunctionType)}


def _error_class() -> type[PhysicsError]:
    """PhysicsError, also as the one that programs which use dm_control expect."""
    control = sys.modules.get("dm_control.rl.control")
    return PhysicsError if control is None else type("PhysicsError", (PhysicsError, control.PhysicsError), {})
