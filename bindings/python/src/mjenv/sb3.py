"""Environments of one id as a Stable-Baselines3 VecEnv, which its algorithms train on. Needs stable-baselines3."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NoReturn

import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from mjenv._abi import Role
from mjenv._arguments import AutoresetMode
from mjenv._handle import Field, Float64Array
from mjenv._outputs import FLOATS, Info, views
from mjenv._row import Row
from mjenv.env import _reader
from mjenv.vector import make_vec

try:
    from stable_baselines3.common.vec_env import VecEnv as _VecEnv  # type: ignore[import-not-found, unused-ignore]
except ImportError as error:
    raise ImportError(f"mjenv.sb3 needs Stable-Baselines3: pip install stable-baselines3 ({error})") from error

Indices = int | Iterable[int] | None


class _RowInfos:
    """Turns a block that the library lays out by fields into one info a row."""

    def __init__(self, fields: tuple[Field, ...], rows: int, action_dtype: np.dtype[Any]) -> None:
        self._fields, self._rows = fields, rows
        self._records = np.zeros((rows, sum(field.count for field in fields)))
        self._read = _reader(fields, action_dtype)

    def __call__(self, values: Float64Array, rows: Iterable[int]) -> list[Info]:
        for field, view in zip(self._fields, views(values, self._fields, self._rows), strict=True):
            self._records[:, field.offset : field.offset + field.count] = view.reshape(self._rows, field.count)
        return [self._read(self._records[row]) for row in rows]


class VecEnv(_VecEnv):  # type: ignore[misc, unused-ignore]
    """Equal to Stable-Baselines3's DummyVecEnv over gymnasium.make(id): a row that ends is reset at once, its info
    holds terminal_observation, and rewards are float32."""

    def __init__(self, id: str | EnvSpec, num_envs: int = 1, **options: Any) -> None:
        """options: as in mjenv.make_vec, but for autoreset_mode."""
        self.envs = make_vec(id, num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
        super().__init__(self.envs.num_envs, self.envs.single_observation_space, self.envs.single_action_space)
        self.metadata = self.envs.metadata
        self.actions: Any = None
        self._prepare()

    def _prepare(self) -> None:
        rows = self.envs._rows
        self._step_infos = {dtype: _RowInfos(rows.fields(Role.INFO), self.num_envs, dtype) for dtype in FLOATS}
        self._reset_infos = _RowInfos(rows.fields(Role.RESET_INFO), self.num_envs, np.dtype(np.float64))

    def reset(self) -> NDArray[Any]:
        obs, _ = self.envs.reset(seed=self._seeds)
        self.reset_infos = self._reset_infos(self.envs._outputs.reset_info, range(self.num_envs))
        self._reset_seeds()
        self._reset_options()
        return obs

    def step_async(self, actions: NDArray[Any]) -> None:
        self.actions = actions

    def step_wait(self) -> tuple[NDArray[Any], NDArray[np.float32], NDArray[np.bool_], list[Info]]:
        action = self.envs._actions(self.actions, self.envs._shape)
        obs, rewards, terminated, truncated, last = self.envs.step(action)
        dones = terminated | truncated
        outputs = self.envs._outputs
        read = self._step_infos[action.dtype]
        infos = read(outputs.info, range(self.num_envs))
        ended = np.flatnonzero(dones).tolist()
        if ended:
            for row, info, reset_info in zip(
                ended, read(outputs.final_info, ended), self._reset_infos(outputs.reset_info, ended), strict=True
            ):
                infos[row], self.reset_infos[row] = info, reset_info
        for info, limit in zip(infos, (truncated & ~terminated).tolist(), strict=True):
            info["TimeLimit.truncated"] = limit
        for row in ended:
            infos[row]["terminal_observation"] = last["final_obs"][row]
        return obs, rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        self.envs.close()

    def get_images(self) -> Sequence[NDArray[np.uint8]]:
        """The picture of every row, for render_mode "rgb_array"."""
        return self.envs.render()  # type: ignore[return-value]

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        return [getattr(row, attr_name) for row in self._targets(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> NoReturn:
        raise AttributeError(f"{attr_name!r} cannot be set: a row has no attributes of its own")

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        return [getattr(row, method_name)(*method_args, **method_kwargs) for row in self._targets(indices)]

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> list[bool]:
        """Always False: there are no wrappers around single rows."""
        return [False for _ in self._targets(indices)]

    def _targets(self, indices: Indices) -> list[Row]:
        rows = self.envs.envs
        return [rows[index] for index in self._get_indices(indices)]

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in ("_step_infos", "_reset_infos")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._prepare()
