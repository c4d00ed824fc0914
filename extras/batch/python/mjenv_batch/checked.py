"""Calls the methods of a NumPy task, and checks what they return."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi.declarations import Status
from mjenv.capi.dtypes import Float64Array, laid_out
from mjenv.errors import TaskError
from mjenv.task import Task
from mjenv.task.registered import Build
from mjenv_batch.sim import Random, Sim
from mjenv_batch.start import Start


class Resetting:
    """Calls a NumPy task's reset_row for the library."""

    own: Mapping[str, tuple[int, ...]] = {}

    def __init__(self, id: str, task: Task) -> None:
        self._checked, self._task = Checked(id, task), task
        self.row = 0  # which it resets
        self.error: BaseException | None = None
        self.state: dict[str, Float64Array] = {}

    def reset_row(self, start: Start) -> None:
        task, checked = self._task, self._checked
        names = {name: shape for name, shape in task.state.items() if name not in task.kept}
        found = task.reset_row(start) or {}
        if not isinstance(found, dict) or set(found) != set(names):
            shown = sorted(found) if isinstance(found, dict) else _kind(found)
            raise checked.wrong("reset_row", f"the state is {shown}, not a dict of {sorted(names)}", self.row)
        self.state = {}
        for name, shape in names.items():
            self.state[name] = checked.floats("reset_row", name, found[name], shape, self.row)[None]
        checked.bounded("reset_row", self.state, (self.row,))


@dataclass
class NumpyBuild(Build):
    """An environment that is being built."""

    raises: bool = True
    resetting: Resetting | None = None  # of a task with reset_row
    width: int = 0  # how many numbers the task observes


