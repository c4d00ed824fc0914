"""One environment as a gymnasium.Env."""

from __future__ import annotations

import copy
import operator
from collections.abc import Callable, Sequence
from ctypes import byref
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Space
from numpy.typing import ArrayLike, NDArray

from mjenv._abi import Dtype, Role, Status, Type
from mjenv._handle import NOT_WAITING, Batch, Field, Float64Array, Rows, camera_config
from mjenv._mujoco import Data, Model
from mjenv._pictures import MAX_GEOM, RENDER_MODES, SIZE, Picture, Pictures
from mjenv.errors import InvalidValueError, OptionError, last_error

_ACTION_DTYPES: dict[np.dtype[Any], Dtype] = {np.dtype(np.float32): Dtype.FLOAT32, np.dtype(np.float64): Dtype.FLOAT64}

Info = dict[str, Any]

# What turns an np.float64 into the type that Gymnasium gives a value.
_CONVERTERS: dict[Type, Callable[[Any], Any]] = {
    Type.NATIVE_FLOAT: float,
    Type.NATIVE_INT: int,
    Type.INT64: np.int64,
}


def _is_narrow(field: Field, action_dtype: np.dtype[Any]) -> bool:
    return field.type == Type.ACTION and action_dtype == np.float32


def _value(field: Field, action_dtype: np.dtype[Any]) -> str:
    """The expression that takes a field's value, of the type that Gymnasium gives it, from a record."""
    item = f"record[{field.offset}]"
    if field.shape:
        return f"record[{field.offset}:{field.offset + field.count}].copy().reshape({field.shape})"
    if _is_narrow(field, action_dtype):
        return f"narrow[{field.offset}]"
    return f"{_CONVERTERS[field.type].__name__}({item})" if field.type in _CONVERTERS else item


def _reader(fields: Sequence[Field], action_dtype: np.dtype[Any]) -> Callable[[Float64Array], Info]:
    """A function that makes an info of one row's record, compiled for these fields, as every step calls it."""
    names: dict[str, Any] = {kind.__name__: kind for kind in _CONVERTERS.values()}
    names["narrow"] = np.zeros(sum(field.count for field in fields), np.float32)  # quicker than np.float32(x)
    narrowed = (f"narrow[{f.offset}] = record[{f.offset}]" for f in fields if _is_narrow(f, action_dtype))
    items = (f"{field.name!r}: {_value(field, action_dtype)}" for field in fields)
    exec("\n    ".join(["def read(record):", *narrowed, f"return {{{', '.join(items)}}}"]), names)
    return names["read"]  # type: ignore[no-any-return]


class _Input:
    """Actions of one dtype: the buffer they are copied to, the step that takes them, how to read its info."""

    __slots__ = ("buffer", "read", "step")

    def __init__(self, rows: Rows, dtype: np.dtype[Any], nu: int, out: Any, info: Sequence[Field]) -> None:
        self.buffer: NDArray[Any] = np.zeros(nu, dtype)
        self.step = rows.prepared("mjenv_step", None, self.buffer.ctypes.data, nu, int(_ACTION_DTYPES[dtype]), out)
        self.read = _reader(info, dtype)


class _Exchange:
    """What step and reset need of a Rows of one row, prepared once."""

    def __init__(self, rows: Rows) -> None:
        fields = {role: rows.fields(role) for role in Role if role not in (Role.DATA, Role.MODEL)}
        counts = {role: sum(field.count for field in of_role) for role, of_role in fields.items()}
        float64 = np.dtype(np.float64)
        self.nu = counts[Role.ACTION]
        self.shape = (self.nu,)
        self.convert_reward = _CONVERTERS.get(fields[Role.REWARD][0].type)
        self.structure = {field.name: field.count for field in fields[Role.STRUCTURE]}

        self.batch = Batch(1, counts[Role.OBSERVATION], counts[Role.INFO])
        self.obs, self.info, self.reward = self.batch.obs[0], self.batch.info, self.batch.reward
        self.ended = self.batch.ended.reshape(2)
        out = byref(self.batch.struct)
        self.inputs = {dtype: _Input(rows, dtype, self.nu, out, fields[Role.INFO]) for dtype in _ACTION_DTYPES}
        self.acquire, self.release = rows.lock.acquire, rows.lock.release

        self.reset_batch = Batch(1, counts[Role.OBSERVATION], counts[Role.RESET_INFO])
        struct = self.reset_batch.struct
        struct.reset_info, struct.reset_info_count, struct.info = struct.info, struct.info_count, None
        self.reset = rows.prepared("mjenv_reset", None, byref(self.reset_batch.struct))
        self.read_reset = _reader(fields[Role.RESET_INFO], float64)


