"""One row of a vector environment."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from mjenv.rows.pictures import Picture
from mjenv.rows.pool import Pool
from mjenv.rows.simulation import Simulation


class Row(Simulation):
    """One row of a vector environment, with what env.unwrapped of a single environment offers."""

    def __init__(self, envs: gymnasium.vector.VectorEnv[Any, Any, Any], pool: Pool, row: int) -> None:
        """envs is kept, because it frees the rows when it is collected."""
        self._envs, self._pool = envs, pool
        self._rows, self._row = pool.rows, row
        self.action_space, self.observation_space = envs.single_action_space, envs.single_observation_space
        self.frame_skip, self.metadata = pool.frame_skip, envs.metadata
        self.render_mode = envs.render_mode

    def _check_settled(self) -> None:
        self._pool.check_settled()

    def _changed(self) -> None:
        self._pool.stale = True

    @property
    def unwrapped(self) -> Row:
        return self

    @property
    def np_random_seed(self) -> int:
        """The row's last seed; -1 if its stream came from a snapshot."""
        return self._pool.all_seeds()[self._row]

    @property
    def np_random(self) -> np.random.Generator:
        """A copy of the row's random stream."""
        self._pool.all_seeds()
        bits = np.random.PCG64(0)
        bits.state = self._rows.stream(self._row)  # type: ignore[assignment, unused-ignore]
        return np.random.Generator(bits)

    def render(self) -> Picture | None:
        """The picture of the row."""
        self._check_settled()
        return self._pool.pictures.draw(self._row)
