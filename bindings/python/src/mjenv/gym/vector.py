"""Many environments of one id as a gymnasium.vector.VectorEnv, stepped by the library's own threads."""

from __future__ import annotations

import copy as copying
import operator
from collections.abc import Callable, Sequence
from ctypes import byref
from functools import cached_property
from typing import Any, NoReturn, TypeVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Space
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, DTypeLike, NDArray

from mjenv.capi.declarations import ALL_ROWS, Role, Status
from mjenv.capi.dtypes import FLOATS, Float64Array
from mjenv.capi.engine import ENGINES
from mjenv.capi.handle import Batch, open_rows
from mjenv.errors import InvalidValueError
from mjenv.rows.arguments import (
    AutoresetMode,
    autoreset_mode_of,
    bool_mask,
    count_of,
    image_of,
    obs_dtype_of,
    reset_mask_of,
    row_numbers,
    time_limit_of,
)
from mjenv.rows.arrays import Arrays, Data, Model, Parameters
from mjenv.rows.outputs import BoolArray, Outputs
from mjenv.rows.pictures import RENDER_MODES, Picture, rendering_of
from mjenv.rows.pool import Pool
from mjenv.rows.row import Row, RowList
from mjenv.rows.simulation import Whole
from mjenv.rows.step import Info, Step

T = TypeVar("T")
Array = NDArray[Any]
Results = tuple[Any, Float64Array, BoolArray, BoolArray, Info]


