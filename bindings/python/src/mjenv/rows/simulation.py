"""The attributes of env.unwrapped of Gymnasium's MuJoCo environments, for one environment and for a row of a vector."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache, cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mjenv.beside import listed, value_of
from mjenv.capi.declarations import Role, Status
from mjenv.capi.dtypes import Float64Array
from mjenv.capi.handle import GoalRewards, Rows
from mjenv.capi.schema import Field
from mjenv.errors import InvalidValueError, UnknownNameError
from mjenv.randomization import Delay, Draws, Noise, Push
from mjenv.rows.arrays import Arrays, Data, Model, Parameters

# Attributes that are set when an environment is built, and have no effect later.
_FIXED = ("frame_skip", "width", "height", "camera_id", "camera_name", "render_mode")


class OfRows:
    """What environments, vector environments and their rows say of the library's rows."""

    _rows: Rows

    def _check_settled(self) -> None:
        """Called before the whole state is read or changed. Raises if that is not allowed now."""

    @property
    def handle(self) -> Rows:
        """The rows in the C interface, for programs that call its functions."""
        return self._rows

    @property
    def engine(self) -> str:
        """The name of the engine that computes the rows: its version of MuJoCo."""
        return self._rows.engine.name

    @property
    def compute_reward(self) -> GoalRewards:
        """compute_reward(achieved_goal, desired_goal, info): the rewards (...) of goals (..., n) by the task's
        compute_reward, as gymnasium-robotics' GoalEnv has it. Environments of other tasks lack this attribute."""
        return self._rows.goal_rewards

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


class Whole(OfRows):
    """What single and vector environments have, and rows of vectors lack."""

    def _prepare(self) -> None:
        """Prepares the calls of steps, which depend on what they draw."""

    def randomize(self, draws: Draws | None) -> None:
        """Replaces the draws of resets. Takes the values of make's keyword randomize; None: resets draw nothing."""
        self._check_settled()
        self._rows.randomize(randomize=draws)

    @property
    def randomization(self) -> dict[str, Any]:
        """All draws, noise, delays and pushes that are set, as plain values (docs/randomisation.md, the document)."""
        return self._rows.randomization()

    def perturb(
        self, noise: Noise | None = None, delay: Delay | None = None, push: Push | Sequence[Push] | None = None
    ) -> None:
        """Ends the present noise, delays and pushes at once; the new ones act on each row from its next reset on.

        Takes the values of make's keywords.
        """
        self._check_settled()
        self._rows.randomize(noise=noise, delay=delay, push=push)
        self._prepare()

    def _repr_html_(self) -> str | None:
        """What Jupyter shows, if a program beside mjenv draws it."""
        return str(value_of("html_of")(self)) if "html_of" in listed("NAMES") else None


