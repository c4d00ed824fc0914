"""Builds a VectorEnv from an id or a spec, as gymnasium.make_vec does."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import DTypeLike

from mjenv.gym.make import spec_asked
from mjenv.gym.vector import VectorEnv
from mjenv.registration import spec as spec_of
from mjenv.rows.arguments import AutoresetMode


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

    id: one of ids(), or an EnvSpec, whose num_envs and vector_kwargs then hold as in gymnasium.make_vec. num_threads: 0
    for the CPUs this process may use. dtype: of the observations, float64 or float32 (rounded to nearest). copy=False:
    observations are views of an array that the next call overwrites. max_episode_steps, disable_env_checker, options:
    as in make, engine="4.0" and randomize too; arrays="xpos sensordata" exports these arrays of mjData with each step.
    """
    asked = spec_asked(id, options.get("engine"))
    given = deepcopy(asked.kwargs)
    given.pop("vectorization_mode", None)
    num_envs = given.pop("num_envs", num_envs)
    chosen = {**given.pop("vector_kwargs", {}), **given, **options}
    for name, value, default in (
        ("num_threads", num_threads, 0),
        ("autoreset_mode", autoreset_mode, AutoresetMode.NEXT_STEP),
        ("dtype", dtype, np.float64),
        ("copy", copy, True),
        ("max_episode_steps", max_episode_steps, None),
        ("disable_env_checker", disable_env_checker, None),
    ):
        if value != default:
            chosen[name] = value
    if asked.max_episode_steps is None:
        chosen.setdefault("max_episode_steps", -1)  # where gymnasium.make_vec would take the id's own limit

    own = spec_of(asked.id, chosen.get("engine"))
    made = VectorEnv(own.id, num_envs, **{"max_episode_steps": asked.max_episode_steps, **chosen})
    # gymnasium.make_vec(made.spec) builds the same environments.
    own.max_episode_steps = asked.max_episode_steps
    own.kwargs = {**chosen, "vectorization_mode": "vector_entry_point"}
    if num_envs != 1:
        own.kwargs["num_envs"] = num_envs
    made.spec = own
    return made
