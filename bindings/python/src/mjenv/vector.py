"""Many environments of one id as a gymnasium.vector.VectorEnv, stepped by the library's own threads."""

from __future__ import annotations

import copy as copying
import operator
import os
import weakref
from collections.abc import Sequence
from ctypes import byref, c_int64, c_size_t, c_uint8
from typing import Any, NoReturn

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box, Space
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, DTypeLike, NDArray

from mjenv._abi import ALL_ROWS, Role, Status
from mjenv._arguments import (
    AutoresetMode,
    autoreset_mode_of,
    bool_mask,
    check_seed,
    count_of,
    obs_dtype_of,
    reset_mask_of,
    row_numbers,
)
from mjenv._handle import NOT_WAITING, Batch, Float64Array, Rows, pointer_to
from mjenv._library import LIBRARY
from mjenv._outputs import FLOATS, BoolArray, Info, Outputs
from mjenv._pictures import RENDER_MODES, Picture, Pictures
from mjenv._row import Row
from mjenv.env import _as_float, _camera_config, _time_limit
from mjenv.errors import (
    AlreadyPendingCallError,
    BusyError,
    ForkedError,
    InvalidValueError,
    NoAsyncCallError,
    OptionError,
    last_error,
)
from mjenv.registration import spec as spec_of

Array = NDArray[Any]
Results = tuple[Array, Float64Array, BoolArray, BoolArray, Info]

_RENDERING = ("render_mode", "width", "height", "camera_id", "camera_name", "max_geom", "visual_options", "render_fast")
_UNKNOWN_SEED = -1  # as in Gymnasium, where a stream did not come from a seed


def make_vec(
    id: str | EnvSpec,
    num_envs: int = 1,
    *,
    num_threads: int = 0,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    dtype: DTypeLike = np.float64,
    copy: bool = True,
    max_episode_steps: int | None = None,
    disable_env_checker: bool | None = None,
    **options: Any,
) -> VectorEnv:
    """Builds num_envs environments that equal gymnasium.make_vec(id, num_envs, vectorization_mode="sync").

    id: one of ids(), or an EnvSpec, whose num_envs and vector_kwargs then hold as in gymnasium.make_vec.
    num_threads: 0 for the CPUs this process may use. dtype: of the observations, float64 or float32 (rounded to
    nearest). copy=False: observations are views of an array that the next call overwrites. max_episode_steps,
    disable_env_checker, options: as in make; arrays="xpos sensordata" exports these arrays of mjData with each step.
    """
    given = copying.deepcopy(id.kwargs) if isinstance(id, EnvSpec) else {}
    asked = id if isinstance(id, EnvSpec) else spec_of(id)
    vectorizer = {"autoreset_mode": autoreset_mode, "copy": copy, "dtype": dtype, **given.pop("vector_kwargs", {})}
    given.pop("vectorization_mode", None)
    num_envs = given.pop("num_envs", num_envs)
    chosen = {**given, **options}
    for name, value, default in (
        ("num_threads", num_threads, 0),
        ("max_episode_steps", max_episode_steps, None),
        ("disable_env_checker", disable_env_checker, None),
    ):
        if value != default:
            chosen[name] = value

    own = spec_of(asked.id)
    made = VectorEnv(own.id, num_envs, **{"max_episode_steps": _limit_of(asked), **chosen}, **vectorizer)
    made.spec = own
    made.spec.max_episode_steps = asked.max_episode_steps
    made.spec.kwargs = {**chosen, "vectorization_mode": "sync"}
    if num_envs != 1:
        made.spec.kwargs["num_envs"] = num_envs
    defaults = {"autoreset_mode": AutoresetMode.NEXT_STEP, "copy": True, "dtype": np.float64}
    changed = {name: value for name, value in vectorizer.items() if value != defaults[name]}
    if changed:
        made.spec.kwargs["vector_kwargs"] = changed
    return made


def _limit_of(spec: EnvSpec) -> int:
    return -1 if spec.max_episode_steps is None else spec.max_episode_steps


class _Input:
    """Actions of one dtype: the buffer they are copied to, and the step that takes them."""

    __slots__ = ("buffer", "dtype", "step")

    def __init__(self, rows: Rows, dtype: np.dtype[Any], shape: tuple[int, int], out: Any) -> None:
        self.dtype = dtype
        self.buffer: Array = np.zeros(shape, dtype)
        self.step = rows.prepared(
            "mjenv_step", None, self.buffer.ctypes.data, self.buffer.size, int(FLOATS[dtype]), out
        )


