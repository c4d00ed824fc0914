"""One row of a vector environment."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mjenv._abi import Role, Status
from mjenv._handle import Float64Array
from mjenv._mujoco import Data, Model
from mjenv._pictures import Picture
from mjenv.errors import InvalidValueError

if TYPE_CHECKING:
    from mjenv.vector import VectorEnv


class Row:
    """One row of a vector environment, with what env.unwrapped of a single environment offers."""

    def __init__(self, owner: VectorEnv, row: int) -> None:
        self._owner, self._row, self._rows = owner, row, owner._rows
        self.action_space, self.observation_space = owner.single_action_space, owner.single_observation_space
        self.frame_skip, self.metadata = owner.frame_skip, owner.metadata
        self.render_mode = owner.render_mode

    @property
    def unwrapped(self) -> Row:
        return self

    @property
    def data(self) -> Data:
        """The row's mjData, as read-only copies."""
        return Data(self._rows, self._row)

    @property
    def model(self) -> Model:
        return Model(self._rows)

    @property
    def dt(self) -> float:
        """Seconds in a step."""
        return self._owner.dt

    @property
    def np_random_seed(self) -> int:
        return self._owner.np_random_seed[self._row]

    @property
    def np_random(self) -> np.random.Generator:
        """A copy of the row's random stream."""
        if self._owner._seeds[self._row] is None:
            _ = self.np_random_seed  # seeds the rows that never were
        state, increment = self._rows.stream(self._row)
        bits = np.random.PCG64(0)
        bits.state = {**bits.state, "state": {"state": state, "inc": increment}}
        return np.random.Generator(bits)

    @property
    def init_qpos(self) -> Float64Array:
        """The model's positions, which a reset disturbs."""
        qpos0: Float64Array = self.model.qpos0
        return qpos0

    @property
    def init_qvel(self) -> Float64Array:
        """The model's velocities: zero."""
        return np.zeros(self.model.nv)

    @property
    def observation_structure(self) -> dict[str, int]:
        """Where Gymnasium has it: the lengths of the terms of the observation."""
        structure = {field.name: field.count for field in self._rows.fields(Role.STRUCTURE)}
        if not structure:
            raise AttributeError(f"{self._rows.id} has no observation_structure")
        return structure

    def render(self) -> Picture | None:
        """The picture of the row."""
        self._owner._check_settled()
        return self._owner._pictures.draw(self._row)

    def set_state(self, qpos: ArrayLike, qvel: ArrayLike) -> None:
        """Sets qpos[nq] and qvel[nv] and computes what follows from them; a row that had ended goes on."""
        self._owner._check_settled()
        self._rows.set_state(self._row, qpos, qvel)
        self._owner._stale = True

    def do_simulation(self, ctrl: ArrayLike, n_frames: int) -> None:
        """Simulates n_frames mj_steps under ctrl[nu]; no step is counted."""
        self._owner._check_settled()
        controls = np.ascontiguousarray(ctrl, np.float64)
        if controls.shape != self.action_space.shape:
            raise InvalidValueError(
                f"ctrl has the shape {controls.shape}; {self._rows.id} takes {self.action_space.shape}", Status.E_SIZE
            )
        self._rows.simulate(self._row, controls, operator.index(n_frames))
        self._owner._stale = True

    def state_vector(self) -> Float64Array:
        """qpos and qvel, one behind the other."""
        data = self.data
        return np.concatenate([data.qpos, data.qvel])

    def get_body_com(self, body_name: str) -> Float64Array:
        """The position of a body's frame, in m."""
        position: Float64Array = self.data.body(body_name).xpos
        return position