class Simulation(OfRows):
    """Access to the simulation of one row."""

    _row: int = 0
    _is_alone: bool = False  # whether no row has another reader (Arrays)
    frame_skip: int

    def _changed(self) -> None:
        """Called after the state was changed other than by a step or a reset."""

    @cached_property
    def data(self) -> Data:
        """The row's mjData. Its arrays show the present state, as those of MuJoCo's package do.

        Assignments to qpos, qvel, act, ctrl, time, qacc_warmstart, qfrc_applied, xfrc_applied, mocap_pos, mocap_quat or
        userdata, or to their elements, change the simulation. A reset clears the forces.
        """
        return Data(self._rows, self._row, self._changed, self._is_alone)

    @cached_property
    def model(self) -> Model:
        """The row's mjModel. Its arrays show the present values, as those of MuJoCo's package do.

        Assignments to arrays, their elements or options give the row its own values, which the next simulation uses:
        ``env.unwrapped.model.geom_friction[:, 0] *= 0.5``, ``env.unwrapped.model.opt.timestep = 0.002``.
        """
        return Model(self._rows, self._row, self._changed, self._is_alone)

    def set_constants(self) -> None:
        """Calls mj_setConst(model, data): computes anew what MuJoCo derives from masses, sizes and qpos0.

        The row ends in the position qpos_spring: reset it, or set its state.
        """
        self._check_settled()
        self._rows.set_constants(self._row)
        self._changed()

    @property
    def dt(self) -> float:
        """The seconds that one step simulates."""
        return self._read_timestep() * self.frame_skip

    @cached_property
    def _read_timestep(self) -> Callable[[], float]:
        """The function that reads the model's opt.timestep."""
        return self.model.opt._reader("timestep") if self._is_alone else partial(self._rows.timestep, self._row)

    def set_state(self, qpos: ArrayLike, qvel: ArrayLike) -> None:
        """Sets qpos[nq] and qvel[nv] and computes everything that follows from them.

        The time and the step count do not change. An episode that has ended goes on.
        """
        self._check_settled()
        self._rows.set_state(self._row, qpos, qvel)
        self._changed()

    def do_simulation(self, ctrl: ArrayLike, n_frames: int) -> None:
        """Simulates n_frames mj_steps with ctrl[nu]. This is not a step of the episode and gives no reward."""
        given = np.asarray(ctrl)
        if given.shape != self._rows.ctrl_shape:
            text = f"ctrl has the shape {given.shape}; {self._rows.id} takes {self._rows.ctrl_shape}"
            raise InvalidValueError(text, Status.E_SIZE)
        self._step_mujoco_simulation(given, n_frames)

    def _step_mujoco_simulation(self, ctrl: ArrayLike, n_frames: int) -> None:
        self._check_settled()
        self._rows.simulate(self._row, np.asarray(ctrl), operator.index(n_frames))
        self._changed()

    def state_vector(self) -> Float64Array:
        """qpos followed by qvel, float64[nq + nv]."""
        data = self.data
        return np.concatenate([data.qpos, data.qvel])

    def get_body_com(self, body_name: str) -> Float64Array:
        """The position of a body's frame, float64[3], in metres."""
        position: Float64Array = self.data.body(body_name).xpos
        return position

    # ---- functions of the mujoco package, which takes only its own mjModel and mjData ----

    def mj_resetData(self) -> None:  # noqa: N802 MuJoCo's name
        """Sets the model's initial state. What MuJoCo computes is 0 until it is computed again."""
        self._check_settled()
        self._rows.reset_data(self._row)
        self._changed()

    def mj_forward(self) -> None:
        """Computes what follows from the state, for instance after assignments to data.qpos."""
        self.set_state(self.data.qpos, self.data.qvel)

    def mj_step(self, nstep: int = 1) -> None:
        """Simulates nstep timesteps with data.ctrl."""
        self.do_simulation(self.data.ctrl, nstep)

    def mj_name2id(self, kind: str, name: str) -> int:
        """The number of the object with a name; -1 if there is none. kind: "body", "joint", "geom" and so on."""
        try:
            return self._rows.object_index(_kind_of(kind), name)
        except UnknownNameError:
            return -1

    def mj_id2name(self, kind: str, number: int) -> str | None:
        """The name of an object; None if it has none, or does not exist."""
        with suppress(UnknownNameError):
            return self._rows.object_name(_kind_of(kind), number) or None
        return None


@cache
def _kind_of(kind: Any) -> str:
    """The name of a kind of object, also for mujoco.mjtObj.mjOBJ_BODY."""
    return str(getattr(kind, "name", kind)).removeprefix("mjOBJ_").lower()


class TaskSimulation(Simulation):
    """The same, and what environments of the library's tasks have in addition."""

    @cached_property
    def parameters(self) -> Parameters:
        """The live parameters of the task: ``env.unwrapped.parameters["speed"] = 0.5``. Resets leave them."""
        return Parameters(Arrays(self._rows, self._row, Role.PARAMETERS, self._changed, "parameters."))

    @property
    def init_qpos(self) -> Any:
        """The model's positions, float64[nq], to which a reset adds noise; read-only."""
        return self._rows.init_qpos

    @property
    def init_qvel(self) -> Any:
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
        role = Role.__members__.get(str(kind).upper())
        if role is None:
            known = ", ".join(Role.__members__).lower()
            raise UnknownNameError(f"there are no fields of {kind!r}, but of {known}", Status.E_NAME)
        return self._rows.fields(role)

    # ---- the attributes in which Gymnasium's classes keep their options ----

    def __getattr__(self, name: str) -> Any:
        if hasattr(TaskSimulation, name):  # a property that raised: this raises its error again
            return getattr(TaskSimulation, name).__get__(self)
        option, rows = name.removeprefix("_"), self.__dict__.get("_rows")
        if rows is None or option == name or option not in rows.schema:
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        return self.parameters[option] if option in self.parameters else rows.options.get(option, rows.schema[option])

    def __setattr__(self, name: str, value: Any) -> None:
        option = name.removeprefix("_")
        if "_is_built" not in self.__dict__ or (name in self.__dict__ and name not in _FIXED):
            super().__setattr__(name, value)
        elif option in self.parameters:
            self.parameters[option] = value
        elif name in _FIXED or (option in self._rows.schema and name != "arrays"):
            raise AttributeError(
                f"{name!r} cannot be changed, because the library has it since the environment was built: "
                f"make another one, mjenv.make({self._rows.id!r}, {option}=...)"
            )
        else:
            super().__setattr__(name, value)
