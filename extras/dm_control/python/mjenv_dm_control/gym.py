"""The suite's tasks as Gymnasium environments with the interface of Shimmy's: Dict observations of dm_control's terms.

Attributes of this module by the names of tasks are what gymnasium.make calls, "cheetah-run" for example, and
gymnasium.make_vec, "cheetah-run/vector".
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict
from numpy.typing import ArrayLike, NDArray

from mjenv.errors import InvalidValueError
from mjenv.gym.vector import VectorEnv
from mjenv.rows.pictures import Pictures
from mjenv_dm_control import suite
from mjenv_dm_control._dm_env import dm_env, specs
from mjenv_dm_control.suite import ALL_TASKS

Observation = dict[str, Any]
Info = dict[str, Any]

_MODES = ("human", "rgb_array", "depth_array", "multi_camera")


class DmControlEnv(gymnasium.Env[Observation, NDArray[Any]]):
    """A task of the suite, as Shimmy's DmControlCompatibilityV0.

    Observations are dicts of dm_control's terms, float64. reset(seed=n) replaces the random numbers by those of
    numpy.random.RandomState(n). The last step of an episode is truncated if its discount is 1, else terminated. The
    info has dm_control's discount and step type. Other attributes are those of mjenv_dm_control.suite's Environment,
    physics for example.
    """

    metadata: dict[str, Any] = {"render_modes": list(_MODES), "render_fps": 10}  # noqa: RUF012 as in gymnasium.Env

    def __init__(
        self,
        domain_name: str,
        task_name: str,
        task_kwargs: Mapping[str, Any] | None = None,
        environment_kwargs: Mapping[str, Any] | None = None,
        visualize_reward: bool = False,
        render_mode: str | None = None,
        render_kwargs: Mapping[str, Any] | None = None,
    ) -> None:
        """render_kwargs: arguments of physics.render, such as height, width and camera_id."""
        if render_mode is not None and render_mode not in _MODES:
            raise InvalidValueError(f"render_mode is one of {', '.join(_MODES)}, not {render_mode!r}")
        self._env = suite.load(domain_name, task_name, task_kwargs, environment_kwargs, visualize_reward)
        self.observation_space = Dict({name: _space(spec) for name, spec in self._env.observation_spec().items()})
        self.action_space = _space(self._env.action_spec())
        self.metadata = {"render_modes": list(_MODES), "render_fps": self._env.control_timestep() * 1000}
        self.render_mode, self.render_kwargs = render_mode, dict(render_kwargs or {})
        self._window: Pictures | None = None
        # Springs that the first reset draws, and that a later seed leaves as they are.
        self._lacks_springs = domain_name == "lqr"

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, Info]:
        """Begins an episode. seed: an int of 32 bits, or None to go on with the random numbers. options: ignored."""
        super().reset(seed=seed)
        if seed is not None:
            random = np.random.RandomState(seed)
            if self._lacks_springs:
                self._env.reset()
            self.np_random = random
        self._lacks_springs = False
        observation, _, _, _, info = self._results(self._env.reset())
        return observation, info

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, Info]:  # type: ignore[override, unused-ignore]
        """Takes a step; after the last one of an episode, begins an episode."""
        return self._results(self._env.step(action))

    def _results(self, step: dm_env.TimeStep) -> tuple[Observation, float, bool, bool, Info]:
        if self.render_mode == "human":
            self.render()
        observation = {name: np.asarray(value) for name, value in step.observation.items()}
        truncated = step.last() and step.discount > 0
        info = {"timestep.discount": step.discount, "timestep.step_type": step.step_type}
        return observation, step.reward or 0, step.last() and not truncated, truncated, info

    def render(self) -> NDArray[Any] | None:  # type: ignore[override, unused-ignore]
        """The picture: uint8[height, width, 3]; depths in metres; or those of all cameras in one ("multi_camera")."""
        if self.render_mode == "human":
            if self._window is None:
                self._window = Pictures(self._env.mjenv.handle, "human")
            self._window.draw()
            return None
        if self.render_mode == "multi_camera":
            return self._all_cameras(**self.render_kwargs)
        if self.render_mode is None:
            return None
        picture: NDArray[Any] = self._env.physics.render(depth=self.render_mode == "depth_array", **self.render_kwargs)
        return picture

    def _all_cameras(self, height: int = 240, width: int = 320, **arguments: Any) -> NDArray[np.uint8]:
        """The pictures of all cameras, row by row in a grid that is as wide as it is high, or one wider."""
        count = int(self._env.physics.model.ncam)
        columns = math.ceil(math.sqrt(count))
        sheet = np.zeros((math.ceil(count / columns) * height, columns * width, 3), np.uint8)
        for camera in range(count):
            y, x = (camera // columns) * height, (camera % columns) * width
            picture = self._env.physics.render(height, width, camera, **arguments)
            sheet[y : y + height, x : x + width] = picture
        return sheet

    @property
    def dt(self) -> float:
        """The seconds that one step simulates."""
        return float(self._env.control_timestep())

    @property  # type: ignore[override]
    def np_random(self) -> np.random.RandomState:  # type: ignore[override, unused-ignore]
        """The random numbers of the task."""
        random: np.random.RandomState = self._env.task.random
        return random

    @np_random.setter
    def np_random(self, value: np.random.RandomState) -> None:
        if isinstance(self._env.task, suite.Task):
            self._env.task.random = value
        else:
            self._env.task._random = value  # dm_control's own, of a task that mjenv lacks

    def close(self) -> None:
        """Frees the simulation."""
        if self._window is not None:
            self._window.close()
        self._env.close()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(f"{type(self).__name__} has no {name!r}")
        return getattr(self._env, name)


def _space(spec: specs.Array) -> Box:
    """Gymnasium's space for a spec of dm_env."""
    low, high = getattr(spec, "minimum", -np.inf), getattr(spec, "maximum", np.inf)
    low, high = (np.broadcast_to(bound, spec.shape) for bound in (low, high))
    return Box(low, high, spec.shape, spec.dtype)


def __getattr__(name: str) -> Callable[..., Any]:
    domain, _, task = name.removesuffix("/vector").partition("-")
    if (domain, task) not in ALL_TASKS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name.endswith("/vector"):
        return functools.partial(VectorEnv, f"dm_control/{domain}-{task}-v0", observation="dict")
    creator = functools.partial(DmControlEnv, domain, task)
    # By these, gymnasium.make adds wrappers for other render modes.
    creator.metadata = DmControlEnv.metadata  # type: ignore[attr-defined]
    return creator