class VectorEnv(gymnasium.vector.VectorEnv[Array, Array, Array]):
    """Environments of one id, one a row; mjenv.make_vec builds it.

    Equal to gymnasium.vector.SyncVectorEnv over the same id: spaces, observations, rewards, flags, infos with their
    masks. Pickling and copy.deepcopy keep all episodes and random streams. One thread at a time may be inside; another
    gets mjenv.BusyError.

    arrays: the exported arrays of mjData by name, as (num_envs, *shape) views of what the last call wrote.
    """

    arrays: dict[str, Float64Array]

    def __init__(
        self,
        id: str,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        *,
        num_threads: int = 0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        dtype: DTypeLike = np.float64,
        copy: bool = True,
        disable_env_checker: bool | None = None,
        **options: Any,
    ) -> None:
        """As make_vec; max_episode_steps=None takes the id's own limit, -1 none."""
        rendering = {name: options.pop(name) for name in _RENDERING if name in options}
        camera = _camera_config(id, options)
        if max_episode_steps is not None:
            options["max_episode_steps"] = _time_limit(max_episode_steps)
        self.num_envs: int = count_of(num_envs)
        self.autoreset_mode: AutoresetMode = autoreset_mode_of(autoreset_mode)
        self.copy: bool = bool(copy)
        self._dtype = obs_dtype_of(dtype)
        library_mode = self.autoreset_mode.name.lower()
        self._rows = Rows(
            id, {**options, "num_threads": num_threads, "autoreset_mode": library_mode}, count=self.num_envs
        )
        self._pictures = Pictures(self._rows, **rendering, default_camera_config=camera)
        self.render_mode = self._pictures.mode
        self._in_windows = self.render_mode == "human"
        self._seeds = np.full(self.num_envs, None, dtype=object)  # None: never seeded
        # Whether the array of observations may lag behind the rows.
        self._stale = False
        self._prepare()

        low, high = (bound.astype(np.float32) for bound in self._rows.bounds(Role.ACTION))
        self.single_action_space: Box = Box(low, high, dtype=np.float32)
        self.action_space: Space[Any] = batch_space(self.single_action_space, self.num_envs)
        low, high = (bound.astype(self._dtype) for bound in self._rows.bounds(Role.OBSERVATION))
        self.single_observation_space: Box = Box(low, high, dtype=self._dtype.type)
        self.observation_space: Space[Any] = batch_space(self.single_observation_space, self.num_envs)
        self.frame_skip: int = self._rows.frame_skip()
        self.metadata: dict[str, Any] = {
            "render_modes": list(RENDER_MODES),
            "render_fps": int(np.round(1.0 / self.dt)),
            "autoreset_mode": self.autoreset_mode,
        }

    def _prepare(self) -> None:
        rows = self._rows
        self._outputs = Outputs(rows, self._dtype, final=self.autoreset_mode == AutoresetMode.SAME_STEP)
        self._out = byref(self._outputs.struct)
        self.arrays = self._outputs.arrays
        self._shape = (self.num_envs, self._outputs.nu)
        self._inputs = {dtype: _Input(rows, dtype, self._shape, self._out) for dtype in FLOATS}
        self._acquire, self._release = rows.lock.acquire, rows.lock.release
        # Rows between send and recv, and the dtype of their actions.
        self._pending = 0
        self._under_way: BoolArray = np.zeros(self.num_envs, np.bool_)
        self._sent_float32: BoolArray = np.zeros(self.num_envs, np.bool_)
        self._process = os.getpid()
        self._finalizer = weakref.finalize(self, _close, rows)

    # ---- gymnasium.vector.VectorEnv ----

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, Info]:
        """Begins episodes.

        seed: an int gives row i seed + i; a list has one for each row, None to go on with the row's stream.
        options["reset_mask"]: a bool array; the other rows go on with their episodes, and their observations stay.
        """
        mask = reset_mask_of(options, self.num_envs)
        self._check_settled()
        self._reseed(self._seeds_for(seed, mask))
        if mask is not None and self._stale:
            self.observe()
        pointer = None if mask is None else pointer_to(mask, c_uint8)
        with self._rows.entered() as env:
            self._check(LIBRARY.mjenv_reset(env, pointer, self._out))
            self._stale = False
            results = self._observations(), self._outputs.reset_infos(mask)
        if self._in_windows:
            self.render()
        return results

    def step(self, actions: ArrayLike) -> Results:
        """Takes a step in every row. float32 and float64 actions take part in the arithmetic as they are; lists and
        integers count as float64."""
        try:
            source = self._inputs[actions.dtype]  # type: ignore[union-attr]
        except (AttributeError, KeyError, TypeError):
            actions = _as_float(actions)
            source = self._inputs[actions.dtype]
        if actions.shape != self._shape:  # type: ignore[union-attr]
            raise self._bad_shape(actions, self._shape)
        taken = False
        try:
            (taken,) = map(self._acquire, NOT_WAITING)
            if not taken:
                raise self._rows.busy()
            if self._rows.pointer is None:
                raise self._rows.closed()
            source.buffer[...] = actions
            status = source.step()
            if status:
                self._check(status)
            outputs = self._outputs
            results = (
                outputs.obs.copy() if self.copy else outputs.obs,
                outputs.reward.copy(),
                outputs.terminated.copy(),
                outputs.truncated.copy(),
                outputs.step_infos(source.dtype),
            )
        finally:
            if taken:
                self._release()
        if self._in_windows:
            self.render()
        return results

    def render(self) -> tuple[Picture | None, ...]:  # type: ignore[override]
        """The picture of every row, each as render of a single environment gives it; "human" has a window for each."""
        self._check_settled()
        return tuple(self._pictures.draw(row) for row in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Frees the environments; rows under way are given up."""
        if hasattr(self, "_pictures"):  # Gymnasium 1.0 closes what could not be built
            self._rows.close()
            self._pictures.close()
            self._pending = 0

    # ---- stepping some rows at a time ----

    def send(self, actions: ArrayLike, rows: ArrayLike | None = None) -> None:
        """Begins a step of these rows, of all if there are none given, and returns; actions[i] is for rows[i]."""
        numbers = None if rows is None else row_numbers(rows)
        count = self.num_envs if numbers is None else len(numbers)
        action = self._actions(actions, (count, self._shape[1]))
        code = FLOATS[action.dtype]
        pointer = None if numbers is None else pointer_to(numbers, c_int64)
        part = slice(None) if numbers is None else numbers
        address, size = action.ctypes.data, action.size
        status = Status.OK  # should an interrupt come as the call returns: then the rows are under way
        with self._rows.entered() as env:
            try:
                status = LIBRARY.mjenv_send(env, pointer, count, address, size, code)
            finally:
                if not status:
                    self._pending += count
                    self._under_way[part] = True
                    self._sent_float32[part] = action.dtype == np.float32
            self._check(status, numbers)

    def recv(
        self, least: int | None = None
    ) -> tuple[NDArray[np.int64], Array, Float64Array, BoolArray, BoolArray, Info]:
        """Waits until `least` of the rows that were sent have been stepped, None for all, and returns all that have:
        their numbers, ascending, then what step returns, as copies, for these rows alone."""
        wanted = self._pending if least is None else min(operator.index(least), 2**63)
        if wanted < 0:
            raise InvalidValueError(f"least is {wanted}, less than 0", Status.E_VALUE)
        with self._rows.entered() as env:
            if not self._pending:
                raise NoAsyncCallError("no rows are under way: send some first", Status.E_STATE)
            buffer = np.empty(self._pending, np.int64)
            count = c_size_t()
            pointer, size, received = pointer_to(buffer, c_int64), buffer.size, byref(count)
            try:
                status = LIBRARY.mjenv_recv(env, wanted, -1, pointer, size, received, self._out)
            finally:  # also when an interrupt comes as the call returns: the rows are not under way any more
                self._pending -= count.value
                self._under_way[buffer[: count.value]] = False
            self._check(status)
            rows: NDArray[np.int64] = np.sort(buffer[: count.value])
            results = self._results_of(rows)
        if self._in_windows:
            for row in rows:
                self._pictures.draw(int(row))
        return (rows, *results)

    def _results_of(self, rows: NDArray[np.int64]) -> Results:
        outputs = self._outputs
        float32 = len(rows) > 0 and self._sent_float32[rows[0]]
        action_dtype = np.dtype(np.float32 if float32 else np.float64)
        infos = outputs.step_infos(action_dtype, None if len(rows) == self.num_envs else rows)
        return outputs.obs[rows], outputs.reward[rows], outputs.terminated[rows], outputs.truncated[rows], infos

    @property
    def statuses(self) -> NDArray[np.int32]:
        """For each row mjenv.Status.OK, or E_PHYSICS where MuJoCo found the state diverged in the last step and
        restarted it. The option on_divergence="terminate" ends the episodes of such rows."""
        return self._outputs.status.copy()

    # ---- planning ----

    def rollout(self, actions: ArrayLike, *, observations: bool = False) -> tuple[Array, ...]:
        """Plays actions[num_envs, steps, nu] open-loop from the rows' states and leaves the rows at their ends.

        Returns rewards (float64), terminations and truncations, each (num_envs, steps), and the observations
        (num_envs, steps, n) if asked. A row that ends stays there: its flags repeat, its rewards are 0.
        """
        array = np.asarray(actions)
        steps = array.shape[1] if array.ndim == 3 else 1
        action = self._actions(array, (self.num_envs, steps, self._shape[1]))
        out = Batch(self.num_envs * steps, self._outputs.obs.shape[1] if observations else 0, 0, FLOATS[self._dtype])
        out.struct.info, out.struct.status = None, None
        if not observations:
            out.struct.obs = None
        with self._rows.entered() as env:
            self._stale = True
            self._check(
                LIBRARY.mjenv_rollout(
                    env, action.ctypes.data, action.size, FLOATS[action.dtype], steps, byref(out.struct)
                )
            )
        terminated, truncated = out.ended.reshape(2, self.num_envs, steps)
        results = out.reward.reshape(self.num_envs, steps), terminated, truncated
        return (*results, out.obs.reshape(self.num_envs, steps, -1)) if observations else results

    def observe(self) -> Array:
        """The observations of the rows as they are, without a step: after restore, copy_row or rollout, say."""
        with self._rows.entered() as env:
            self._check(LIBRARY.mjenv_observe(env, self._out))
            self._stale = False
            return self._observations()

    def copy_row(self, source: int, mask: BoolArray) -> None:
        """Makes the rows where mask is True equal to the row `source`: state, random stream, step count."""
        row, chosen = self._row(source), bool_mask(mask, self.num_envs, "mask")
        self._check_settled()
        self._rows.copy_row(row, chosen)
        self._stale = True
        self._seeds[chosen] = self._seeds[row]

    def snapshot(self, row: int | None = None) -> bytes:
        """An image of a row, or of all: state, random stream, step count."""
        self._check_settled()
        return self._rows.snapshot(ALL_ROWS if row is None else self._row(row))

    def restore(self, image: bytes, row: int | None = None) -> None:
        """Continues a row from an image of a row, or all from an image of all, bit for bit, also in another process
        and with another number of threads. The image must come from the same id and options."""
        if not isinstance(image, (bytes, bytearray, memoryview)):
            raise OptionError(f"an image is bytes, not {type(image).__name__}", Status.E_TYPE)
        number = ALL_ROWS if row is None else self._row(row)
        self._check_settled()
        self._rows.restore(number, bytes(image))
        self._stale = True
        self._seeds[slice(None) if row is None else number] = _UNKNOWN_SEED

    # ---- seeds ----

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """Each row's last seed; -1 where its stream came from a snapshot."""
        self._reseed(self._seeds_for(None, None))
        return tuple(self._seeds)

    @property  # type: ignore[override, unused-ignore]
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """A copy of each row's random stream."""
        return tuple(row.np_random for row in self.envs)

    @np_random.setter
    def np_random(self, value: Any) -> NoReturn:
        raise AttributeError("np_random is read-only; reset takes seeds")

    def _seeds_for(self, seed: Any, mask: BoolArray | None) -> NDArray[np.object_]:
        """A seed or None for each row; rows that were never seeded get one from the system."""
        seeds: list[Any]
        if seed is None:
            seeds = [None] * self.num_envs
        elif isinstance(seed, int):
            seeds = list(range(seed, seed + self.num_envs))
        else:
            try:
                seeds = list(seed)
            except TypeError:
                raise OptionError(f"a seed is an int or a list of ints, not {seed!r}", Status.E_TYPE) from None
            if len(seeds) != self.num_envs:
                raise InvalidValueError(f"{len(seeds)} seeds for {self.num_envs} rows", Status.E_SIZE)
        found = np.empty(self.num_envs, dtype=object)
        found[:] = seeds
        if mask is not None:
            found[~mask] = None
        for value in found:
            check_seed(value)
        new = _missing(found) & _missing(self._seeds)
        if mask is not None:
            new &= mask
        found[new] = np.frombuffer(os.urandom(8 * int(new.sum())), np.uint64).tolist()
        return found

    def _reseed(self, seeds: NDArray[np.object_]) -> None:
        """Gives the rows that have a new seed its stream."""
        given = ~_missing(seeds)
        if not given.any():
            return
        small = given.copy()
        small[given] = np.less(seeds[given], 2**64)
        words = np.zeros(self.num_envs, np.uint64)
        words[small] = seeds[small].astype(np.uint64)
        self._rows.seed_rows(words, small)
        for row in np.flatnonzero(given & ~small):
            self._rows.seed(int(row), seeds[row])
        self._seeds[given] = seeds[given]

    # ---- single rows ----

    @property
    def envs(self) -> tuple[Row, ...]:
        """The rows one by one, as far as a row is an environment: its data, set_state and the like."""
        return tuple(Row(self, row) for row in range(self.num_envs))

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Calls a method of every row; the value where the name is no method."""
        found = (getattr(row, name) for row in self.envs)
        return tuple(value(*args, **kwargs) if callable(value) else value for value in found)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of every row."""
        return self.call(name)

    @property
    def dt(self) -> float:
        """Seconds in a step."""
        return self._rows.timestep() * self.frame_skip

    # ---- pickle, copy ----

    def __getstate__(self) -> dict[str, Any]:
        self._check_settled()
        built = ("_acquire", "_finalizer", "_inputs", "_out", "_outputs", "_release", "_reset_out", "arrays")
        state = {name: value for name, value in self.__dict__.items() if name not in built}
        outputs = self._outputs
        return {**state, "_written": (outputs.obs.copy(), outputs.status.copy(), outputs.exported.copy())}

    def __copy__(self) -> VectorEnv:
        """Two environments never share an episode."""
        return copying.deepcopy(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        written = state.pop("_written")
        self.__dict__.update(state)
        self._prepare()
        outputs = self._outputs
        arrays: tuple[Array, ...] = (outputs.obs, outputs.status, outputs.exported)
        for array, values in zip(arrays, written, strict=True):
            array[...] = values

    # ---- what callers may pass, and what went wrong ----

    def _observations(self) -> Array:
        return self._outputs.obs.copy() if self.copy else self._outputs.obs

    def _actions(self, actions: ArrayLike, shape: tuple[int, ...]) -> Array:
        """Actions as a contiguous float32 or float64 array of that shape."""
        array = np.asarray(actions)
        if array.dtype not in FLOATS:
            array = _as_float(array)
        if array.shape != shape:
            raise self._bad_shape(array, shape)
        return np.ascontiguousarray(array)

    def _bad_shape(self, actions: Any, shape: tuple[int, ...]) -> InvalidValueError:
        return InvalidValueError(
            f"the actions have the shape {np.shape(actions)}; {self.num_envs} x {self._rows.id} take {shape}",
            Status.E_SIZE,
        )

    def _row(self, row: int) -> int:
        number = operator.index(row)
        if not 0 <= number < self.num_envs:
            raise InvalidValueError(f"row {number} is outside 0..{self.num_envs - 1}", Status.E_VALUE)
        return number

    def _check_settled(self) -> None:
        if self._pending:
            raise self._under_way_error()

    def _under_way_error(self) -> AlreadyPendingCallError:
        return AlreadyPendingCallError(f"{self._pending} row(s) are under way: recv them first", Status.E_STATE)

    def _check(self, status: int, sent: NDArray[np.int64] | None = None) -> None:
        """Raises unless the status is MJENV_OK; sent are the rows of a send."""
        if not status:
            return
        if self._rows.pointer is None:
            raise self._rows.closed()
        error = last_error(status)
        if status == Status.E_STATE:
            if os.getpid() != self._process:
                raise ForkedError(error.message, status)
            if self._repeats(sent):
                raise AlreadyPendingCallError(error.message, status)
        raise error

    def _repeats(self, sent: NDArray[np.int64] | None) -> bool:
        """Whether what was asked for meets rows that are under way, or one row twice."""
        if sent is None:
            return self._pending > 0
        return bool(self._under_way[sent].any()) or len(np.unique(sent)) < len(sent)


def _missing(seeds: NDArray[np.object_]) -> BoolArray:
    return np.fromiter((seed is None for seed in seeds), np.bool_, len(seeds))


def _close(rows: Rows) -> None:
    """Ends the threads that write to the outputs."""
    try:
        rows.close()
    except BusyError:
        rows.close_at_exit()
