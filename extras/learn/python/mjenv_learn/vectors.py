"""Vector environments of other libraries, as a training steps them."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import VectorEnv, VectorWrapper

from mjenv.capi.declarations import Dtype, Role, Status, mjenv_space
from mjenv.capi.dtypes import BOOL
from mjenv.capi.handle import pointer_to
from mjenv.capi.schema import Field
from mjenv.errors import InvalidValueError, OptionError
from mjenv.gym.vector import VectorEnv as OwnVector


class OtherVector(VectorWrapper):  # type: ignore[misc, type-arg, unused-ignore]
    """A gymnasium.vector.VectorEnv that is not mjenv's, with what a training asks of mjenv's: a handle and outputs."""

    def __init__(self, env: VectorEnv) -> None:  # type: ignore[type-arg, unused-ignore]
        super().__init__(env)
        spaces = {Role.OBSERVATION: env.single_observation_space, Role.ACTION: env.single_action_space}
        self._boxes = {role: space for role, space in spaces.items() if isinstance(space, Box)}
        for role in spaces.keys() - self._boxes.keys():
            raise OptionError(f"training needs a Box of {role.name.lower()}s, not {spaces[role]}", Status.E_TYPE)
        self.handle, self.count = self, env.num_envs
        spec = env.spec or next(iter(getattr(env.unwrapped, "envs", ())), env).spec
        self.id: str = spec.id if spec is not None else type(env.unwrapped).__name__
        obs = np.zeros((2, self.count, math.prod(self._boxes[Role.OBSERVATION].shape)))
        flags = np.zeros((2, self.count), BOOL)
        self.outputs = SimpleNamespace(
            obs=obs[0], final_obs=obs[1], reward=np.zeros(self.count), terminated=flags[0], truncated=flags[1]
        )

    def fields(self, role: Role) -> Sequence[Field]:
        """The actuators; the terms and groups of the observation are not known."""
        count = self.space(role).count if role == Role.ACTION else 0
        return [Field(str(index), (1,), index, 1, Dtype.FLOAT32, "") for index in range(count)]

    def space(self, role: Role) -> Any:
        """As mjenv_space_of."""
        box = self._boxes[role]
        low, high = (np.array(bound, np.float64).reshape(-1) for bound in (box.low, box.high))
        space = mjenv_space(ctypes.sizeof(mjenv_space), Dtype.FLOAT64, low.size)
        space.low, space.high = pointer_to(low, ctypes.c_double), pointer_to(high, ctypes.c_double)
        space.ndim, space.shape[0], space.owners = 1, low.size, (low, high)
        return space

    def reset(self, *, seed: Any = None, options: Any = None) -> Any:
        found = self.env.reset(seed=seed, options=options)
        self._take(found[0])
        return found

    def step(self, actions: Any) -> Any:
        box, outputs = self._boxes[Role.ACTION], self.outputs
        found = self.env.step(actions.reshape(self.count, *box.shape).astype(box.dtype))
        self._take(found[0])
        for to, values in zip((outputs.reward, outputs.terminated, outputs.truncated), found[1:4], strict=True):
            to[...] = values
        for row in np.flatnonzero(outputs.truncated):
            if "final_obs" not in found[4]:
                raise InvalidValueError(f"{self.id}: row {row} is truncated, but the infos have no final_obs")
            outputs.final_obs[row] = np.reshape(found[4]["final_obs"][row], -1)
        return found

    def _take(self, obs: Any) -> None:
        if np.shape(obs) != (self.count, *self._boxes[Role.OBSERVATION].shape):
            raise InvalidValueError(f"{self.id}: observations have the shape {np.shape(obs)}, unlike their space")
        self.outputs.obs[...] = np.reshape(obs, self.outputs.obs.shape)


def taken(envs: Any) -> Any:
    """The environments as a training takes them; None if these are none."""
    if isinstance(envs, OwnVector):
        return envs
    return OtherVector(envs) if isinstance(envs, VectorEnv) else None