class VectorEnv(Whole, gymnasium.vector.VectorEnv[Any, Array, Array]):
    """Environments of one id, one in each row; mjenv.make_vec builds it.

    Equal to gymnasium.vector.SyncVectorEnv over the same id: spaces, observations, rewards, flags, infos with their
    masks. Observations are arrays (num_envs, n), or dicts of arrays (the option observation). Pickling and
    copy.deepcopy keep all episodes and random streams. One thread at a time may use it; a second one gets
    mjenv.BusyError.

    arrays: the exported arrays of mjData by name, each a view (num_envs, *shape) of what the last call wrote.
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
        engine: str | None = None,
        **options: Any,
    ) -> None:
        """Takes the arguments of make_vec. max_episode_steps=None means the id's own limit, -1 no limit."""
        library = ENGINES.get(engine)
        rendering = rendering_of(library, id, options)
        if max_episode_steps is not None:
            options["max_episode_steps"] = time_limit_of(max_episode_steps)
        self.num_envs: int = count_of(num_envs)
        self.autoreset_mode: AutoresetMode = autoreset_mode_of(autoreset_mode)
        self.copy: bool = bool(copy)
        obs_dtype = obs_dtype_of(dtype)
        options.update(num_threads=num_threads, autoreset_mode=self.autoreset_mode.name.lower())
        final = self.autoreset_mode == AutoresetMode.SAME_STEP
        self._rows = rows = open_rows(library, id, options, self.num_envs)
        self._pool = Pool(rows, obs_dtype, final=final, rendering=rendering)
        self.render_mode = self._pool.pictures.mode
        self._in_windows = self.render_mode == "human"
        self._prepare()

        low, high = (bound.astype(np.float32) for bound in rows.bounds(Role.ACTION))
        self.single_action_space: Box = Box(low, high, dtype=np.float32)
        self.action_space: Space[Any] = batch_space(self.single_action_space, self.num_envs)
        # A Box, or a Dict (the option observation).
        self.single_observation_space: Any = self._pool.outputs.observations.space
        self.observation_space: Space[Any] = batch_space(self.single_observation_space, self.num_envs)
        self.frame_skip: int = self._pool.frame_skip
        self.metadata: dict[str, Any] = {
            "render_modes": list(RENDER_MODES),
            "render_fps": int(np.round(1.0 / self.dt)),
            "autoreset_mode": self.autoreset_mode,
        }

    def _check_settled(self) -> None:
        self._pool.check_settled()

    def _prepare(self) -> None:
        pool = self._pool
        self._stepper = Step(pool.rows, pool.shape, pool.out, self._step_results, pool.outputs.resets)
        self.arrays = pool.outputs.arrays

    def _step_results(self, dtype: np.dtype[Any]) -> Callable[[], Results]:
        """The function that copies the outputs of a step with actions of this dtype."""
        outputs, observations = self._pool.outputs, self._observations

        def results() -> Results:
            return (
                observations(),
                outputs.reward.copy(),
                outputs.terminated.copy(),
                outputs.truncated.copy(),
                outputs.step_infos(dtype),
            )

        return results

    # ---- gymnasium.vector.VectorEnv ----

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, Info]:
        """Begins episodes. Returns the observations and the infos.

        seed: an int seeds row i with seed + i; a list has a seed for each row, or None to continue the row's stream.
        options["reset_mask"]: bool[num_envs]; rows that are False continue their episodes, with unchanged
        observations.
        """
        mask, pool = reset_mask_of(options, self.num_envs), self._pool
        pool.check_settled()
        pool.reseed(seed, mask)
        self._rows.flush()
        if mask is not None and pool.stale:
            self.observe()
        pool.stale = False
        return self._begin(mask, lambda: (self._observations(), pool.outputs.reset_infos(mask)))

    def _reset_row(self, row: int, seed: int | None) -> Any:
        """Begins an episode of one row. Returns its observation."""
        outputs = self._pool.outputs
        self._pool.check_settled()
        self._pool.reseed_row(row, seed)
        self._rows.flush()
        return self._begin(self._rows.only(row), lambda: outputs.observations.copy(outputs.obs[row]))

    def _begin(self, mask: BoolArray | None, results: Callable[[], T]) -> T:
        with self._rows.changing():
            self._rows.reset(mask, self._pool.out)
            found = results()
        if self._in_windows:
            self.render()
        return found

    def step(self, actions: ArrayLike) -> Results:
        """Takes a step in every row.

        actions: (num_envs, nu). The arithmetic uses float32 and float64 actions in their own precision, and lists and
        integers as float64. Returns observations, rewards float64[num_envs], terminations and truncations
        bool[num_envs], and the infos. All are new arrays, except observations with copy=False.

        If some rows fail, the others are stepped, and an exception is raised whose attribute `results` has what step
        would have returned. `statuses` tells which rows failed; their rewards are 0. `results` is None if no row was
        stepped.
        """
        results = self._stepper.step(actions)
        if self._in_windows:
            self.render()
        return results

    def render(self) -> tuple[Picture | None, ...]:  # type: ignore[override]
        """The picture of every row, as render of a single environment gives it. "human" has one window for each row."""
        self._pool.check_settled()
        return tuple(self._pool.pictures.draw(row) for row in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Frees the environments. The results of rows between send and recv are lost."""
        if hasattr(self, "_pool"):  # Gymnasium 1.0 also closes an environment whose __init__ failed
            self._pool.close()

    # ---- stepping some rows at a time ----

    def send(self, actions: ArrayLike, rows: ArrayLike | None = None) -> None:
        """Begins a step of some rows and returns at once.

        rows: their numbers, None for all. actions: (len(rows), nu), in the order of rows.
        """
        self._pool.send(actions, None if rows is None else row_numbers(rows))

    def recv(self, least: int | None = None) -> tuple[NDArray[np.int64], Any, Float64Array, BoolArray, BoolArray, Info]:
        """Waits until at least `least` of the sent rows are done (None: all), and returns all rows that are done.

        Returns the numbers of these rows, ascending, and then, for these rows, copies of what step returns. If
        some of them failed, raises an exception whose attribute `results` has what recv would have returned; `statuses`
        tells which rows failed.
        """
        wanted = None if least is None else min(operator.index(least), 2**63)
        if wanted is not None and wanted < 0:
            raise InvalidValueError(f"least is {wanted}, less than 0", Status.E_VALUE)
        pool = self._pool
        turn = [self._rows.enter()]
        try:
            rows, failure = pool.receive(wanted)
            outputs = pool.outputs
            infos = outputs.step_infos(pool.sent_dtype(rows), None if len(rows) == self.num_envs else rows)
            obs = outputs.observations.view(outputs.obs[rows])
            results = obs, outputs.reward[rows], outputs.terminated[rows], outputs.truncated[rows], infos
        finally:
            self._rows.leave(turn.pop())
        if not pool.pending:
            with self._rows.changing():
                pass  # writes what was assigned while rows were under way, and shows readers the new state
        if failure:
            failure.results = (rows, *results)
            try:
                raise failure
            finally:
                del failure  # its traceback has this frame
        if self._in_windows:
            for row in rows:
                pool.pictures.draw(int(row))
        return (rows, *results)

    @property
    def statuses(self) -> NDArray[np.int32]:
        """For each row mjenv.Status.OK, or DIVERGED if MuJoCo found the state diverged in the last step and restarted
        it. The option on_divergence="terminate" ends the episodes of such rows."""
        return self._pool.outputs.status.copy()

    # ---- planning ----

    def rollout(self, actions: ArrayLike, *, observations: bool = False) -> tuple[Any, ...]:
        """Plays actions (num_envs, steps, nu) open-loop from the rows' states; the rows stay in their last states.

        Returns rewards (float64), terminations and truncations (bool), each (num_envs, steps), and with
        observations=True the observations (num_envs, steps, n). A row that ends stays where it ended: its flags repeat,
        and its rewards are 0.
        """
        pool = self._pool
        array = np.asarray(actions)
        steps = array.shape[1] if array.ndim == 3 else 1
        action = pool.actions(array, (self.num_envs, steps, pool.shape[1]))
        obs = pool.outputs.obs
        obs_shape = obs.shape[1:] if observations else (0,)
        out = Batch(self.num_envs * steps, obs_shape, 0, FLOATS[obs.dtype])
        out.struct.info, out.struct.status = None, None
        if not observations:
            out.struct.obs = None
        with self._rows.changing():
            pool.stale = True
            self._rows.rollout(action, steps, byref(out.struct))
        terminated, truncated = out.ended.reshape(2, self.num_envs, steps)
        results = out.reward.reshape(self.num_envs, steps), terminated, truncated
        if not observations:
            return results
        return (*results, pool.outputs.observations.view(out.obs.reshape(self.num_envs, steps, *obs_shape)))

    def observe(self) -> Any:
        """The observations of the rows as they are, without a step: after restore, copy_row or rollout, for example."""
        with self._rows.changing():
            self._rows.observe(self._pool.out)
            self._pool.stale = False
            return self._observations()

    def _observe_row(self, row: int) -> Any:
        outputs = self._pool.outputs
        with self._rows.changing():
            self._rows.observe_row(row, self._pool.out)
            return outputs.observations.copy(outputs.obs[row])

    def set_state(self, qpos: ArrayLike, qvel: ArrayLike, mask: BoolArray | None = None) -> None:
        """Sets qpos (num_envs, nq) and qvel (num_envs, nv) of the rows where mask is True, of all rows without a mask.

        The same as set_state of each row. Wrong arguments change no row.
        """
        pool = self._pool
        chosen = np.arange(self.num_envs) if mask is None else np.flatnonzero(bool_mask(mask, self.num_envs, "mask"))
        states = [pool.of_rows("qpos", qpos, chosen), pool.of_rows("qvel", qvel, chosen)]
        pool.check_settled()
        pool.stale = True
        if mask is None:
            self._rows.set_state(ALL_ROWS, *states)
            return
        for row, *state in zip(chosen.tolist(), *states, strict=True):
            self._rows.set_state(row, *state)

    def copy_row(self, source: int, mask: BoolArray) -> None:
        """Copies the row `source` over the rows where mask is True: state, random stream, step count."""
        row, chosen = self._pool.row(source), bool_mask(mask, self.num_envs, "mask")
        self._pool.check_settled()
        self._rows.copy_row(row, chosen)
        self._pool.stale = True
        self._pool.copy_seed(row, chosen)

    def snapshot(self, row: int | None = None) -> bytes:
        """An image of a row, of all rows if row is None: state, random stream, step count."""
        self._pool.check_settled()
        return self._rows.snapshot(ALL_ROWS if row is None else self._pool.row(row))

    def restore(self, image: bytes, row: int | None = None) -> None:
        """Continues one row from an image of one row, or all rows from an image of all rows, bit for bit.

        The image may come from another process or another number of threads, but its environment must have had the same
        id and options. Raises SnapshotError if they differ or the image is damaged.
        """
        number = ALL_ROWS if row is None else self._pool.row(row)
        self._pool.check_settled()
        self._rows.restore(number, image_of(image))
        self._pool.stale = True
        self._pool.forget_seed(row)

    # ---- seeds ----

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """Each row's last seed; -1 where its stream came from a snapshot."""
        return self._pool.all_seeds()

    @property  # type: ignore[override, unused-ignore]
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """A copy of each row's random stream."""
        return tuple(row.np_random for row in self.envs)

    @np_random.setter
    def np_random(self, value: Any) -> NoReturn:
        raise AttributeError("np_random is read-only; reset takes seeds")

    # ---- the simulation of all rows ----

    @cached_property
    def model(self) -> Model:
        """The rows' mjModels: ``envs.model.body_mass[rows, body] = masses`` gives rows their own values.

        Arrays are (num_envs, ...), of all rows. An array that was written takes memory in every row.
        """
        return Model(self._rows, ALL_ROWS, self._pool.changed)

    @cached_property
    def data(self) -> Data:
        """The rows' mjData: ``envs.data.xfrc_applied[:, body, :3] = forces``. What MuJoCo computes is read-only.

        Each access to an array reads (num_envs, ...) of all rows, for which the library may have to compute the array
        again. To read arrays in every step, name them in the option arrays.
        """
        return Data(self._rows, ALL_ROWS, self._pool.changed)

    @cached_property
    def parameters(self) -> Parameters:
        """The live parameters of the task: ``envs.parameters["speed"][rows] = speeds`` gives rows new numbers.

        Each access reads (num_envs, ...) of all rows. Resets leave them as they are.
        """
        return Parameters(Arrays(self._rows, ALL_ROWS, Role.PARAMETERS, self._pool.changed, "parameters."))

    def set_constants(self) -> None:
        """Calls mj_setConst for every row: computes anew what MuJoCo derives from masses, sizes and qpos0.

        The rows end in the position qpos_spring: reset them, or set their states.
        """
        self._pool.check_settled()
        self._rows.set_constants(ALL_ROWS)
        self._pool.changed()

    def draw_range(self, array: str, number: int = 0) -> Float64Array:
        """The parameters of each row's distribution for an array: (num_envs, n), for "uniform" low and high.

        number: the index of the item, if randomize has a list of items for the array.
        """
        return self._rows.draw_range(array, number)

    def set_draw_range(self, array: str, parameters: ArrayLike, mask: BoolArray | None = None, number: int = 0) -> None:
        """Replaces these parameters from the next reset on, for a curriculum: (n,), or (num_envs, n).

        mask: the rows, None for all. A later call of randomize replaces the parameters of all rows again.
        """
        chosen = None if mask is None else bool_mask(mask, self.num_envs, "mask")
        self._pool.check_settled()
        self._rows.set_draw_range(array, parameters, number, chosen)

    # ---- single rows ----

    @property
    def envs(self) -> Sequence[Row]:
        """The rows as objects. Each has the attributes of a single row: data, model, set_state and the like."""
        return RowList(self, self._pool)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Calls a method of every row and returns the results. If `name` is not a method, returns the attribute."""
        if name == "dt":
            return tuple((self.model.opt.timestep * self.frame_skip).tolist())
        found = (getattr(row, name) for row in self.envs)
        return tuple(value(*args, **kwargs) if callable(value) else value for value in found)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of every row."""
        return self.call(name)

    @property
    def outputs(self) -> Outputs:
        """The arrays into which the library writes the results of steps and resets."""
        return self._pool.outputs

    @property
    def dt(self) -> float:
        """The seconds that one step simulates."""
        return self._rows.timestep() * self.frame_skip

    # ---- pickle, copy ----

    def __getstate__(self) -> dict[str, Any]:
        built = ("_stepper", "arrays", "model", "data", "parameters")
        return {name: value for name, value in self.__dict__.items() if name not in built}

    def __copy__(self) -> VectorEnv:
        """A deep copy, because two environments never share an episode."""
        return copying.deepcopy(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._prepare()

    def _observations(self) -> Any:
        outputs = self._pool.outputs
        return (outputs.observations.copy if self.copy else outputs.observations.view)(outputs.obs)
