"""One environment of an id as a gymnasium.Env."""

from __future__ import annotations

import copy
from collections.abc import Callable
from ctypes import byref, c_double
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from mjenv.capi.declarations import Role, Status
from mjenv.capi.dtypes import Float64Array
from mjenv.capi.engine import ENGINES
from mjenv.capi.handle import Batch, Rows, open_rows, pointer_to
from mjenv.errors import InvalidValueError, OptionError
from mjenv.rows.arguments import image_of, time_limit_of
from mjenv.rows.observations import Observations
from mjenv.rows.pictures import RENDER_MODES, Picture, Pictures, rendering_of
from mjenv.rows.simulation import TaskSimulation, Whole
from mjenv.rows.step import CONVERTERS, Info, Record, Step, views

Results = tuple[Any, float, bool, bool, Info]

_FLOAT64 = np.dtype(np.float64)
_UNKNOWN_SEED = -1  # as in Gymnasium, for a stream that does not come from a seed


class _Exchange:
    """The arrays and the prepared calls with which one row is stepped and reset."""

    def __init__(self, rows: Rows) -> None:
        self._rows = rows
        self.observations = Observations(rows, _FLOAT64)
        self._batch = Batch(1, self.observations.shape, rows.size(Role.INFO))
        self._reset_batch = Batch(1, self.observations.shape, rows.size(Role.RESET_INFO))
        self.status: NDArray[np.int32] = self._batch.status
        exported = np.zeros(rows.size(Role.ARRAYS))
        self.arrays = {name: view[0, ...] for name, view in views(exported, rows.fields(Role.ARRAYS), 1).items()}
        struct = self._reset_batch.struct
        struct.reset_info, struct.reset_info_count, struct.info = struct.info, struct.info_count, None
        self._observed = Batch(1, self.observations.shape, 0)
        self._observed.struct.info = None
        for batch in (self._batch, self._reset_batch, self._observed):
            batch.struct.arrays_count, batch.struct.arrays = exported.size, pointer_to(exported, c_double)

        self.stepper = Step(rows, (rows.size(Role.ACTION),), byref(self._batch.struct), self._step_results)
        self._reset = rows.prepared("mjenv_reset", None, byref(self._reset_batch.struct))
        self._reset_info = Record(rows.fields(Role.RESET_INFO), _FLOAT64)

    def _step_results(self, dtype: np.dtype[Any]) -> Callable[[], Results]:
        """The function that copies the outputs of a step with an action of this dtype."""
        copy_obs = partial(self.observations.copy, self._batch.obs[0])
        if not self._rows.fields(Role.GROUPS):
            copy_obs = self._batch.obs[0].copy  # the same, without the time of a call in Python
        flags: Any = self._batch.ended.reshape(2).data
        rewards, convert_reward = self._batch.reward, CONVERTERS.get(self._rows.fields(Role.REWARD)[0].type)
        record, info_of = self._batch.info, Record(self._rows.fields(Role.INFO), dtype)
        items, conversions, narrowed = info_of.items, info_of.conversions, info_of.narrowed

        def results() -> Results:
            reward = rewards[0]
            if convert_reward:
                reward = convert_reward(reward)
            terminated, truncated = flags
            # The same as Record.read(record), without the time of the call.
            info = {}
            for name, index in items:
                info[name] = record[index]
            for name, convert in conversions:
                info[name] = convert(info[name])
            for name, buffer in narrowed:
                buffer[0] = info[name]
                info[name] = buffer[0]
            return copy_obs(), reward, terminated, truncated, info

        return results

    def observe(self) -> Any:
        """The observation of the present state."""
        with self._rows.changing():
            self._rows.observe(byref(self._observed.struct))
            return self.observations.copy(self._observed.obs[0])

    def reset(self) -> tuple[Any, Info]:
        """Begins an episode."""
        rows = self._rows
        with rows.changing():
            if rows.closed:
                raise rows.gone()
            rows.check(self._reset())
            return self.observations.copy(self._reset_batch.obs[0]), self._reset_info.read(self._reset_batch.info)


