"""Environments of one id as a VecEnv of Stable-Baselines3. Needs the package stable-baselines3."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from ctypes import byref
from typing import Any, NoReturn

import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

import mjenv
from mjenv.capi.declarations import Role
from mjenv.rows.row import Row
from mjenv.rows.step import Info, Step, infos_of_rows

try:
    from stable_baselines3.common.vec_env import VecEnv as _VecEnv  # type: ignore[import-not-found, unused-ignore]
except ImportError as error:
    raise ImportError(f"mjenv_sb3 needs Stable-Baselines3: pip install stable-baselines3 ({error})") from error

Indices = int | Iterable[int] | None
Results = tuple[Any, NDArray[np.float32], NDArray[np.bool_], list[Info]]


class VecEnv(_VecEnv):  # type: ignore[misc, unused-ignore]
    """Equals Stable-Baselines3's DummyVecEnv over gymnasium.make(id).

    The step that ends an episode resets the row, its info has terminal_observation, and rewards are float32.
    """

    def __init__(self, id: str | EnvSpec, num_envs: int = 1, **options: Any) -> None:
        """options: those of mjenv.make_vec except autoreset_mode."""
        self.envs = mjenv.make_vec(id, num_envs, autoreset_mode=mjenv.AutoresetMode.SAME_STEP, **options)
        super().__init__(self.envs.num_envs, self.envs.single_observation_space, self.envs.single_action_space)
        self.metadata = self.envs.metadata
        self.actions: Any = None
        self._prepare()

    def _prepare(self) -> None:
        rows, outputs = self.envs.handle, self.envs.outputs
        shape, out = (rows.count, outputs.nu), byref(outputs.struct)
        self._stepper = Step(rows, shape, out, self._step_results, outputs.resets)

    def reset(self) -> Any:
        obs, _ = self.envs.reset(seed=self._seeds)
        self.reset_infos = self._infos_of_reset(slice(None))
        self._reset_seeds()
        self._reset_options()
        return obs

    def step_async(self, actions: NDArray[Any]) -> None:
        self.actions = actions

    def step_wait(self) -> Results:
        results = self._stepper.step(self.actions)
        if self.envs.render_mode == "human":
            self.envs.render()
        return results

    def _step_results(self, dtype: np.dtype[Any]) -> Callable[[], Results]:
        """The function that copies the outputs of a step with actions of this dtype."""
        outputs, fields = self.envs.outputs, self.envs.handle.fields(Role.INFO)
        observations = outputs.observations.copy if self.envs.copy else outputs.observations.view

        def results() -> Results:
            obs = observations(outputs.obs)
            dones = outputs.terminated | outputs.truncated
            infos = infos_of_rows(fields, outputs.info, self.num_envs, dtype, slice(None))
            ended = np.flatnonzero(dones)
            if len(ended):
                last = infos_of_rows(fields, outputs.final_info, self.num_envs, dtype, ended)
                for row, info, reset_info in zip(ended.tolist(), last, self._infos_of_reset(ended), strict=True):
                    infos[row], self.reset_infos[row] = info, reset_info
            for info, limit in zip(infos, (outputs.truncated & ~outputs.terminated).tolist(), strict=True):
                info["TimeLimit.truncated"] = limit
            for row in ended.tolist():
                infos[row]["terminal_observation"] = outputs.observations.copy(outputs.final_obs[row])
            return obs, outputs.reward.astype(np.float32), dones, infos

        return results

    def _infos_of_reset(self, rows: Any) -> list[Info]:
        fields, values = self.envs.handle.fields(Role.RESET_INFO), self.envs.outputs.reset_info
        return infos_of_rows(fields, values, self.num_envs, np.dtype(np.float64), rows)

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
        return {name: value for name, value in self.__dict__.items() if name != "_stepper"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._prepare()
