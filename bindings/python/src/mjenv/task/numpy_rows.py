"""The rows of a NumPy task: the library simulates them, and the task computes over all of them at once.

After each step and reset, the task's methods compute the outputs that the library computes for other tasks, and these
outputs are written into the same mjenv_batch. So all code that uses Rows works with NumPy tasks, too.

The library's row holds the simulation, the random stream and the number of steps. This module holds the task's state,
and which episodes have ended, and appends them to the library's images.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from ctypes import byref, c_double, c_float, c_int64, c_uint8, c_uint64
from dataclasses import replace
from functools import partial
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from mjenv.capi import declarations
from mjenv.capi.declarations import Dtype, Role, Status
from mjenv.capi.dtypes import BOOL, Float64Array
from mjenv.capi.engine import ENGINES, Engine
from mjenv.capi.handle import Batch, Options, Rows, check_goals, open_rows, pointer_to
from mjenv.capi.keywords import RANDOMIZING
from mjenv.capi.schema import Field
from mjenv.capi.turns import Turn
from mjenv.errors import InvalidValueError, OptionError, ResetNeeded, SnapshotError, TaskError
from mjenv.rows.step import views
from mjenv.task import Random, Sim
from mjenv.task.registered import Checked, Registered, Resetting, out_of_bounds, overrides

BoolArray = NDArray[np.bool_]


# The options with which the library changes observations and actions, and the values that switch them off.
_OF_THE_LIBRARY = {"history": 0, "time_aware": False, "clip_actions": False, "rescale_actions": (0.0, 0.0)}


_PREFIX = "parameters."  # of the names of live parameters


def _works_only_in_code(id: str, name: str) -> str:
    return f"{id} is a NumPy task, which computes all rows at once: {name} works only with tasks in machine code"


class _Out:
    """The arrays that an mjenv_batch names; None where it names none."""

    def __init__(self, struct: Any, rows: Rows) -> None:
        count = struct.rows
        narrow = struct.obs_dtype == Dtype.FLOAT32

        def array(pointer: Any, size: int) -> Any:
            return np.ctypeslib.as_array(pointer, (size,)) if pointer and size else None

        def matrix(address: int | None) -> Any:
            size = count * struct.obs_count
            if not address or not size:
                return None
            kind: Any = c_float if narrow else c_double
            return np.ctypeslib.as_array((kind * size).from_address(address)).reshape(count, -1)

        def fields(pointer: Any, role: Role, size: int) -> dict[str, Float64Array]:
            values = array(pointer, count * size)
            if values is None:
                return {}
            found = rows.fields(role)
            return {field.name: view for field, view in zip(found, views(values, found, count), strict=True)}

        self.obs, self.final_obs = matrix(struct.obs), matrix(struct.final_obs)
        self.reward = array(struct.reward, count)
        self.terminated, self.truncated = array(struct.terminated, count), array(struct.truncated, count)
        self.status, self.was_reset = array(struct.status, count), array(struct.was_reset, count)
        self.info = fields(struct.info, Role.INFO, struct.info_count)
        self.final_info = fields(struct.final_info, Role.INFO, struct.info_count)
        self.reset_info = fields(struct.reset_info, Role.RESET_INFO, struct.reset_info_count)
        self.arrays = array(struct.arrays, count * struct.arrays_count)


class NumpyRows(Rows):
    """Rows whose observations, rewards and infos a NumPy task computes."""

    def __init__(
        self, registered: Registered, engine: Engine, id: str, options: Mapping[str, Any], count: int = 1
    ) -> None:
        for name in RANDOMIZING:
            if options.get(name) is not None:
                raise OptionError(_works_only_in_code(id, name))
        options = {name: value for name, value in options.items() if name not in RANDOMIZING}
        asked = Options(engine, id)
        asked.set(options)
        settings = {name: option.default for name, option in asked.schema().items()}
        for name, unused in _OF_THE_LIBRARY.items():
            if settings[name] != unused:
                raise OptionError(_works_only_in_code(id, name))
        names = dict.fromkeys((*registered.needs, *settings["arrays"].split()))
        self._autoreset: str = settings["autoreset_mode"]
        self._strict: bool = settings["strict"]
        self._task = registered.kind()
        self._maps = False
        # Random streams that have not yet been written to their rows: see _begin.
        self._due: dict[int, Any] = {}
        given = {**options, "autoreset_mode": "disabled", "arrays": " ".join(names)}
        given["max_contacts"] = settings["max_contacts"] or registered.kind.max_contacts
        self._resetting = Resetting(id, self._task) if registered.resets_rows else None
        registered.create(partial(super().__init__, engine, id, given, count), self._task, self._resetting)
        self.options = dict(options)
        self.has_goals = overrides(self._task, "compute_reward")
        self._checked = Checked(id, self._task, count)
        self._maps = overrides(self._task, "before_step")

        self._shapes = {
            role: {field.name: (count, *field.shape) for field in self.fields(role)}
            for role in (Role.INFO, Role.RESET_INFO)
        }
        self._width = sum(field.count for field in self.fields(Role.OBSERVATION))
        fields = self.fields(Role.ARRAYS)
        self._block = np.zeros(count * sum(field.count for field in fields))
        self._views = {f.name: view for f, view in zip(fields, views(self._block, fields, count), strict=True)}
        data = {field.name: field.count for field in self.fields(Role.DATA) if field.name.startswith("contact.")}
        self._whole = {name: np.zeros(data[name]) for name in self._views if name in data}
        self._inner = Batch(count, (0,), 0)
        struct = self._inner.struct
        struct.obs = struct.reward = struct.info = None
        struct.arrays_count = sum(field.count for field in fields)
        struct.arrays = pointer_to(self._block, c_double)

        # An image ends with the state, and then with whether each row's episode has ended.
        self._ended: BoolArray = np.zeros(count, np.bool_)
        self._state = {name: np.zeros((count, *shape)) for name, shape in registered.kind.state.items()}
        live = {field.name.removeprefix(_PREFIX): field for field in self.fields(Role.PARAMETERS)}
        self._parameters = {name: np.zeros((count, *field.shape)) for name, field in live.items()}
        self._read_parameters(range(count))
        model = {name: self.array(Role.MODEL, name) for name in registered.kind.own}
        self._own = {name: np.zeros((count, *field.shape)) for name, field in model.items() if field is not None}
        for row in range(count):
            self._read_own(row)
        self._shown_own = _OwnOfStep(self._own)
        self._drawing = _StepDraws(self)
        kick = np.zeros((count, self._task.nv))
        self._sim = Sim(self._views, self._state, self._parameters, self._shown_own, self._drawing, kick)
        self._streams: list[np.random.Generator] = []
        self._pristine = super().snapshot(0)  # of a row that was never reset

    # ---- outputs of all rows; the caller must have the turn ----

    def prepared(self, function: str, *arguments: Any) -> Callable[[], int]:
        *given, out = arguments
        found = _Out(out._obj, self)
        if function == "mjenv_reset":
            return partial(self._reset_all, None, found)
        assert function == "mjenv_step"
        _, address, size, code = given
        kind: Any = c_float if code == Dtype.FLOAT32 else c_double
        action = np.ctypeslib.as_array((kind * size).from_address(address)).reshape(self.count, -1)
        action.flags.writeable = False
        return partial(self._step, action, found)

    def reset(self, mask: BoolArray | None, out: Any) -> None:
        self._reset_all(mask, _Out(out._obj, self))

    def observe(self, out: Any) -> None:
        self.check(self.engine.mjenv_observe(self.pointer, byref(self._inner.struct)))
        found = _Out(out._obj, self)
        self._write_obs(found.obs, self._observations())
        if found.arrays is not None:
            found.arrays[...] = self._block

    def rollout(self, actions: NDArray[Any], steps: int, out: Any) -> None:
        self._refuse("rollout")

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> NDArray[Any]:
        achieved, desired = np.asarray(achieved_goal), np.asarray(desired_goal)
        check_goals(self.id, achieved, desired)
        rewards = np.asarray(self._task.compute_reward(achieved, desired, info))
        if rewards.shape != achieved.shape[:-1]:
            raise TaskError(
                f"{self.id}: compute_reward: returned the shape {rewards.shape}, not {achieved.shape[:-1]}",
                Status.E_TASK,
            )
        return rewards

    def check_sendable(self) -> None:
        self._refuse("send")

    def _refuse(self, name: str) -> NoReturn:
        raise TaskError(_works_only_in_code(self.id, name), Status.E_TASK)

    def _read_fields(self, role: Role) -> Iterator[Field]:
        for field in super()._read_fields(role):
            is_bool = role in (Role.INFO, Role.RESET_INFO) and field.type == Dtype.UINT8
            yield replace(field, type=BOOL) if is_bool else field

    def fields(self, role: Role) -> tuple[Field, ...]:
        bounds = self._task.action_bounds
        if role != Role.ACTION or not len(bounds):
            return super().fields(role)
        return tuple(Field(f"action[{i}]", (), i, 1, Dtype.ACTION, "") for i in range(len(bounds)))

    def bounds(self, role: Role) -> tuple[Float64Array, Float64Array]:
        bounds = self._task.action_bounds
        if role != Role.ACTION or not len(bounds):
            return super().bounds(role)
        low, high = np.array(bounds, np.float32).astype(np.float64).T.copy()
        return low, high

    def _ctrl(self, action: NDArray[Any], stepped: BoolArray) -> NDArray[Any]:
        """The ctrl that before_step returns for the action."""
        if self._strict and not np.isfinite(action[stepped]).all():
            row, index = np.argwhere(~np.isfinite(action) & stepped[:, None])[0]
            what = f"row {row}: action[{index}] is {action[row, index]}, but must be finite"
            raise InvalidValueError(f'{what}; set the option "strict" to 0 to allow it', Status.E_VALUE)
        ctrl = self._checked.before_step(self._sim, action)
        if self._strict and not np.isfinite(ctrl[stepped]).all():
            row, index = np.argwhere(~np.isfinite(ctrl) & stepped[:, None])[0]
            what = f"row {row}: {self.id}: before_step: ctrl[{index}] is {ctrl[row, index]}"
            raise TaskError(what, Status.E_TASK)
        return ctrl

    def _step(self, action: NDArray[Any], out: _Out) -> int:
        ended, inner = self._ended, self._inner
        resets = ended.copy()
        if self._autoreset != "next_step":
            if self._strict and ended.any():
                row = int(np.argmax(ended))
                raise ResetNeeded(f"row {row}: its episode has ended: reset it", Status.E_EPISODE_ENDED)
            resets[:] = False
        stepped = ~resets
        mask = None if stepped.all() else pointer_to(stepped, c_uint8)
        inner.ended[...] = False
        inner.status[...] = Status.OK
        # Rows that are about to be reset are not stepped, so what the task's step writes for them is undone below.
        kept = {name: self._state[name][resets] for name in self._task.kept} if resets.any() else {}
        ctrl = self._ctrl(action, stepped) if self._maps else action
        if stepped.any():
            code = Dtype.FLOAT32 if ctrl.dtype == np.float32 else Dtype.FLOAT64
            status = self.engine.mjenv_step(self.pointer, mask, ctrl.ctypes.data, ctrl.size, code, byref(inner.struct))
            ended[stepped] = (inner.ended[0] | inner.ended[1])[stepped]
            if status:
                self._task.carry(self._sim)  # because the rows that did not fail were stepped
                raise self.engine.last_error(status)
        self._sim.kick[...] = 0
        with self._drawing, self._shown_own as own:
            reward, terminated, infos = self._checked.step(self._sim, action)
            self._write_own(own, stepped)
            self._apply_kicks(stepped)
            self._drawing.keep(stepped)
        # Copies, because the task may have returned views of what carry and resets change.
        reward, infos = reward.copy(), self._infos(Role.INFO, "step", infos)
        self._carry(stepped)
        for name, values in kept.items():
            self._state[name][resets] = values
        if self._strict and np.isnan(reward[stepped]).any():
            row = int(np.argmax(np.isnan(reward) & stepped))
            raise TaskError(f"row {row}: {self.id}: step: the reward is NaN", Status.E_TASK)
        terminated, truncated = (terminated | inner.ended[0]) & stepped, inner.ended[1] & stepped
        ended[stepped] = (terminated | truncated)[stepped]
        final = None
        if self._autoreset == "same_step" and ended.any():
            resets, final = ended.copy(), self._observations().copy()
        reset_infos = self._begin(resets) if resets.any() else {}
        obs = self._observations()

        # Nothing fails from here on.
        if out.reward is not None:
            out.reward[...] = np.where(stepped, reward, 0)
        for to, flags in ((out.terminated, terminated), (out.truncated, truncated), (out.was_reset, resets)):
            if to is not None:
                to[...] = flags
        if out.status is not None:
            out.status[...] = inner.status
        self._write_info(out.info, infos, stepped if final is None else ~resets)
        if final is not None:
            if out.final_obs is not None:
                out.final_obs[resets] = final[resets]
            for name, to in out.final_info.items():
                to[resets] = infos[name][resets]
        for name, to in out.reset_info.items():
            if reset_infos:
                to[resets] = reset_infos[name][resets]
        self._write_obs(out.obs, obs)
        if out.arrays is not None:
            out.arrays[...] = self._block
        return Status.OK

    def _reset_all(self, mask: BoolArray | None, out: _Out) -> int:
        resets = np.ones(self.count, np.bool_) if mask is None else mask
        reset_infos = self._begin(resets)
        obs = self._observations()
        for to in (out.reward, out.terminated, out.truncated, out.status, *out.info.values()):
            if to is not None:
                to[resets] = 0
        if out.was_reset is not None:
            out.was_reset[resets] = True
        for name, to in out.reset_info.items():
            to[resets] = reset_infos[name][resets]
        if out.obs is not None:
            out.obs[resets] = obs[resets]
        if out.arrays is not None:
            out.arrays[...] = self._block
        return Status.OK

    def _begin(self, resets: BoolArray) -> dict[str, NDArray[Any]]:
        """Begins new episodes in these rows. Returns the infos of the reset; those of other rows are undefined."""
        if self._resetting is not None:
            return self._begin_each(resets, self._resetting)
        chosen = np.flatnonzero(resets)
        rows: list[int] = chosen.tolist()
        streams = self._load_streams(rows)
        kept = {name: self._state[name][chosen] for name in self._task.kept}
        parameters = {name: values[chosen] for name, values in self._parameters.items()}
        qpos, qvel, state = self._checked.reset(Random(streams, kept, parameters))
        self._checked.bounded("reset", state)
        qpos, qvel = np.ascontiguousarray(qpos), np.ascontiguousarray(qvel)
        words = [_words(stream) for stream in streams]
        image, size, nq, nv = self._pristine, len(self._pristine), qpos.shape[1], qvel.shape[1]
        self._ended[chosen] = True  # if an interrupt ends this call, the rows must be reset again
        for row, of_row, q, v in zip(rows, words, qpos, qvel, strict=True):
            # As in Gymnasium's reset_model, a new episode begins with the warm start of MuJoCo's solver that a row has
            # which was never reset. Its image replaces the row's stream, which is written back, by the next call if an
            # interrupt comes first.
            self._due[row] = of_row
            self.check(self.engine.mjenv_restore(self.pointer, row, image, size))
            self._give_due_streams()
            status = self.engine.mjenv_set_state(
                self.pointer, row, pointer_to(q, c_double), nq, pointer_to(v, c_double), nv
            )
            self.check(status)
            self._read_row(row)
        mask = pointer_to(resets, c_uint8)
        for name, live in self._parameters.items():  # the image has replaced them
            array, numbers = f"{_PREFIX}{name}".encode(), pointer_to(live, c_double)
            self.check(self.engine.mjenv_write(self.pointer, mask, array, numbers, live.size))
        for name, values in state.items():
            self._state[name][chosen] = values
        self._ended[chosen] = False
        self._carry(resets)
        return self._infos(Role.RESET_INFO, "reset_info", self._checked.reset_info(self._sim))

    def _begin_each(self, resets: BoolArray, resetting: Resetting) -> dict[str, NDArray[Any]]:
        """The same for a task with reset_row. A row that fails stays as it was."""
        for row in np.flatnonzero(resets).tolist():
            one = np.arange(self.count) == row
            resetting.error = None
            status = self.engine.mjenv_reset(self.pointer, pointer_to(one, c_uint8), None)
            if status and resetting.error is not None:
                raise resetting.error
            self.check(status)
            for name, values in resetting.state.items():
                self._state[name][row] = values[0]
            self._ended[row] = False
            self._read_row(row)
            self._read_own(row)
        self._carry(resets)
        return self._infos(Role.RESET_INFO, "reset_info", self._checked.reset_info(self._sim))

    def _read_own(self, row: int, *names: str) -> None:
        """Reads these own arrays of a row, or all of them."""
        count = c_int64()
        for name in names or self._own:
            values = self._own[name][row : row + 1]
            pointer = pointer_to(values, c_double)
            self.check(self.engine.mjenv_read(self.pointer, row, name.encode(), pointer, values.size, byref(count)))

    def _write_own(self, before: Mapping[str, Float64Array], rows: BoolArray) -> None:
        """Passes what the task's step has written to the library."""
        written: list[tuple[str, BoolArray]] = []
        try:
            for name, old in before.items():
                new = self._own[name]
                changed = rows & (new != old).reshape(self.count, -1).any(axis=1)
                new[~rows] = old[~rows]
                if changed.any():
                    self._write_array(name, new, changed)
                    written.append((name, changed))
                    for row in np.flatnonzero(changed).tolist():
                        self._read_own(row, name)  # the library has rounded float32 numbers
        except BaseException:
            for name, changed in written:
                self._write_array(name, before[name], changed)
            raise

    def _write_array(self, name: str, values: Float64Array, rows: BoolArray) -> None:
        numbers, mask = pointer_to(values, c_double), pointer_to(rows, c_uint8)
        self.check(self.engine.mjenv_write(self.pointer, mask, name.encode(), numbers, values.size))

    def _apply_kicks(self, rows: BoolArray) -> None:
        """Adds sim.kick, which the task's step has written, to the velocities."""
        kick = self._sim.kick
        kicked = rows & (kick != 0).any(axis=1)  # true for NaN, too, which the library then refuses
        if not kicked.any():
            return
        qvel, count = np.zeros_like(kick), c_int64()
        for row in np.flatnonzero(kicked).tolist():
            numbers = pointer_to(qvel[row], c_double)
            self.check(self.engine.mjenv_read(self.pointer, row, b"qvel", numbers, qvel.shape[1], byref(count)))
        np.add(qvel, kick, out=qvel, where=kick != 0)  # because -0.0 + 0.0 is 0.0
        mask, numbers = pointer_to(kicked, c_uint8), pointer_to(qvel, c_double)
        self.check(self.engine.mjenv_write(self.pointer, mask, b"qvel", numbers, qvel.size))
        if "qvel" in self._views:
            self._views["qvel"][kicked] = qvel[kicked]

    def _carry(self, rows: BoolArray) -> None:
        """Calls the task's carry, and checks the bounds of what it wrote for these rows."""
        self._task.carry(self._sim)
        self._checked.bounded("step or carry", {name: self._state[name][rows] for name in self._task.state_bounds})

    def _infos(self, role: Role, method: str, infos: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Copies of the infos, which must be those that the method returned when the environment was built."""
        shapes = self._shapes[role]
        found = {name: values.shape for name, values in infos.items()}
        if found != shapes:
            raise TaskError(f"{self.id}: {method}: the infos have the shapes {found}, not {shapes}", Status.E_TASK)
        return {name: values.copy() for name, values in infos.items()}

    def _observations(self) -> NDArray[Any]:
        obs = self._checked.observe(self._sim)
        if obs.shape[1] != self._width:
            raise TaskError(
                f"{self.id}: observe: returned {obs.shape[1]} numbers a row, not {self._width}", Status.E_TASK
            )
        if self._strict and np.isnan(obs).any():
            row, index = np.argwhere(np.isnan(obs))[0]
            raise TaskError(f"row {row}: {self.id}: observe: observation[{index}] is NaN", Status.E_TASK)
        return obs

    @staticmethod
    def _write_obs(to: NDArray[Any] | None, obs: NDArray[Any]) -> None:
        if to is not None:
            to[...] = obs

    @staticmethod
    def _write_info(out: Mapping[str, Float64Array], infos: Mapping[str, NDArray[Any]], mask: BoolArray) -> None:
        whole = mask.all()
        for name, to in out.items():
            if whole:
                to[...] = infos[name]
            else:
                to[mask] = infos[name][mask]
                to[~mask] = 0

    # ---- single rows ----

    def _read_row(self, row: int) -> None:
        """Reads the arrays of a row whose state was set."""
        count = c_int64()
        for name, array in self._views.items():
            values = array[row : row + 1].reshape(-1)
            whole = self._whole.get(name, values)  # an array of contacts may have room for the first ones only
            pointer = pointer_to(whole, c_double)
            self.check(self.engine.mjenv_read(self.pointer, row, name.encode(), pointer, whole.size, byref(count)))
            if whole is not values:
                values[...] = whole[: values.size]

    def _give_due_streams(self) -> None:
        for row, words in list(self._due.items()):
            self.check(self.engine.mjenv_set_stream(self.pointer, row, words, 6))
            del self._due[row]

    def enter(self) -> Turn:
        turn = [super().enter()]
        try:
            if self._due and self._pointer is not None:
                self._give_due_streams()
        except BaseException:
            self.leave(turn.pop())
            raise
        return turn.pop()

    def _load_streams(self, rows: Sequence[int]) -> list[np.random.Generator]:
        """The rows' random streams, as Generators of NumPy."""
        self._give_due_streams()
        while len(self._streams) < len(rows):
            self._streams.append(np.random.Generator(np.random.PCG64(0)))
        words = (c_uint64 * 6)()
        for row, stream in zip(rows, self._streams, strict=False):
            self.check(self.engine.mjenv_get_stream(self.pointer, row, words, 6))
            stream.bit_generator.state = {
                "bit_generator": "PCG64",
                "state": {"state": words[0] | words[1] << 64, "inc": words[2] | words[3] << 64},
                "has_uint32": words[4],
                "uinteger": words[5],
            }
        return self._streams[: len(rows)]

    def _read_parameters(self, rows: Iterable[int]) -> None:
        for name, values in self._parameters.items():
            for row in rows:
                values[row] = self._read(row, _PREFIX + name, values[row].size).reshape(values.shape[1:])

    def write(self, row: int, name: str, values: Any) -> None:
        super().write(row, name, values)
        if name.startswith(_PREFIX):
            self._read_parameters((row,))

    def write_rows(self, mask: BoolArray | None, name: str, values: Any) -> None:
        super().write_rows(mask, name, values)
        if name.startswith(_PREFIX):
            self._read_parameters(range(self.count) if mask is None else np.flatnonzero(mask).tolist())

    def set_state(self, row: int, qpos: Any, qvel: Any) -> None:
        super().set_state(row, qpos, qvel)
        self._changed(row)
        self._ended[row] = False

    def simulate(self, row: int, ctrl: Float64Array, frames: int) -> None:
        super().simulate(row, ctrl, frames)
        self._changed(row)

    def _changed(self, row: int) -> None:
        turn = [self.enter()]
        try:
            self._read_row(row)
            self._carry(np.arange(self.count) == row)
        finally:
            self.leave(turn.pop())

    def copy_row(self, source: int, mask: BoolArray) -> None:
        super().copy_row(source, mask)
        for values in (
            self._ended,
            *self._state.values(),
            *self._parameters.values(),
            *self._own.values(),
            *self._views.values(),
        ):
            values[mask] = values[source]

    # ---- images ----

    def snapshot(self, row: int) -> bytes:
        image = super().snapshot(row)
        part = slice(None) if row == declarations.ALL_ROWS else slice(row, row + 1)
        own = b"".join(values[part].tobytes() for values in (*self._state.values(), self._ended))
        return image + own + zlib.crc32(own).to_bytes(4, "little")

    def restore(self, row: int, image: bytes) -> None:
        part = slice(None) if row == declarations.ALL_ROWS else slice(row, row + 1)
        arrays: list[NDArray[Any]] = [values[part] for values in (*self._state.values(), self._ended)]
        size = sum(values.nbytes for values in arrays)
        split = len(image) - size - 4
        own = image[max(split, 0) : -4]
        if split < 0 or zlib.crc32(own).to_bytes(4, "little") != image[-4:]:
            raise SnapshotError("the image is damaged or belongs to another environment", Status.E_SNAPSHOT)
        restored: list[NDArray[Any]] = []
        start = 0
        for values in arrays:
            restored.append(np.frombuffer(own, values.dtype, values.size, start).reshape(values.shape))
            start += values.nbytes
        if outside := out_of_bounds(self._task, dict(zip(self._state, restored, strict=False))):
            raise SnapshotError(f"the image is damaged: {outside}", Status.E_SNAPSHOT)
        super().restore(row, image[:split])
        for values, numbers in zip(arrays, restored, strict=True):
            values[...] = numbers
        rows = range(self.count)[part]
        self._read_parameters(rows)
        for of_row in rows:
            self._read_own(of_row)
        turn = [self.enter()]
        try:
            if row == declarations.ALL_ROWS:
                self.check(self.engine.mjenv_observe(self.pointer, byref(self._inner.struct)))
            else:
                self._read_row(row)
        finally:
            self.leave(turn.pop())

    def __reduce__(self) -> tuple[Any, ...]:
        image = self.snapshot(declarations.ALL_ROWS)
        return _restored, (type(self._task), self.engine.name, self.id, self.options, self.count, image)


class _OwnOfStep(Mapping[str, Float64Array]):
    """The rows' own arrays, which step may write.

    Copies an array when the step looks it up, to restore it if the step fails. It does not copy all arrays, because
    copying all height fields would take longer than a step.
    """

    def __init__(self, arrays: Mapping[str, Float64Array]) -> None:
        self._arrays = arrays
        self._before: dict[str, Float64Array] | None = None  # None outside of step
        self._given: list[Float64Array] = []

    def __getitem__(self, name: str) -> Float64Array:
        view = self._arrays[name].view()
        if self._before is None:
            view.flags.writeable = False
            return view
        if name not in self._before:
            self._before[name] = view.copy()
        self._given.append(view)
        return view

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __enter__(self) -> Mapping[str, Float64Array]:
        self._before = {}
        return self._before

    def __exit__(self, error: type[BaseException] | None, *_: object) -> None:
        if error is not None:
            for name, values in (self._before or {}).items():
                self._arrays[name][...] = values
        for view in self._given:
            view.flags.writeable = False
        self._before, self._given = None, []


class _StepDraws(Random):
    """The streams of all rows, from which step draws. They are loaded when step first draws."""

    def __init__(self, rows: NumpyRows) -> None:
        super().__init__(())
        self._rows, self._loaded = rows, False

    @property
    def streams(self) -> tuple[np.random.Generator, ...]:
        if not self._loaded:
            self._streams, self._loaded = tuple(self._rows._load_streams(range(self._rows.count))), True
        return self._streams

    def keep(self, rows: BoolArray) -> None:
        """Writes the streams that the step has used back to these rows."""
        if self._loaded:
            for row in np.flatnonzero(rows).tolist():
                self._rows._due[row] = _words(self._streams[row])
            self._rows._give_due_streams()

    def __enter__(self) -> None:
        self._loaded = False

    def __exit__(self, *_: object) -> None:
        self._loaded = False


def _words(stream: np.random.Generator) -> Any:
    state: Any = stream.bit_generator.state
    numbers = state["state"]["state"], state["state"]["inc"]
    words = [number >> shift & 0xFFFFFFFFFFFFFFFF for number in numbers for shift in (0, 64)]
    return (c_uint64 * 6)(*words, state["has_uint32"], state["uinteger"])


def _restored(kind: type, engine: str, id: str, options: Mapping[str, Any], count: int, image: bytes) -> Rows:
    """kind is an argument so that unpickling imports its module, which registers the id."""
    rows = open_rows(ENGINES.get(engine), id, options, count)
    rows.restore(declarations.ALL_ROWS, image)
    return rows
