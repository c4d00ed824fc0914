"""One row of a vector environment."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec

from mjenv.capi.declarations import Role
from mjenv.rows.pictures import Picture
from mjenv.rows.pool import Pool
from mjenv.rows.simulation import TaskSimulation
from mjenv.rows.step import Info, infos_of_rows

# The keywords of make_vec, and of gymnasium.make_vec, that make lacks.
_OF_VECTORS = "num_envs vectorization_mode vector_kwargs num_threads autoreset_mode dtype copy".split()


class Row(TaskSimulation):
    """One row of a vector environment, with what env.unwrapped of a single environment offers."""

    def __init__(self, envs: gymnasium.vector.VectorEnv[Any, Any, Any], pool: Pool, row: int) -> None:
        """envs is kept, because it frees the rows when it is collected."""
        self._envs, self._pool = envs, pool
        self._rows, self._row = pool.rows, row
        self.action_space, self.observation_space = envs.single_action_space, envs.single_observation_space
        self.frame_skip, self.metadata = pool.frame_skip, envs.metadata
        self.render_mode = envs.render_mode
        self._is_built = True

    def _check_settled(self) -> None:
        self._pool.check_settled()

    def _changed(self) -> None:
        self._pool.changed()

    @property
    def unwrapped(self) -> Row:
        return self

    @property
    def spec(self) -> EnvSpec | None:
        """The spec of a single environment like this row. None if the vector has no spec."""
        spec = copy.deepcopy(self._envs.spec)
        if spec is None:
            return None
        kwargs = {name: value for name, value in spec.kwargs.items() if name not in _OF_VECTORS}
        limit = kwargs.pop("max_episode_steps", spec.max_episode_steps)
        spec.max_episode_steps = None if limit == -1 else limit
        if kwargs.get("time_aware"):
            kwargs["max_episode_steps"] = limit
        spec.kwargs = kwargs
        return spec

    def get_wrapper_attr(self, name: str) -> Any:
        """An attribute of the row, which has no wrappers."""
        return getattr(self, name)

    def has_wrapper_attr(self, name: str) -> bool:
        return hasattr(self, name)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Info]:
        """Begins an episode of this row alone. Takes and returns what reset of a single environment does."""
        pool, row = self._pool, self._row
        obs = self._envs._reset_row(row, seed)  # type: ignore[attr-defined]
        fields, values = pool.rows.fields(Role.RESET_INFO), pool.outputs.reset_info
        (info,) = infos_of_rows(fields, values, pool.count, np.dtype(np.float64), [row])
        return obs, info

    def observe(self) -> Any:
        """The observation of the present state, without a step: after set_state, for example."""
        return self._envs._observe_row(self._row)  # type: ignore[attr-defined]

    _get_obs = observe

    @property
    def np_random_seed(self) -> int:
        """The row's last seed; -1 if its stream came from a snapshot."""
        return self._pool.seed_of(self._row)

    @property
    def np_random(self) -> np.random.Generator:
        """A copy of the row's random stream."""
        self._pool.seed_of(self._row)
        bits = np.random.PCG64(0)
        bits.state = self._rows.stream(self._row)  # type: ignore[assignment, unused-ignore]
        return np.random.Generator(bits)

    def render(self) -> Picture | None:
        """The picture of the row."""
        self._check_settled()
        return self._pool.pictures.draw(self._row)


class RowList(Sequence[Row]):
    """The rows of a vector environment, each of which is made when it is asked for."""

    def __init__(self, envs: gymnasium.vector.VectorEnv[Any, Any, Any], pool: Pool) -> None:
        self._envs, self._pool = envs, pool

    def __len__(self) -> int:
        return self._pool.count

    def __getitem__(self, row: int | slice) -> Any:
        """A row, or a tuple of rows."""
        chosen = range(self._pool.count)[row]
        if isinstance(chosen, int):
            return Row(self._envs, self._pool, chosen)
        return tuple(Row(self._envs, self._pool, one) for one in chosen)
