"""Mazes with Gymnasium-Robotics' arguments. Attributes of this module by ids are what gymnasium.make calls."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjenv.capi.engine import ENGINES
from mjenv.errors import InvalidValueError
from mjenv.gym.env import Environment

Map = Sequence[Sequence[Any]]
# How the library's option maze_map spells Gymnasium-Robotics' numbers.
_CELLS = {1: "#", 0: "."}


class MazeEnv(Environment):
    """A ball or an Ant that has to reach a goal in a maze."""

    def __init__(self, id: str, maze_map: Map | None = None, **options: Any) -> None:
        """maze_map: the maze's rows, in which 1 is a wall, "r" a cell where episodes begin, "g" one with a goal, "c"
        one for both, and 0 a free cell; None: the id's own."""
        if maze_map is not None:
            options["maze_map"] = "/".join("".join(_CELLS.get(cell, str(cell)) for cell in row) for row in maze_map)
            options["xml_string"] = _model(options.get("engine"), id, options["maze_map"])
        super().__init__(id, **options)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begins an episode. options: "goal_cell" and "reset_cell" may be the row and column of a cell."""
        cells = {
            name: options[name] for name in ("goal_cell", "reset_cell") if options and options.get(name) is not None
        }
        try:
            self.parameters.update(cells)
            obs, info = super().reset(seed=seed)
        finally:
            self.parameters.update(dict.fromkeys(cells, (-1.0, -1.0)))
        return obs, _with_bool(info)

    def step(self, action: ArrayLike) -> Any:
        """Takes a step, as Gymnasium's."""
        obs, reward, terminated, truncated, info = super().step(action)
        return obs, reward, terminated, truncated, _with_bool(info)

    def compute_terminated(self, achieved_goal: NDArray[Any], desired_goal: NDArray[Any], info: Any) -> Any:
        """Whether an episode ends, for goals (2,) or (..., 2): at the goal, if the task does not continue."""
        distance = np.asarray(achieved_goal) - desired_goal
        axis = None if distance.ndim == 1 else -1
        found = (not self.continuing_task) & (np.linalg.norm(distance, axis=axis) <= 0.45)
        return bool(found) if axis is None else found

    def compute_truncated(self, achieved_goal: NDArray[Any], desired_goal: NDArray[Any], info: Any) -> Any:
        """The same for truncation: no goal ends an episode in this way."""
        return np.zeros(np.shape(achieved_goal)[:-1], bool) if np.ndim(achieved_goal) > 1 else False

    @property
    def continuing_task(self) -> bool:
        return bool(self._continuing_task)


def _with_bool(info: dict[str, Any]) -> dict[str, Any]:
    """The library has ints where Gymnasium-Robotics has bools."""
    info["success"] = bool(info["success"])
    return info


def _model(engine: str | None, id: str, maze_map: str) -> str:
    """The model of an id's robot in a maze."""
    library = ctypes.CDLL(str(next(Path(ENGINES.get(engine).path).parent.glob("libmjenv-mazes.*"))))
    library.mjenv_mazes_model.argtypes, library.mjenv_mazes_model.restype = [ctypes.c_char_p] * 2, ctypes.c_char_p
    text = library.mjenv_mazes_model(id.encode(), maze_map.encode())
    if text is None:
        raise InvalidValueError(f"maze_map {maze_map!r} is no maze: rows of one length, of 1, 0, 'r', 'g' and 'c'")
    return str(text.decode())


def __getattr__(name: str) -> Callable[..., MazeEnv]:
    if "Maze_" not in name:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    creator = functools.partial(MazeEnv, f"mazes/{name}", max_episode_steps=-1)
    creator.metadata = Environment.metadata  # type: ignore[attr-defined]
    return creator
