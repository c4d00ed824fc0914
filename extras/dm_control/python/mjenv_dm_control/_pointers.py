"""physics.model.ptr and physics.data.ptr: objects of MuJoCo's Python package, for programs that call its functions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi.declarations import Role
from mjenv.capi.engine import Engine, name_of
from mjenv.errors import EngineError
from mjenv.gym.env import Environment
from mjenv.registration import model_xml
from mjenv.rows.arrays import INPUTS

# Arrays of mjModel that are large, and the same in all rows.
_SHARED = ("mesh_", "skin_", "tex_", "flex", "bvh_", "oct_")
# Arrays of mjData whose number of rows depends on the contacts.
_COUNTED = ("contact.", "efc_", "iefc_")


class Pointers:
    """An mjModel and an mjData of MuJoCo's Python package that follow a simulation.

    model and data are brought up to date when they are read. `commit` writes to the simulation what the program, or
    functions of MuJoCo, have written to the inputs of data, such as xfrc_applied.
    """

    def __init__(self, env: Environment) -> None:
        self.exist = False  # whether model or data has been read
        self.buffer: dict[str, int] = {}  # vis.global_.offwidth and offheight, if the program has written them
        self._env, self.rows = env, env.handle
        self._package: Any = None  # mujoco, loaded when an object is first asked for
        self._model: Any = None
        self._data: Any = None
        self._inputs: dict[str, NDArray[Any]] = {}  # of data, as they were when data and the row were last equal
        self._has_model = self._has_state = False

    @property
    def model(self) -> Any:
        """The mujoco.MjModel, with the row's own values."""
        self._refresh()
        return self._model

    @property
    def data(self) -> Any:
        """The mujoco.MjData, with the row's arrays, and the contacts that mj_forward finds."""
        self._refresh()
        return self._data

    def commit(self) -> None:
        """Writes to the simulation the inputs that have been changed in data since `data` was last read."""
        if not self._inputs:
            return
        now = {name: np.array(getattr(self._data, name)) for name in self._inputs}
        written = {name for name, old in self._inputs.items() if now[name].tobytes() != old.tobytes()}
        if not written:
            return
        is_moved = bool(written & {"qpos", "qvel"})
        if is_moved:
            written |= {"qpos", "qvel", "qacc_warmstart"}  # what set_state changes
        values = {name: np.where(now[name] != self._inputs[name], now[name], self._value(name)) for name in written}
        self._inputs = now
        if is_moved:
            self._move(values.pop("qpos"), values.pop("qvel"))
        for name, new in values.items():
            self.rows.write(0, name, new)

    def _move(self, qpos: NDArray[Any], qvel: NDArray[Any]) -> None:
        """Sets positions and velocities, and computes what follows from them, as mj_forward does in data."""
        # In MuJoCo 2.2.2, each mj_forward normalises the quaternions of qpos, which can change their last bits. If that
        # is all that has changed, the row's own mj_forward does the same.
        self._env.set_state(self._value("qpos"), qvel)
        if not np.array_equal(self._value("qpos"), qpos):
            self._env.set_state(qpos, qvel)
        self._inputs["qpos"] = self._value("qpos")

    def release(self, model: bool = False) -> None:
        """Call this when the simulation changes; before a step, so that the step uses what was written to data.

        model: values of the model change, too.
        """
        self.commit()
        self._has_state = False
        self._has_model = self._has_model and not model

    def _value(self, name: str) -> NDArray[Any]:
        """The row's input."""
        return self.rows.value(Role.DATA, name, 0)

    def _refresh(self) -> None:
        if not self.exist:
            self._package = _package(self.rows.engine)
            self._model = self._package.MjModel.from_xml_string(model_xml(self.rows.id, self.rows.engine.name))
            self._data = self._package.MjData(self._model)
            self.exist = True
        self.rows.flush()
        self.commit()
        if self._has_model and self._has_state:
            return
        if not self._has_model:
            self._read_model()
        self._read_data()
        self._has_model = self._has_state = True

    def _read_data(self) -> None:
        fields = [field for field in self.rows.fields(Role.DATA) if not field.name.startswith(_COUNTED)]
        inputs = [field.name for field in fields if field.name in INPUTS]
        for name in inputs:
            _set(self._data, name, self._value(name))
        self._package.mj_forward(self._model, self._data)  # finds the contacts and their forces
        for field in fields:
            if field.shape and hasattr(self._data, field.name):
                _set(self._data, field.name, self._value(field.name))
        self._inputs = {name: np.array(getattr(self._data, name)) for name in inputs}

    def _read_model(self) -> None:
        for field in self.rows.fields(Role.MODEL):
            struct, _, name = field.name.rpartition(".")
            if struct in ("opt", "stat"):
                _set(getattr(self._model, struct), name, self.rows.read(0, field))
            elif not struct and not name.startswith(_SHARED) and isinstance(getattr(self._model, name), np.ndarray):
                _set(self._model, name, self.rows.read(0, field))
        for name, pixels in self.buffer.items():
            setattr(self._model.vis.global_, name, pixels)


def _set(struct: Any, name: str, values: NDArray[Any]) -> None:
    """Writes a member of a struct of MuJoCo's package: an array or a number."""
    member = getattr(struct, name)
    if isinstance(member, np.ndarray):
        member[...] = values
    else:
        setattr(struct, name, values.item())


def _package(engine: Engine) -> Any:
    """MuJoCo's Python package. Raises EngineError if it is missing, or is not that of the engine's MuJoCo."""
    needs = f'physics.model.ptr and physics.data.ptr need pip install "mujoco=={engine.name}.*"'
    try:
        import mujoco  # type: ignore[import-not-found, unused-ignore]
    except ImportError as error:
        raise EngineError(f"{needs} ({error})") from None
    if name_of(mujoco.__version__) != engine.name:
        raise EngineError(f"{needs}, not {mujoco.__version__}: mjenv computes with MuJoCo {engine.name}")
    if engine.name == "2.2.2" and not np.__version__.startswith("1."):
        raise EngineError(f'{needs} "numpy<2": with NumPy {np.__version__}, this mujoco reads its arrays wrongly')
    return mujoco