class MujocoEnv(gymnasium.Env[Float64Array, NDArray[Any]]):
    """An environment of one of mjenv.ids(); mjenv.make builds it.

    Observations are fresh float64 arrays. Pickling and copy.deepcopy keep the episode and the random stream. One
    thread at a time may be inside; another gets mjenv.BusyError.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES)}  # noqa: RUF012 as in gymnasium.Env

    # Where Gymnasium has it: the lengths of the terms of the observation.
    observation_structure: dict[str, int]

    def __init__(
        self,
        id: str,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        width: int = SIZE,
        height: int = SIZE,
        camera_id: int | None = None,
        camera_name: str | None = None,
        max_geom: int = MAX_GEOM,
        visual_options: dict[int, bool] | None = None,
        render_fast: bool = False,
        **options: Any,
    ) -> None:
        """Builds the environment; max_episode_steps=None takes the id's own limit, -1 none."""
        self.default_camera_config: dict[str, Any] | None = _camera_config(id, options)
        if options.get("autoreset_mode", "disabled") != "disabled":
            raise InvalidValueError("a single environment is reset by its user: autoreset_mode must be 'disabled'")
        if max_episode_steps is not None:
            options["max_episode_steps"] = _time_limit(max_episode_steps)
        self._rows = Rows(id, options)
        self._seed: int | None = None
        self._generator: np.random.Generator | None = None
        self._pictures = Pictures(
            self._rows,
            render_mode,
            width,
            height,
            camera_id,
            camera_name,
            max_geom,
            visual_options,
            render_fast,
            self.default_camera_config,
        )
        self.render_mode, self._in_window = render_mode, render_mode == "human"
        self.width: int = width
        self.height: int = height
        self.camera_id: int | None = camera_id
        self.camera_name: str | None = camera_name
        self._prepare()

        low, high = (bound.astype(np.float32) for bound in self._rows.bounds(Role.ACTION))
        self.action_space: Space[Any] = Box(low, high, dtype=np.float32)
        self.observation_space: Space[Any] = Box(*self._rows.bounds(Role.OBSERVATION), dtype=np.float64)
        self.frame_skip: int = self._rows.frame_skip()
        self.metadata = {"render_modes": list(RENDER_MODES), "render_fps": int(np.round(1.0 / self.dt))}

    def _prepare(self) -> None:
        self._exchange = _Exchange(self._rows)
        self.data: Data = Data(self._rows)
        self.model: Model = Model(self._rows)
        if self._exchange.structure:
            self.observation_structure = self._exchange.structure

    # ---- gymnasium.Env ----

    def step(self, action: ArrayLike) -> tuple[Float64Array, SupportsFloat, bool, bool, Info]:
        """Takes a step. float32 and float64 actions take part in the arithmetic as they are; lists and integers count
        as float64."""
        exchange = self._exchange
        try:
            source = exchange.inputs[action.dtype]  # type: ignore[union-attr]
        except (AttributeError, KeyError, TypeError):
            action = _as_float(action)
            source = exchange.inputs[action.dtype]
        if action.shape != exchange.shape:  # type: ignore[union-attr]
            raise InvalidValueError(
                f"the action has the shape {np.shape(action)}; {self._rows.id} takes {exchange.shape}", Status.E_SIZE
            )
        taken = False
        try:
            (taken,) = map(exchange.acquire, NOT_WAITING)
            if not taken:
                raise self._rows.busy()
            if self._rows.pointer is None:
                raise self._rows.closed()
            source.buffer[...] = action
            status = source.step()
            if status:
                raise last_error(status)
            obs = exchange.obs.copy()
            reward = exchange.reward[0]
            terminated, truncated = exchange.ended.tolist()
            info = source.read(exchange.info)
        finally:
            if taken:
                exchange.release()
        if exchange.convert_reward:
            reward = exchange.convert_reward(reward)
        if self._in_window:
            self.render()
        return obs, reward, terminated, truncated, info

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Float64Array, Info]:
        """Begins an episode; options are ignored, as Gymnasium's environments do. A seed is an int >= 0 of any size;
        without one the random stream goes on."""
        if seed is not None:
            self._reseed(seed)
        elif self._seed is None:
            self._reseed(None)
        else:
            self._give_stream()
        exchange = self._exchange
        with self._rows.entered():
            status = exchange.reset()
            if status:
                raise last_error(status)
            obs = exchange.reset_batch.obs[0].copy()
            info = exchange.read_reset(exchange.reset_batch.info)
        self._take_stream()
        if self._in_window:
            self.render()
        return obs, info

    def render(self) -> Picture | None:  # type: ignore[override, unused-ignore]
        """The picture of the present state, by render_mode: "rgb_array" uint8[height, width, 3], "depth_array"
        float32[height, width] of 0 (near) to 1 (far), "rgbd_tuple" both. New arrays each time, the top row first.
        "human": None; a window shows it, after each reset and step, too, until the user closes the window."""
        return self._pictures.draw()

    def close(self) -> None:
        """Frees the environment and what drew it; closing twice is fine."""
        self._rows.close()
        self._pictures.close()

    # ---- the random stream ----
    # The library holds it. A Generator that was handed out shares it: it is given back before a reset, taken after.

    @property
    def np_random_seed(self) -> int:
        """The seed last used; -1 when np_random was assigned."""
        if self._seed is None:
            self._reseed(None)
        assert self._seed is not None
        return self._seed

    @property
    def np_random(self) -> np.random.Generator:
        """The stream that resets draw from; numbers drawn here move it, as in Gymnasium."""
        if self._generator is None:
            if self._seed is None:
                self._reseed(None)
            self._generator = np.random.Generator(np.random.PCG64(0))
            self._take_stream()
        return self._generator

    @np_random.setter
    def np_random(self, value: np.random.Generator) -> None:
        if not isinstance(value, np.random.Generator) or not isinstance(value.bit_generator, np.random.PCG64):
            raise OptionError(f"np_random is a numpy.random.Generator over PCG64, not {value!r}", Status.E_TYPE)
        self._generator, self._seed = value, -1
        self._give_stream()

    @property
    def _np_random(self) -> np.random.Generator:  # type: ignore[override]
        """Gymnasium's checkers look at it."""
        return self.np_random

    def _reseed(self, seed: int | None) -> None:
        if seed is None:
            seed = int(np.random.SeedSequence().entropy)  # type: ignore[arg-type]
        elif not isinstance(seed, int):
            raise gymnasium.error.Error(f"a seed is a Python int, not {seed!r} of {type(seed)}")
        elif seed < 0:
            raise gymnasium.error.Error(f"a seed is at least zero, not {seed}")
        self._rows.seed(0, seed)
        self._seed, self._generator = seed, None

    def _give_stream(self) -> None:
        if self._generator is not None:
            state: Any = self._generator.bit_generator.state["state"]
            self._rows.set_stream(0, state["state"], state["inc"])

    def _take_stream(self) -> None:
        if self._generator is not None:
            bits = self._generator.bit_generator
            state, increment = self._rows.stream(0)
            bits.state = {**bits.state, "state": {"state": state, "inc": increment}}

    # ---- pickle, copy ----

    def __getstate__(self) -> dict[str, Any]:
        self._give_stream()
        built = ("_exchange", "data", "model")
        return {name: value for name, value in self.__dict__.items() if name not in built}

    def __copy__(self) -> MujocoEnv:
        """Two environments never share an episode."""
        return copy.deepcopy(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._prepare()

    # ---- what Gymnasium's MuJoCo environments offer ----

    @property
    def dt(self) -> float:
        """Seconds in a step."""
        return self._rows.timestep() * self.frame_skip

    @property
    def init_qpos(self) -> Float64Array:
        """The model's positions, which a reset disturbs; read-only."""
        qpos0: Float64Array = self.model.qpos0
        return qpos0

    @property
    def init_qvel(self) -> Float64Array:
        """The model's velocities: zero."""
        return np.zeros(self.model.nv)

    def set_state(self, qpos: ArrayLike, qvel: ArrayLike) -> None:
        """Sets qpos[nq] and qvel[nv] and computes what follows from them."""
        self._rows.set_state(0, qpos, qvel)

    def state_vector(self) -> Float64Array:
        """qpos and qvel, one behind the other."""
        return np.concatenate([self.data.qpos, self.data.qvel])

    def get_body_com(self, body_name: str) -> Float64Array:
        """The position of a body's frame, in m."""
        position: Float64Array = self.data.body(body_name).xpos
        return position

    def do_simulation(self, ctrl: ArrayLike, n_frames: int) -> None:
        """Simulates n_frames mj_steps under ctrl[nu]; no step is counted."""
        controls = np.ascontiguousarray(ctrl, np.float64)
        if controls.shape != self._exchange.shape:
            raise InvalidValueError(
                f"ctrl has the shape {controls.shape}; {self._rows.id} takes {self._exchange.shape}", Status.E_SIZE
            )
        self._rows.simulate(0, controls, operator.index(n_frames))

    _step_mujoco_simulation = do_simulation


def _as_float(action: Any) -> NDArray[Any]:
    """An action as float32 or float64."""
    array = np.asarray(action)
    if array.dtype.kind == "f" and array.dtype.itemsize == 4:
        return array.astype(np.float32)
    if array.dtype.kind in "biu" or (array.dtype.kind == "f" and array.dtype.itemsize == 8):
        return array.astype(np.float64)
    raise OptionError(f"an action holds float32 or float64 numbers, not {array.dtype}", Status.E_TYPE)


def _time_limit(max_episode_steps: int) -> int:
    """The library's option for Gymnasium's keyword."""
    if max_episode_steps == -1:
        return 0
    if not isinstance(max_episode_steps, (int, np.integer)) or max_episode_steps < 1:
        raise InvalidValueError(f"max_episode_steps is an int >= 1, or -1 for no limit, not {max_episode_steps!r}")
    return int(max_episode_steps)


def _camera_config(id: str, options: dict[str, Any]) -> dict[str, Any] | None:
    """Takes default_camera_config out where Gymnasium's class accepts it; elsewhere it is an unknown option."""
    if id.endswith("-v5") or id == "Swimmer-v4":
        return options.pop("default_camera_config", camera_config(id))  # type: ignore[no-any-return]
    return camera_config(id)
