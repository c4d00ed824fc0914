"""The rows of a NumPy task: the library simulates them, and the task computes over all of them at once.

A step is mjenv_act, the task's before_step, mjenv_advance, the task's step, carry and observe, and mjenv_finish, which
does what the library does for other tasks. So all code that uses Rows works with NumPy tasks, too.

The task's state stands here, in arrays of all rows. The library's rows carry it in images alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from ctypes import byref, c_double, c_float, c_int64, c_uint8, c_uint64
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi import declarations
from mjenv.capi.declarations import Distribution, Dtype, Role, Status
from mjenv.capi.dtypes import BOOL, FLOATS, Float64Array
from mjenv.capi.engine import Engine
from mjenv.capi.handle import Batch, Options, Rows, check_goals, in_turn, pcg64_of, pointer_to, words_of
from mjenv.capi.keywords import RANDOMIZING
from mjenv.capi.schema import Field
from mjenv.capi.turns import Turn
from mjenv.errors import ResetNeeded, TaskError
from mjenv.rows.arrays import INPUTS
from mjenv.rows.step import views
from mjenv.task.registered import Registered, overrides
from mjenv_batch.checked import Checked, NumpyBuild, Resetting
from mjenv_batch.sim import Drawing, Random, Sim, Size

BoolArray = NDArray[np.bool_]

_PREFIX = "parameters."  # of the names of live parameters
_MODEL = "model."  # of what a task needs of mjModel
_BLOCKS = {"info": Role.INFO, "arrays": Role.ARRAYS}


class _Out:
    """A caller's mjenv_batch."""

    def __init__(self, struct: Any, rows: Rows) -> None:
        self.struct, self._rows, count = type(struct).from_buffer_copy(struct), rows, rows.count
        self.was_reset = np.zeros(count, np.bool_)
        if struct.was_reset:
            self.was_reset = np.ctypeslib.as_array(struct.was_reset, (count,)).view(np.bool_)
        elif count == struct.rows:
            self.struct.was_reset = pointer_to(self.was_reset, c_uint8)

    def arrays(self, *names: str) -> dict[str, NDArray[Any]]:
        """The arrays that have these names and are not NULL: (rows, ...). Blocks of fields have one for each field."""
        struct = self.struct
        found: dict[str, NDArray[Any]] = {}
        for name in names:
            pointer = getattr(struct, name)
            if name in _BLOCKS and pointer:
                size = self._rows.size(_BLOCKS[name]) * struct.rows
                block = np.ctypeslib.as_array(pointer, (size,)) if size else np.zeros(0)
                parts = views(block, self._rows.fields(_BLOCKS[name]), struct.rows)
                found |= {f"{name}.{field}": part for field, part in parts.items()}
            elif name == "obs" and pointer and struct.obs_count:
                kind: Any = c_float if struct.obs_dtype == Dtype.FLOAT32 else c_double
                numbers = (kind * (struct.rows * struct.obs_count)).from_address(pointer)
                found[name] = np.ctypeslib.as_array(numbers).reshape(struct.rows, -1)
            elif name not in ("obs", *_BLOCKS) and pointer:
                found[name] = np.ctypeslib.as_array(pointer, (struct.rows,))
        return found