class Environment(Whole, TaskSimulation, gymnasium.Env[Any, NDArray[Any]]):
    """An environment of one of mjenv.ids(); mjenv.make builds it.

    Observations are new float64 arrays, or dicts of them (the option observation). Pickling and copy.deepcopy keep the
    episode and the random stream. One thread at a time may use it; a second one gets mjenv.BusyError.

    arrays: the exported arrays of mjData by name, each a view of what the last call wrote.
    """

    _is_alone = True
    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES)}  # noqa: RUF012 as in gymnasium.Env
    action_space: Box  # type: ignore[assignment, unused-ignore]
    observation_space: Any
    arrays: dict[str, Float64Array]

    def __init__(
        self, id: str, max_episode_steps: int | None = None, *, engine: str | None = None, **options: Any
    ) -> None:
        """Takes the arguments of make. max_episode_steps: None means the id's own limit, -1 no limit."""
        library = ENGINES.get(engine)
        rendering = rendering_of(library, id, options)
        if options.get("autoreset_mode", "disabled") != "disabled":
            raise InvalidValueError("a single environment is reset by its user: autoreset_mode must be 'disabled'")
        if max_episode_steps is not None:
            options["max_episode_steps"] = time_limit_of(max_episode_steps)
        self._rows = open_rows(library, id, options)
        self._seed: int | None = None
        self._generator: np.random.Generator | None = None
        self._pictures = pictures = Pictures(self._rows, **rendering)
        self.render_mode, self._in_window = pictures.mode, pictures.mode == "human"
        # As they were passed, as in Gymnasium
        self.width, self.height = (rendering.get(name, getattr(pictures, name)) for name in ("width", "height"))
        self.camera_id, self.camera_name = pictures.camera_id, pictures.camera_name
        self.default_camera_config: dict[str, Any] | None = rendering["default_camera_config"]
        self._prepare()

        low, high = (bound.astype(np.float32) for bound in self._rows.bounds(Role.ACTION))
        self.action_space = Box(low, high, dtype=np.float32)
        self.observation_space = self._exchange.observations.space
        self.frame_skip: int = self._rows.frame_skip()
        self.metadata = {"render_modes": list(RENDER_MODES), "render_fps": int(np.round(1.0 / self.dt))}
        self._is_built = True

    def _prepare(self) -> None:
        self._exchange = _Exchange(self._rows)
        self._step = self._step_and_draw if self._rows.draws_in_steps else self._exchange.stepper.step
        self.arrays = self._exchange.arrays

    # ---- gymnasium.Env ----

    def step(self, action: ArrayLike) -> Results:  # type: ignore[override, unused-ignore]
        """Takes a step.

        action: (nu,). The arithmetic uses float32 and float64 actions in their own precision, and lists and integers as
        float64. Returns the observation float64[n], the reward, whether the episode terminated, whether it was
        truncated, and the info. No later call changes them.
        """
        results = self._step(action)
        if self._in_window:
            self.render()
        return results

    def _step_and_draw(self, action: ArrayLike) -> Results:
        """A step that moves the random stream."""
        self._give_stream()
        try:
            return self._exchange.stepper.step(action)
        finally:
            self._take_stream()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Info]:
        """Begins an episode. Returns the observation float64[n] and the info.

        seed: an int >= 0 of any size; None: the random stream goes on. options: ignored, as in Gymnasium's MuJoCo
        environments.
        """
        if seed is not None:
            self._reseed(seed)
        elif self._seed is None:
            self._reseed(None)
        else:
            self._give_stream()
        results = self._exchange.reset()
        self._take_stream()
        if self._in_window:
            self.render()
        return results

    def render(self) -> Picture | None:  # type: ignore[override, unused-ignore]
        """The picture of the present state, in new arrays, the top row first.

        render_mode "rgb_array" gives uint8[height, width, 3], "depth_array" float32[height, width] from 0 (near) to 1
        (far), "rgbd_tuple" both. "human" gives None: a window shows the picture, and after every reset and step the
        new one, until the user closes the window.
        """
        return self._pictures.draw()

    def observe(self) -> Any:
        """The observation of the present state, without a step: after set_state or restore, for example."""
        return self._exchange.observe()

    _get_obs = observe

    def close(self) -> None:
        """Frees the environment, its renderers and its windows. Closing twice is fine."""
        self._rows.close()
        self._pictures.close()

    # ---- randomisation ----

    def draw_range(self, array: str, number: int = 0) -> Float64Array:
        """The parameters of the distribution from which resets draw an array: (n,), for "uniform" low and high.

        number: the index of the item, if randomize has a list of items for the array.
        """
        parameters: Float64Array = self._rows.draw_range(array, number)[0]
        return parameters

    def set_draw_range(self, array: str, parameters: ArrayLike, number: int = 0) -> None:
        """Replaces these parameters from the next reset on, for a curriculum. A later randomize replaces them again."""
        self._rows.set_draw_range(array, parameters, number, None)

    # ---- snapshots ----

    def snapshot(self) -> bytes:
        """An image of the environment: state, random stream, step count."""
        self._give_stream()
        return self._rows.snapshot(0)

    def restore(self, image: bytes) -> None:
        """Continues from an image, bit for bit.

        The image may come from another process, but its environment must have had the same id and options. Raises
        SnapshotError if they differ or the image is damaged.
        """
        self._rows.restore(0, image_of(image))
        self._seed = _UNKNOWN_SEED
        self._take_stream()

    # ---- the random stream ----
    # The library holds the stream. A Generator that np_random has returned is a second copy of it: a reset first writes
    # its state to the library, and afterwards reads it back.

    @property
    def np_random_seed(self) -> int:
        """The seed last used; -1 if the stream came from an assigned np_random or from a snapshot."""
        if self._seed is None:
            self._reseed(None)
        assert self._seed is not None
        return self._seed

    @property
    def np_random(self) -> np.random.Generator:
        """The stream from which resets draw. Draws from it advance the stream, as in Gymnasium."""
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
        self._generator, self._seed = value, _UNKNOWN_SEED
        self._give_stream()

    @property
    def _np_random(self) -> np.random.Generator:  # type: ignore[override]
        """The same stream, which Gymnasium's checkers read under this name."""
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
            self._rows.set_stream(0, self._generator.bit_generator.state)  # type: ignore[arg-type, unused-ignore]

    def _take_stream(self) -> None:
        if self._generator is not None:
            self._generator.bit_generator.state = self._rows.stream(0)

    # ---- pickle, copy ----

    def __getstate__(self) -> dict[str, Any]:
        self._give_stream()
        built = ("_exchange", "_step", "arrays", "parameters", "data", "model", "_read_timestep")
        return {name: value for name, value in self.__dict__.items() if name not in built}

    def __copy__(self) -> Environment:
        """A deep copy, because two environments never share an episode."""
        return copy.deepcopy(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._prepare()
