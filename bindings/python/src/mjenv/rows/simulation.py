"""The attributes of env.unwrapped of Gymnasium's MuJoCo environments, for one environment and for a row of a vector."""

from __future__ import annotations

import operator

import numpy as np
from numpy.typing import ArrayLike

from mjenv.capi.declarations import Role, Status
from mjenv.capi.dtypes import Float64Array
from mjenv.capi.handle import GoalRewards, Rows
from mjenv.capi.schema import Field
from mjenv.errors import InvalidValueError, UnknownNameError
from mjenv.rows.arrays import Arrays, Data, Model, Parameters


class Simulation:
    """Access to the simulation of one row."""

    _rows: Rows
    _row: int = 0
    frame_skip: int

    def _check_settled(self) -> None:
        """Called before the whole state is read or changed. Raises if that is not allowed now."""

    def _changed(self) -> None:
        """Called after the state was changed other than by a step or a reset."""

    @property
    def handle(self) -> Rows:
        """The rows in the C interface, for programs that call its functions."""
        return self._rows

    @property
    def data(self) -> Data:
        """The row's mjData. Each access to an array returns a new copy.

        Assignments to qpos, qvel, act, ctrl, time, qacc_warmstart, qfrc_applied, xfrc_applied, mocap_pos, mocap_quat or
        userdata, or to their elements, change the simulation. A reset clears the forces.
        """
        return Data(self._rows, self._row, self._changed)

    @property
    def model(self) -> Model:
        """The row's mjModel. Each access to an array returns a new copy.

        Assignments to arrays, their elements or options give the row its own values, which the next simulation uses:
        ``env.unwrapped.model.geom_friction[:, 0] *= 0.5``, ``env.unwrapped.model.opt.timestep = 0.002``.
        """
        return Model(self._rows, self._row, self._changed)

    @property
    def parameters(self) -> Parameters:
        """The live parameters of the task: ``env.unwrapped.parameters["speed"] = 0.5``. Resets leave them."""
        return Parameters(lambda role, prefix: Arrays(self._rows, self._row, role, self._changed, prefix))

    @property
    def compute_reward(self) -> GoalRewards:
        """compute_reward(achieved_goal, desired_goal, info): the rewards (...) of goals (..., n) by the task's
        compute_reward, as gymnasium-robotics' GoalEnv has it. Environments of other tasks lack this attribute."""
        return self._rows.goal_rewards

    def set_constants(self) -> None:
        """Calls mj_setConst(model, data): computes anew what MuJoCo derives from masses, sizes and qpos0.

        The row ends in the position qpos_spring: reset it, or set its state.
        """
        self._check_settled()
        self._rows.set_constants(self._row)
        self._changed()

    @property
    def engine(self) -> str:
        """The name of the engine that computes the row: its version of MuJoCo."""
        return self._rows.engine.name

    @property
    def lanes(self) -> int:
        """How many rows each thread steps together, in the lanes of the CPU's vector unit; 0: each row alone."""
        return self._rows.lanes()[0]

    @property
    def lanes_reason(self) -> str:
        """Why rows are stepped one by one and not in lanes; "" if all are stepped in lanes."""
        return self._rows.lanes()[1]

    @property
    def lane_stages(self) -> dict[str, str]:
        """How lanes compute each stage of the model's step. Empty if the engine has no lanes.

        The values are "lanes", "row by row: WHY", "lanes; row by row: WHAT" or "absent".
        """
        return self._rows.lane_stages()

    @property
    def dt(self) -> float:
        """The seconds that one step simulates."""
        return self._rows.timestep(self._row) * self.frame_skip

    @property
    def init_qpos(self) -> Float64Array:
        """The model's positions, float64[nq], to which a reset adds noise; read-only."""
        return self._rows.init_qpos

    @property
    def init_qvel(self) -> Float64Array:
        """The model's velocities, float64[nv], which are zero."""
        return np.zeros(self.model.nv)

    @property
    def observation_structure(self) -> dict[str, int]:
        """The length of each part of the observation. As in Gymnasium only some ids have it."""
        structure = {field.name: field.count for field in self._rows.fields(Role.STRUCTURE)}
        if not structure:
            raise AttributeError(f"{self._rows.id} has no observation_structure")
        return structure

    def fields(self, kind: str) -> tuple[Field, ...]:
        """The fields of a kind, each with its name, shape, offset, count, type and doc.

        kind: "observation", "action", "info" or "reset_info" for the named parts, "data" or "model" for the arrays of
        MuJoCo, "parameters" for the live parameters, "groups" for the groups of the observation's terms.
        """
        roles = {"observation": Role.OBSERVATION, "action": Role.ACTION, "info": Role.INFO}
        roles |= {"reset_info": Role.RESET_INFO, "data": Role.DATA, "model": Role.MODEL, "parameters": Role.PARAMETERS}
        roles |= {"groups": Role.GROUPS}
        if kind not in roles:
            raise UnknownNameError(f"there are no fields of {kind!r}, but of {', '.join(roles)}", Status.E_NAME)
        return self._rows.fields(roles[kind])

    def set_state(self, qpos: ArrayLike, qvel: ArrayLike) -> None:
        """Sets qpos[nq] and qvel[nv] and computes everything that follows from them.

        The time and the step count do not change. An episode that has ended goes on.
        """
        self._check_settled()
        self._rows.set_state(self._row, qpos, qvel)
        self._changed()

    def do_simulation(self, ctrl: ArrayLike, n_frames: int) -> None:
        """Simulates n_frames mj_steps with ctrl[nu]. This is not a step of the episode and gives no reward."""
        self._check_settled()
        controls = np.ascontiguousarray(ctrl, np.float64)
        shape = (int(self._rows.value(Role.MODEL, "nu")),)
        if controls.shape != shape:
            raise InvalidValueError(
                f"ctrl has the shape {controls.shape}; {self._rows.id} takes {shape}", Status.E_SIZE
            )
        self._rows.simulate(self._row, controls, operator.index(n_frames))
        self._changed()

    def state_vector(self) -> Float64Array:
        """qpos followed by qvel, float64[nq + nv]."""
        data = self.data
        return np.concatenate([data.qpos, data.qvel])

    def get_body_com(self, body_name: str) -> Float64Array:
        """The position of a body's frame, float64[3], in metres."""
        position: Float64Array = self.data.body(body_name).xpos
        return position