class NumpyRows(Rows):
    """Rows whose observations, rewards and infos a NumPy task computes."""

    _open = False  # whether the library may wait for outputs that the task has not computed

    def __init__(
        self, registered: Registered, engine: Engine, id: str, options: Mapping[str, Any], count: int = 1
    ) -> None:
        asked = Options(engine, id)
        asked.set({name: value for name, value in options.items() if name not in RANDOMIZING})
        settings = {name: option.default for name, option in asked.schema().items()}
        of_model = [name for name in registered.needs if name.startswith(_MODEL)]
        names = dict.fromkeys((*registered.needs, *settings["arrays"].split()))
        self._same_step = settings["autoreset_mode"] == "same_step"
        self._task = registered.kind()
        given = {**options, "arrays": " ".join(name for name in names if name not in of_model)}
        given["max_contacts"] = settings["max_contacts"] or registered.kind.max_contacts
        self._resetting = Resetting(id, self._task) if overrides(self._task, "reset_row") else None
        now = NumpyBuild(self._task, resetting=self._resetting)
        try:
            registered.create(partial(super().__init__, engine, id, given, count), now)
            width = now.width
        finally:
            del now  # breaks the cycle of its error, the traceback and this frame
        self.options = dict(options)
        self.has_goals = overrides(self._task, "compute_reward")
        self._checked = Checked(id, self._task)
        self._maps = overrides(self._task, "before_step")

        # What the task has computed, which mjenv_finish reads.
        self._given = Batch(count, (width,), self.size(Role.INFO))
        self._given.struct.reset_info_count = self.size(Role.RESET_INFO)
        self._reset_info = np.zeros(count * self.size(Role.RESET_INFO))
        self._given.struct.reset_info = pointer_to(self._reset_info, c_double)
        blocks = {Role.INFO: self._given.info, Role.RESET_INFO: self._reset_info}
        self._infos = {role: views(block, self.fields(role), count) for role, block in blocks.items()}

        # What mjenv_begin and mjenv_advance write.
        self._block = np.zeros(count * self.size(Role.ARRAYS))
        self._views = views(self._block, self.fields(Role.ARRAYS), count)
        data = {field.name: field.count for field in self.fields(Role.DATA) if field.name.startswith("contact.")}
        self._whole = {name: np.zeros(data[name]) for name in self._views if name in data}
        self._inner = Batch(count, (0,), 0)
        struct = self._inner.struct
        struct.obs = struct.reward = struct.info = struct.terminated = struct.truncated = None
        struct.arrays_count = self.size(Role.ARRAYS)
        struct.arrays = pointer_to(self._block, c_double)
        self._was_reset = np.zeros(count, np.bool_)
        struct.was_reset = pointer_to(self._was_reset, c_uint8)
        # The rows that failed in this call, and why.
        self._failed: BoolArray = np.zeros(count, np.bool_)
        self._failure: int = Status.OK
        # The rows that were written since the task saw them.
        self._unseen: BoolArray = np.zeros(count, np.bool_)

        self._state = {name: np.zeros((count, *shape)) for name, shape in registered.kind.state.items()}
        self._qpos, self._qvel = np.zeros((count, self._task.nq)), np.zeros((count, self._task.nv))
        live = {field.name.removeprefix(_PREFIX): field for field in self.fields(Role.PARAMETERS)}
        self._parameters = {name: np.zeros((count, *field.shape)) for name, field in live.items()}
        self._read_parameters(range(count))
        model = {name: self.array(Role.MODEL, name.removeprefix(_MODEL)) for name in (*registered.kind.own, *of_model)}
        arrays = {name: np.zeros((count, *field.shape)) for name, field in model.items() if field is not None}
        self._own = {name: arrays[name] for name in registered.kind.own}
        self._needed = {name: arrays[name] for name in of_model}
        self._views |= self._needed
        self._read_model(self._named(None), range(count))
        self._shown_own = _OwnOfStep(self._own)
        self._drawing = _RowDraws(self, np.arange(count))
        self._kick = np.zeros((count, self._task.nv))
        self._sim = Sim(self._views, self._state, self._parameters, self._shown_own, self._drawing, self._kick)

    # ---- outputs of all rows; the caller must have the turn ----

    def prepared(self, function: str, *arguments: Any) -> Callable[[], int]:
        *given, out = arguments
        found = _Out(out._obj, self)
        if function == "mjenv_reset":
            return partial(self._reset, np.ones(self.count, np.bool_), found)
        assert function == "mjenv_step"
        _, address, size, code = given
        kind: Any = c_float if code == Dtype.FLOAT32 else c_double
        action = np.ctypeslib.as_array((kind * size).from_address(address)).reshape(self.count, -1)
        return partial(self._step, action, found)

    def reset(self, mask: BoolArray | None, out: Any) -> None:
        resets = np.ones(self.count, np.bool_) if mask is None else mask.copy()
        self.check(self._reset(resets, _Out(out._obj, self)))

    def observe(self, out: Any) -> None:
        self._give_up()
        self.check(self.engine.mjenv_observe(self.pointer, byref(self._inner.struct)))
        self._given.obs[...] = self._observations(self._sim)
        found = _Out(out._obj, self)
        self._finish(None, found)
        self._show_arrays(found)

    def observe_row(self, row: int, out: Any) -> None:
        self._give_up()
        self.check(self.engine.mjenv_observe_row(self.pointer, row, byref(self._inner.struct)))
        chosen = np.array([row])
        self._given.obs[chosen] = self._observations(self._sim_of(chosen)[0])
        found = _Out(out._obj, self)
        self._finish(self.only(row), found)
        self._show_arrays(found)

    def rollout(self, actions: NDArray[Any], steps: int, out: Any) -> None:
        self._give_up()
        actions = actions.reshape(self.count, steps, -1)
        for t in np.flatnonzero(~np.isfinite(actions).all(axis=(0, 2))).tolist():
            self._act(None, np.ascontiguousarray(actions[:, t]))  # refuses now what the step would refuse
        whole, struct = _Out(out._obj, self), out._obj
        batch = Batch(self.count, (struct.obs_count,), struct.info_count, struct.obs_dtype)  # of one step
        batch.struct.arrays, batch.struct.arrays_count = self._inner.struct.arrays, self._inner.struct.arrays_count
        for name in ("obs", "info"):
            if not getattr(struct, name):
                setattr(batch.struct, name, None)
        one = _Out(batch.struct, self)
        names = ("obs", "reward", "terminated", "truncated", "status", "was_reset", "info", "arrays")
        to, of_step = whole.arrays(*names), one.arrays(*names)
        # Rows whose episode goes on, and rows that have not failed.
        playing, alive = np.ones(self.count, np.bool_), np.ones(self.count, np.bool_)
        failure: int = Status.OK
        for t in range(steps):
            if playing.any():
                self._begin_call()
                advanced = self._play(playing, np.ascontiguousarray(actions[:, t]), one)
                failure = failure or self._failure
                if (waits := self._was_reset & playing).any():
                    what = f"row {int(np.argmax(waits))}: its episode has ended: reset it"
                    raise ResetNeeded(what, Status.E_EPISODE_ENDED)
                self._given.obs[...] = self._observations(self._sim)
                self._finish(advanced, one)
                batch.status[playing & ~advanced] = self._inner.status[playing & ~advanced]
                one.was_reset[...] = False
            for name, values in to.items():
                written = alive if name == "status" else alive & ~(playing & ~advanced)
                values.reshape(self.count, steps, *values.shape[1:])[written, t] = of_step[name][written]
            alive &= ~playing | advanced
            playing &= advanced & ~batch.ended.any(axis=0)
            batch.status[~playing] = Status.OK
            for name, values in of_step.items():  # of the steps after the end of an episode
                if name == "reward" or name.startswith("info."):
                    values[~playing] = 0
        self.check(failure)

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
        what = "is a NumPy task, which computes all rows at once: send works only with tasks in machine code"
        raise TaskError(f"{self.id} {what}", Status.E_TASK)

    def fields(self, role: Role) -> tuple[Field, ...]:
        found = super().fields(role)
        if role not in (Role.INFO, Role.RESET_INFO):
            return found
        return tuple(replace(one, type=BOOL) if one.type == Dtype.UINT8 else one for one in found)

    def _step(self, action: NDArray[Any], out: _Out) -> int:
        self._begin_call()
        self._play(None, action, out)
        begun = self._begin(self._was_reset.copy())[0] if self._was_reset.any() else np.zeros(0, np.intp)
        self._given.obs[...] = self._observations(self._sim)
        self._finish(None, out)
        self._read_model(self._needed, begun.tolist())  # a reset's observation sees what was before its draws
        if self._same_step and out.was_reset.any():
            self._reset_rows(out.was_reset.copy(), out)
        return self._end(out)

    def _reset(self, resets: BoolArray, out: _Out) -> int:
        self._begin_call()
        self._reset_rows(resets, out)
        return self._end(out)

    def _show_arrays(self, out: _Out) -> None:
        if out.struct.arrays and self._block.size:
            np.ctypeslib.as_array(out.struct.arrays, self._block.shape)[...] = self._block

    def _end(self, out: _Out) -> int:
        self._show_arrays(out)
        if self._failure:
            for name, values in out.arrays("status", "reward", "terminated", "truncated", "was_reset").items():
                values[self._failed] = self._inner.status[self._failed] if name == "status" else 0
        return self._failure

    # ---- the parts of resets and steps ----

    def _act(self, mask: Any, action: NDArray[Any]) -> NDArray[Any]:
        """What the task sees of the action."""
        seen = np.zeros_like(action)
        code, to = FLOATS[action.dtype], seen.ctypes.data
        self.check(self.engine.mjenv_act(self.pointer, mask, action.ctypes.data, action.size, code, to))
        seen.flags.writeable = False
        return seen

    def _play(self, playing: BoolArray | None, action: NDArray[Any], out: _Out) -> BoolArray:
        """Simulates a step of the playing rows, and calls the task's step. Returns which rows it has advanced."""
        mask = None if playing is None else pointer_to(playing, c_uint8)
        seen = self._act(mask, action)
        self._show_unseen()
        before = {name: values.copy() for name, values in self._state.items()}
        ctrl, size = None, 0
        if self._maps:
            mapped = self._checked.before_step(self._sim, seen).astype(np.float64, copy=False)
            ctrl, size = pointer_to(mapped, c_double), mapped.size
        given = mask, action.ctypes.data, action.size, FLOATS[action.dtype], ctrl, size, byref(self._inner.struct)
        self._simulate(self.engine.mjenv_advance, *given)
        advanced = ~(self._was_reset | self._failed)
        if playing is not None:
            advanced &= playing
        self._kick[...] = 0
        undone = np.ones(self.count, np.bool_)  # the rows whose state the task does not change: all, if it fails
        try:
            with self._drawing, self._shown_own as own:
                reward, terminated, infos = self._checked.step(self._sim, seen)
                self._write_own(own, advanced)
                self._apply_kicks(advanced)
                self._drawing.keep(advanced)
            self._given.reward[...], self._given.ended[0] = reward, terminated
            self._put(Role.INFO, "step", infos, slice(None))
            self._carried(np.flatnonzero(advanced))
            undone = ~advanced
        finally:
            for name, values in before.items():
                self._state[name][undone] = values[undone]
        return advanced

    def _simulate(self, function: Callable[..., int], *arguments: Any) -> None:
        """Calls mjenv_begin or mjenv_advance. Rows may fail while others are simulated."""
        self._open = True
        status = function(self.pointer, *arguments)
        before, self._failed = self._failed, self._inner.status < 0
        if status and (before == self._failed).all():
            self.check(status)
        self._failure = self._failure or status

    def _finish(self, mask: BoolArray | None, out: _Out) -> None:
        struct = type(out.struct).from_buffer_copy(out.struct)
        struct.arrays = None  # those of _inner
        rows = None if mask is None else pointer_to(mask, c_uint8)
        self.check(self.engine.mjenv_finish(self.pointer, rows, byref(self._given.struct), byref(struct)))
        self._open = False

    def _begin_call(self) -> None:
        self._give_up()
        self._inner.status[...] = Status.OK
        self._was_reset[...] = self._failed[...] = False
        self._failure = Status.OK

    def _give_up(self) -> None:
        """Ends a step or reset in which the task has raised an exception or an interrupt has come."""
        if self._open and not self.closed:
            self.check(self.engine.mjenv_finish(self.pointer, None, None, None))
            self._open = False

    def _reset_rows(self, resets: BoolArray, out: _Out) -> None:
        chosen, sim = self._begin(resets)
        if len(chosen):
            self._given.obs[chosen] = self._observations(sim)
            self._finish(resets, out)
            self._read_model(self._needed, chosen.tolist())

    def _begin(self, resets: BoolArray) -> tuple[NDArray[np.intp], Sim]:
        """Begins new episodes in these rows. Returns the rows and their simulations. Rows that fail leave the mask."""
        chosen = np.flatnonzero(resets)
        if self._resetting is None:
            kept = {name: self._state[name][chosen] for name in self._task.kept}
            parameters = {name: values[chosen] for name, values in self._parameters.items()}
            draws = _RowDraws(self, chosen, kept, parameters)
            qpos, qvel, state = self._checked.reset(draws, chosen)
            self._checked.bounded("reset", state, chosen)
            draws.keep(np.ones(len(chosen), np.bool_))
            self._qpos[chosen], self._qvel[chosen] = qpos, qvel
            self._begin_masked(resets, self._qpos, self._qvel)
            for name, values in state.items():
                self._state[name][chosen] = values
        else:
            for row in chosen.tolist():
                self._resetting.row, self._resetting.error = row, None
                self._begin_masked(self.only(row))
                if self._resetting.error is not None:
                    raise self._resetting.error
                for name, values in self._resetting.state.items() if not self._failed[row] else ():
                    self._state[name][row] = values[0]
        resets &= ~self._failed
        chosen = np.flatnonzero(resets)
        self._unseen[chosen] = False
        self._read_model(self._own, chosen.tolist())
        sim = self._carried(chosen)
        if len(chosen):
            self._put(Role.RESET_INFO, "reset_info", self._checked.reset_info(sim), chosen)
        return chosen, sim

    def _begin_masked(self, mask: BoolArray, *states: Float64Array) -> None:
        given: list[Any] = [each for values in states for each in (pointer_to(values, c_double), values.size)]
        given = given or [None, 0, None, 0]
        self._simulate(self.engine.mjenv_begin, pointer_to(mask, c_uint8), *given, byref(self._inner.struct))

    def _carried(self, chosen: NDArray[np.intp]) -> Sim:
        """The simulations of these rows, after the task's carry."""
        sim, state = self._sim, self._state
        if len(chosen) < self.count:
            sim, state = self._sim_of(chosen)
        if len(chosen):
            self._task.carry(sim)
            self._checked.bounded("step or carry", state, chosen)
        if sim is not self._sim:
            for name, values in state.items():
                self._state[name][chosen] = values
        return sim

    def _sim_of(self, chosen: NDArray[np.intp]) -> tuple[Sim, dict[str, Float64Array]]:
        """The simulations of these rows, and the task's state in them."""
        arrays, parameters, state = (
            {name: values[chosen] for name, values in of.items()} for of in (self._views, self._parameters, self._state)
        )
        own, kick = _OwnOfStep(self._own, chosen), np.zeros((len(chosen), self._task.nv))
        return Sim(arrays, state, parameters, own, Random(()), kick), state

    def _observations(self, sim: Sim) -> NDArray[Any]:
        obs, width = self._checked.observe(sim), self._given.obs.shape[1]
        if obs.shape[1] != width:
            raise TaskError(f"{self.id}: observe: returned {obs.shape[1]} numbers a row, not {width}", Status.E_TASK)
        return obs

    def _put(self, role: Role, method: str, infos: Mapping[str, NDArray[Any]], rows: Any) -> None:
        """Stores the infos of these rows, which must be those that the method returned when it was built."""
        places = {name: view[rows] for name, view in self._infos[role].items()}
        shapes, found = ({name: values.shape for name, values in of.items()} for of in (places, infos))
        if found != shapes:
            raise TaskError(f"{self.id}: {method}: the infos have the shapes {found}, not {shapes}", Status.E_TASK)
        for name, values in infos.items():
            self._infos[role][name][rows] = values

    def _read_model(self, arrays: Mapping[str, Float64Array], rows: Iterable[int]) -> None:
        """Reads rows' arrays of mjModel."""
        count = c_int64()
        for name, array in arrays.items():
            for row in rows:
                values = array[row : row + 1]
                of_row = name.removeprefix(_MODEL).encode(), pointer_to(values, c_double), values.size, byref(count)
                self.check(self.engine.mjenv_read(self.pointer, row, *of_row))

    def _named(self, name: str | None) -> dict[str, Float64Array]:
        """The task's arrays of mjModel with this name, or all."""
        arrays = {**self._own, **self._needed}
        return {key: array for key, array in arrays.items() if name in (None, key.removeprefix(_MODEL))}

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
                    # The library has rounded float32 numbers.
                    self._read_model(self._named(name), np.flatnonzero(changed).tolist())
        except BaseException:
            for name, changed in written:
                self._write_array(name, before[name], changed)
            raise

    def _write_array(self, name: str, values: Float64Array, rows: BoolArray) -> None:
        numbers, mask = pointer_to(values, c_double), pointer_to(rows, c_uint8)
        self.check(self.engine.mjenv_write(self.pointer, mask, name.encode(), numbers, values.size))

    def _apply_kicks(self, rows: BoolArray) -> None:
        """Adds sim.kick, which the task's step has written, to the velocities."""
        kick = self._kick
        kicked = rows & (kick != 0).any(axis=1)  # true for NaN, too, which the library then refuses
        if not kicked.any():
            return
        qvel, count = np.zeros_like(kick), c_int64()
        for row in np.flatnonzero(kicked).tolist():
            numbers = pointer_to(qvel[row], c_double)
            self.check(self.engine.mjenv_read(self.pointer, row, b"qvel", numbers, qvel.shape[1], byref(count)))
        np.add(qvel, kick, out=qvel, where=kick != 0)  # because -0.0 + 0.0 is 0.0
        self._write_array("qvel", qvel, kicked)
        if "qvel" in self._views:
            self._views["qvel"][kicked] = qvel[kicked]

    # ---- single rows ----

    def _read_row(self, row: int) -> None:
        """Reads the arrays of a row whose state was set."""
        count = c_int64()
        for name, array in self._views.items():
            values = array[row : row + 1].reshape(-1)
            whole = self._whole.get(name, values)  # an array of contacts may have room for the first ones only
            of_row = pointer_to(whole, c_double), whole.size, byref(count)
            self.check(self.engine.mjenv_read(self.pointer, row, name.removeprefix(_MODEL).encode(), *of_row))
            if whole is not values:
                values[...] = whole[: values.size]

    def enter(self) -> Turn:
        turn = [super().enter()]
        try:
            self._give_up()
        except BaseException:
            self.leave(turn.pop())
            raise
        return turn.pop()

    def _read_parameters(self, rows: Iterable[int]) -> None:
        for name, values in self._parameters.items():
            for row in rows:
                values[row] = self._numbers(row, _PREFIX + name, values[row].size).reshape(values.shape[1:])

    def _numbers(self, row: int, name: str, size: int) -> Float64Array:
        values = np.empty(size)
        self.call(self.engine.mjenv_read, row, name.encode(), pointer_to(values, c_double), size, byref(c_int64()))
        return values

    def is_copied(self, name: str) -> bool:
        return name in INPUTS or name.startswith(_PREFIX) or bool(self._named(name))

    def write(self, row: int, name: str, values: Any, by_reader: bool = False) -> None:
        super().write(row, name, values, by_reader)
        self._refresh((row,), name)

    def write_rows(self, mask: BoolArray | None, name: str, values: Any, by_reader: bool = False) -> None:
        super().write_rows(mask, name, values, by_reader)
        self._refresh(range(self.count) if mask is None else np.flatnonzero(mask).tolist(), name)

    def set_constants(self, row: int) -> None:
        super().set_constants(row)
        self._refresh(range(self.count) if row == declarations.ALL_ROWS else (row,))

    def _refresh(self, rows: Iterable[int], name: str | None = None) -> None:
        if name is not None and name.startswith(_PREFIX):
            self._read_parameters(rows)
        else:
            self._read_again(name, rows)

    @in_turn
    def _read_again(self, name: str | None, rows: Iterable[int]) -> None:
        self._unseen[[*rows]] = True
        self._read_model(self._named(name), rows)

    def _show_unseen(self) -> None:
        """Shows the task the rows that were written."""
        for row in np.flatnonzero(self._unseen).tolist():
            self._show_row(row)

    def set_state(self, row: int, qpos: Any, qvel: Any) -> None:
        super().set_state(row, qpos, qvel)
        for each in range(self.count) if row == declarations.ALL_ROWS else (row,):
            self._changed(each)

    def reset_data(self, row: int) -> None:
        super().reset_data(row)
        self._changed(row)

    def simulate(self, row: int, ctrl: Float64Array, frames: int) -> None:
        super().simulate(row, ctrl, frames)
        self._changed(row)

    @in_turn
    def _changed(self, row: int) -> None:
        self._show_row(row)

    def _show_row(self, row: int) -> None:
        self._read_row(row)
        self._carried(np.array([row]))
        self._unseen[row] = False

    def copy_row(self, source: int, mask: BoolArray) -> None:
        super().copy_row(source, mask)
        for arrays in (self._state, self._parameters, self._own, self._views, {"unseen": self._unseen}):
            for values in arrays.values():
                values[mask] = values[source]

    # ---- images ----

    def snapshot(self, row: int) -> bytes:
        with self.changing():
            self._show_unseen()
        if self._state:
            parts = [values.reshape(self.count, -1) for values in self._state.values()]
            super().write_rows(None, "carried", np.concatenate(parts, axis=1))
        return super().snapshot(row)

    def restore(self, row: int, image: bytes) -> None:
        super().restore(row, image)
        rows = range(self.count) if row == declarations.ALL_ROWS else range(row, row + 1)
        self._unseen[rows.start : rows.stop] = False
        ends = np.cumsum([0, *(values[0].size for values in self._state.values())]).tolist()
        for of_row in rows if self._state else ():
            carried = self._numbers(of_row, "carried", ends[-1])
            for values, first, end in zip(self._state.values(), ends, ends[1:], strict=False):
                values[of_row] = carried[first:end].reshape(values.shape[1:])
        self._read_parameters(rows)
        self._read_all(row, rows)

    @in_turn
    def _read_all(self, row: int, rows: Iterable[int]) -> None:
        self._read_model(self._named(None), rows)
        if row == declarations.ALL_ROWS:
            self.check(self.engine.mjenv_observe(self.pointer, byref(self._inner.struct)))
        else:
            self._read_row(row)

    def __reduce__(self) -> tuple[Any, ...]:
        restored, given = super().__reduce__()
        return restored, (*given, type(self._task))