class Checked:
    """Calls a NumPy task's methods and checks what they return."""

    def __init__(self, id: str, task: Task) -> None:
        self._id, self.task, self._rows = id, task, 0  # how many rows the arrays of the last sim have
        self.kind = type(task)
        # The groups of the observation and their lengths, which the first call of observe sets.
        self.groups: dict[str, int] = {}
        self._observed = False

    def reset(self, rng: Random, chosen: Any = (0,)) -> tuple[Float64Array, Float64Array, dict[str, Float64Array]]:
        """chosen: the rows whose episodes begin."""
        task, rows = self.task, rng.rows
        found = task.reset(rng, rows)
        names = tuple(name for name in self.kind.state if name not in self.kind.kept)
        kept = set(self.kind.kept)
        size = 3 if names else 2
        if not isinstance(found, tuple) or not (len(found) == size or (not names and len(found) == 3)):
            what = "qpos, qvel and a dict of the state" if names else "qpos and qvel"
            raise self.wrong("reset", f"returned {_kind(found)}, not {what}")
        qpos = self.floats("reset", "qpos", found[0], (rows, task.nq))
        qvel = self.floats("reset", "qvel", found[1], (rows, task.nv))
        for name, values in (("qpos", qpos), ("qvel", qvel)):
            if not (finite := np.isfinite(values).all(axis=1)).all():
                raise self.wrong("reset", f"{name} has a number that is not finite", chosen[np.argmin(finite)])
        given = found[2] if len(found) == 3 else {}
        if not isinstance(given, dict) or set(given) - kept != set(names):
            shown = sorted(given) if isinstance(given, dict) else _kind(given)
            raise self.wrong("reset", f"the state is {shown}, not a dict of {sorted(names)}")
        shapes = self.kind.state
        state = {name: self.floats("reset", name, values, (rows, *shapes[name])) for name, values in given.items()}
        return qpos, qvel, state

    def bounded(self, method: str, state: Mapping[str, Float64Array], rows: Any) -> None:
        """Fails if the method has written a number out of its bounds, because a snapshot would be refused."""
        for name in (name for name in self.task.state_bounds if name in state):
            (low, high), values = self.task.state_bounds[name], state[name].reshape(len(rows), -1)
            outside = ~((low <= values) & (values <= high))  # NaN, too
            if outside.any():
                row = rows[np.argmax(outside.any(axis=1))]
                raise self.wrong(method, f"the state {name!r} has {values[outside][0]}, not {low} to {high}", row)

    def observe(self, sim: Sim) -> NDArray[Any]:
        self._rows = len(sim.kick)
        found = self.task.observe(sim)
        given = {f"group {name!r} is": part for name, part in found.items()} if isinstance(found, Mapping) else None
        parts = [self._numbers(what, part) for what, part in ({"returned": found} if given is None else given).items()]
        groups = {name: part.shape[1] for name, part in zip(found, parts, strict=True)} if given is not None else {}
        if self._observed and list(groups.items()) != list(self.groups.items()):
            raise self.wrong("observe", f"returned the groups {groups}, but at first {self.groups}")
        self.groups, self._observed = groups, True
        return np.concatenate(parts, axis=1) if parts else np.zeros((self._rows, 0))

    def _numbers(self, what: str, values: Any) -> NDArray[Any]:
        array = np.asarray(values)
        if array.ndim != 2 or len(array) != self._rows or array.dtype.kind not in "fiub":
            raise self.wrong("observe", f"{what} {_kind(array)}, not numbers of the shape ({self._rows}, n)")
        return array

    def reset_info(self, sim: Sim) -> dict[str, NDArray[Any]]:
        self._rows = len(sim.kick)
        return self._infos("reset_info", self.task.reset_info(sim))

    def before_step(self, sim: Sim, action: NDArray[Any]) -> NDArray[Any]:
        self._rows = len(sim.kick)
        ctrl = np.asarray(self.task.before_step(sim, action))
        if ctrl.shape != (self._rows, self.task.nu) or ctrl.dtype.kind not in "fiub":
            raise self.wrong(
                "before_step", f"ctrl is {_kind(ctrl)}, not numbers of the shape {(self._rows, self.task.nu)}"
            )
        return laid_out(ctrl, ctrl.dtype if ctrl.dtype == np.float32 else np.float64)

    def step(self, sim: Sim, action: NDArray[Any]) -> tuple[Float64Array, NDArray[np.bool_], dict[str, NDArray[Any]]]:
        self._rows = len(sim.kick)
        found = self.task.step(sim, action)
        if not isinstance(found, tuple) or len(found) != 3:
            raise self.wrong("step", f"returned {_kind(found)}, not a reward, terminated and an info")
        reward = self.floats("step", "the reward", found[0], (self._rows,))
        terminated = np.asarray(found[1])
        if terminated.dtype != np.bool_ or terminated.shape != (self._rows,):
            raise self.wrong("step", f"terminated is {_kind(terminated)}, not bool of the shape {(self._rows,)}")
        return reward, terminated, self._infos("step", found[2])

    def _infos(self, method: str, infos: Any) -> dict[str, NDArray[Any]]:
        if not isinstance(infos, dict):
            raise self.wrong(method, f"the info is {_kind(infos)}, not a dict of arrays")
        arrays = {name: np.asarray(values) for name, values in infos.items()}
        for name, values in arrays.items():
            if not values.ndim or len(values) != self._rows or values.dtype.kind not in "fiub":
                raise self.wrong(
                    method, f"info {name!r} is {_kind(values)}, not numbers of the shape ({self._rows}, ...)"
                )
        return arrays

    def floats(
        self, method: str, what: str, values: Any, shape: tuple[int, ...], row: int | None = None
    ) -> Float64Array:
        array = np.asarray(values)
        if array.shape != shape or array.dtype.kind not in "fiub":
            raise self.wrong(method, f"{what} is {_kind(array)}, not numbers of the shape {shape}", row)
        return array.astype(np.float64, copy=False)

    def wrong(self, method: str, why: str, row: int | None = None) -> TaskError:
        return TaskError(f"{'' if row is None else f'row {row}: '}{self._id}: {method}: {why}", Status.E_TASK)


def _kind(value: Any) -> str:
    """Describes a value that a method returned, for error messages."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} of the shape {value.shape}"
    return f"{len(value)} values" if isinstance(value, tuple) else type(value).__name__
