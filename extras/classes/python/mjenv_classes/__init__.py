"""Runs classes that are written for Gymnasium's MujocoEnv on mjenv."""

from __future__ import annotations

import os
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Space
from gymnasium.utils import EzPickle
from numpy.typing import NDArray

from mjenv.capi.engine import ENGINES
from mjenv.capi.handle import open_rows
from mjenv.gym.namespace import UNLISTED
from mjenv.rows.arguments import image_of
from mjenv.rows.arrays import Data, Model
from mjenv.rows.pictures import MAX_GEOM, RENDER_MODES, SIZE, Picture, Pictures
from mjenv.rows.simulation import Simulation
from mjenv.rows.step import Info


class MujocoEnv(Simulation, gymnasium.Env[Any, NDArray[Any]]):
    """The base of classes that are written for gymnasium.envs.mujoco.MujocoEnv, which run unchanged on it.

    A class defines step and reset_model, as for Gymnasium. Functions of the mujoco package take only its own structs:
    call the methods of the same names. ``class Mine(mjenv.MujocoEnv, engine="4.0")`` chooses the engine.
    """

    _is_alone = True
    _engine_name: str | None = None
    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES)}  # noqa: RUF012 as in gymnasium.Env

    action_space: Box  # type: ignore[assignment, unused-ignore]
    observation_space: Any
    init_qpos: Any
    init_qvel: Any

    def __init_subclass__(cls, engine: str | None = None, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if engine is not None:
            cls._engine_name = engine

    def __init__(
        self,
        model_path: str,
        frame_skip: int,
        observation_space: Space[Any] | None,
        render_mode: str | None = None,
        width: int = SIZE,
        height: int = SIZE,
        camera_id: int | None = None,
        camera_name: str | None = None,
        default_camera_config: dict[str, Any] | None = None,
        max_geom: int = MAX_GEOM,
        visual_options: dict[int, bool] | None = None,
    ) -> None:
        """Takes the arguments of Gymnasium's. model_path: a file, or the name of one of Gymnasium's models."""
        self.fullpath = _path_of(model_path)
        self.width, self.height = width, height
        found = self._initialize_simulation()
        if found != (self.model, self.data):
            raise TypeError(
                f"{type(self).__name__}._initialize_simulation returned {type(found[0])}: mjenv makes the model and "
                "the data itself. Write the model into a file and pass its path"
            )
        self.init_qpos, self.init_qvel = self.data.qpos.copy(), self.data.qvel.copy()
        self.frame_skip: int = frame_skip
        if "render_fps" in self.metadata:
            fps = int(np.round(1.0 / self.dt))
            assert fps == self.metadata["render_fps"], (
                f"metadata['render_fps'] is {self.metadata['render_fps']}, but one step simulates {self.dt} s: {fps}"
            )
        if observation_space is not None:
            self.observation_space = observation_space
        self._set_action_space()
        self.render_mode, self.camera_id, self.camera_name = render_mode, camera_id, camera_name
        pictures = Pictures(
            self._rows,
            render_mode,
            width,
            height,
            camera_id,
            camera_name,
            max_geom,
            visual_options,
            default_camera_config=default_camera_config,
        )
        self.mujoco_renderer = MujocoRenderer(pictures, default_camera_config)

    def _initialize_simulation(self) -> tuple[Model, Data]:
        """Loads the model. A class may change it after super()._initialize_simulation()."""
        options = {"xml_file": self.fullpath, "strict": False}
        self._rows = open_rows(ENGINES.get(self._engine_name), UNLISTED, options)
        return self.model, self.data

    def _set_action_space(self) -> Box:
        low, high = self.model.actuator_ctrlrange.astype(np.float32).T
        self.action_space = Box(low, high, dtype=np.float32)
        return self.action_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Info]:
        """Begins an episode: mj_resetData, then the class's reset_model and _get_reset_info."""
        super().reset(seed=seed)
        self._reset_simulation()
        obs, info = self.reset_model(), self._get_reset_info()
        if self.render_mode == "human":
            self.render()
        return obs, info

    def _reset_simulation(self) -> None:
        self.mj_resetData()

    def step(self, action: Any) -> Any:
        raise NotImplementedError(f"{type(self).__name__} defines no step")

    def reset_model(self) -> Any:
        """Sets the state in which an episode begins, and returns the observation."""
        raise NotImplementedError(f"{type(self).__name__} defines no reset_model")

    def _get_reset_info(self) -> Info:
        return {}

    def render(self) -> Picture | None:  # type: ignore[override, unused-ignore]
        """The picture of the present state, for the render_mode."""
        return self.mujoco_renderer.render(self.render_mode)

    def close(self) -> None:
        """Frees the simulation, its renderers and its windows. Closing twice is fine."""
        if hasattr(self, "_rows"):
            self._rows.close()
        if hasattr(self, "mujoco_renderer"):
            self.mujoco_renderer.close()

    # ---- snapshots, pickle, copy ----

    def snapshot(self) -> bytes:
        """An image of the simulation and of np_random. What the class keeps in its attributes is not in it."""
        self._rows.set_stream(0, self.np_random.bit_generator.state)  # type: ignore[arg-type, unused-ignore]
        return self._rows.snapshot(0)

    def restore(self, image: bytes) -> None:
        """Continues from an image, bit for bit. It may come from another object of the same class."""
        self._rows.restore(0, image_of(image))
        self.np_random.bit_generator.state = self._rows.stream(0)

    def __getstate__(self) -> dict[str, Any]:
        """As in Gymnasium, a class that derives from EzPickle is built anew; others keep their state."""
        if isinstance(self, EzPickle):
            return EzPickle.__getstate__(self)  # type: ignore[no-any-return, no-untyped-call, unused-ignore]
        return {name: value for name, value in self.__dict__.items() if name not in ("data", "model", "_read_timestep")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        if isinstance(self, EzPickle):
            EzPickle.__setstate__(self, state)  # type: ignore[no-untyped-call, unused-ignore]
        else:
            self.__dict__.update(state)


def _path_of(model: str) -> str:
    """The path of a model, by the rules of Gymnasium's MujocoEnv."""
    path = os.path.expanduser(model)
    if not model.startswith((".", "/", "~")):
        path = os.path.join(os.path.dirname(gymnasium.__file__), "envs", "mujoco", "assets", model)
    if not os.path.exists(path):
        raise OSError(f"File {path} does not exist")
    return path


class MujocoRenderer:
    """env.mujoco_renderer: draws as Gymnasium's object of this name. It has no viewer of the mujoco package."""

    def __init__(self, pictures: Pictures, default_cam_config: dict[str, Any] | None) -> None:
        self._pictures, self.default_cam_config = pictures, default_cam_config
        self.width, self.height, self.camera_id = pictures.width, pictures.height, pictures.camera_id

    def render(self, render_mode: str | None) -> Picture | None:
        self._pictures.mode = render_mode
        return self._pictures.draw()

    def close(self) -> None:
        self._pictures.close()