class _OwnOfStep(Mapping[str, Float64Array]):
    """Rows' own arrays, which step may write.

    Copies an array when the step looks it up, to restore it if the step fails. It does not copy all arrays, because
    copying all height fields would take longer than a step.
    """

    def __init__(self, arrays: Mapping[str, Float64Array], rows: Any = ...) -> None:
        self._arrays, self._rows = arrays, rows
        self._before: dict[str, Float64Array] | None = None  # None outside of step
        self._given: list[Float64Array] = []

    def __getitem__(self, name: str) -> Float64Array:
        view: Float64Array = self._arrays[name][self._rows]
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


class _RowDraws(Random):
    """Draws from the streams of these rows. Of what it draws, keep alone tells the library."""

    def __init__(self, rows: NumpyRows, chosen: NDArray[np.intp], *known: Mapping[str, Float64Array]) -> None:
        super().__init__((), *known)
        self._rows, self._chosen = rows, chosen
        self._all: NDArray[np.uint64] | None = None  # of all rows, as they were; None until the first draw
        self._words = np.zeros((0, 6), np.uint64)  # of the chosen rows

    @property
    def rows(self) -> int:
        return len(self._chosen)

    @property
    def streams(self) -> tuple[np.random.Generator, ...]:
        if not self._streams:
            self._load()
            self._streams = tuple(np.random.Generator(np.random.PCG64(0)) for _ in self._words)
            for words, stream in zip(self._words.tolist(), self._streams, strict=True):
                stream.bit_generator.state = pcg64_of(words)
        return self._streams

    def keep(self, rows: BoolArray) -> None:
        """Sets the streams of those of its rows."""
        if self._all is None:
            return
        for row, stream in enumerate(self._streams):
            self._words[row] = words_of(stream.bit_generator.state)
        self._all[self._chosen[rows]] = self._words[rows]
        self._pass(self._rows.engine.mjenv_set_stream, self._all)

    def _load(self) -> None:
        if self._all is None:
            everything = np.zeros((self._rows.count, 6), np.uint64)
            self._pass(self._rows.engine.mjenv_get_stream, everything)
            self._all, self._words = everything, everything[self._chosen]
            self._words[:, 2] |= np.uint64(1)  # of rows that were never reset, whose draws nobody sees

    def _pass(self, function: Callable[..., int], words: NDArray[np.uint64]) -> None:
        rows, numbers = self._rows, pointer_to(words, c_uint64)
        rows.check(function(rows.pointer, declarations.ALL_ROWS, numbers, words.size))

    def _draw(self, size: Size, draw: Drawing, kind: Distribution | None = None, low: Any = 0, high: Any = 0) -> Any:
        if kind is None or self._streams:
            return self.each(size, draw)
        values = np.zeros(self._shape(size))
        self._load()
        engine, words = self._rows.engine, pointer_to(self._words, c_uint64)
        engine.check(engine.mjenv_draw(words, self.rows, kind, low, high, pointer_to(values, c_double), values.size))
        return values

    def __enter__(self) -> None:
        self._all, self._streams = None, ()

    def __exit__(self, *_: object) -> None:
        self._all, self._streams = None, ()
