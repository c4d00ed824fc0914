"""Observations that are a Dict (the option observation), against Gymnasium's wrappers for Dict spaces, every bit."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import FlattenObservation, FrameStackObservation, TimeAwareObservation

import mjenv
from conftest import IDS
from mjenv.verify import check_same
from test_wrappers import actions_of, check_vectors


class Parts(gymnasium.ObservationWrapper):  # type: ignore[misc]
    """Gymnasium's observation as a Dict."""

    def __init__(self, env: Any, names: list[str], counts: list[int]) -> None:
        super().__init__(env)
        self._names, self._ends = names, np.cumsum(counts)[:-1]
        space = env.observation_space
        bounds = zip(names, np.split(space.low, self._ends), np.split(space.high, self._ends), strict=True)
        self.observation_space = Dict(
            OrderedDict((name, Box(low, high, dtype=np.float64)) for name, low, high in bounds)
        )

    def observation(self, observation: Any) -> Any:
        return dict(zip(self._names, np.split(observation, self._ends), strict=True))


class Float64Time(gymnasium.ObservationWrapper):  # type: ignore[misc]
    """The time as float64, which all of mjenv's observations are, and as the last key."""

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        spaces = {name: space for name, space in env.observation_space.spaces.items() if name != "time"}
        self.observation_space = Dict(OrderedDict({**spaces, "time": Box(0.0, 1.0, (1,), np.float64)}))

    def observation(self, observation: Any) -> Any:
        time = observation.pop("time").astype(np.float64)
        return {**observation, "time": time}


def parts_of(id: str) -> tuple[list[str], list[int]]:
    fields = mjenv.make(id, observation="flat").fields("observation")
    return [field.name for field in fields], [field.count for field in fields]


def sorted_keys(results: tuple[Any, ...]) -> tuple[Any, ...]:
    """The observation with sorted keys, as TimeAwareObservation leaves them; and the other results."""
    return dict(sorted(results[0].items())), *results[1:]


CASES: list[tuple[dict[str, Any], Any]] = [
    ({}, lambda env: env),
    ({"history": 3}, lambda env: FrameStackObservation(env, 3)),
    ({"history": 2, "history_padding": "zero"}, lambda env: FrameStackObservation(env, 2, padding_type="zero")),
    (
        {"time_aware": True},
        lambda env: Float64Time(TimeAwareObservation(env, flatten=False, normalize_time=True)),
    ),
    (
        {"time_aware": True, "history": 4},
        lambda env: FrameStackObservation(
            Float64Time(TimeAwareObservation(env, flatten=False, normalize_time=True)), 4
        ),
    ),
]
NAMES = [" ".join(f"{name}={value}" for name, value in options.items()) or "plain" for options, _ in CASES]


@pytest.mark.parametrize("id", IDS)
@pytest.mark.parametrize(("options", "wrap"), CASES, ids=NAMES)
def test_single(id: str, options: dict[str, Any], wrap: Any) -> None:
    names, counts = parts_of(id)
    ours = mjenv.make(id, max_episode_steps=9, observation="dict", **options)
    theirs = wrap(Parts(gymnasium.make(id, max_episode_steps=9), names, counts))
    assert ours.observation_space == theirs.observation_space
    flattened = FlattenObservation(mjenv.make(id, max_episode_steps=9, observation="dict", **options))
    whole = mjenv.make(id, max_episode_steps=9, **{name: x for name, x in options.items() if name == "time_aware"})
    first = flattened.reset(seed=1)[0], whole.reset(seed=1)[0]
    if "history" not in options:
        check_same("flat", *first)
    for seed, dtype in ((1, np.float32), (None, np.float64)):
        check_same("reset", *map(sorted_keys, (ours.reset(seed=seed), theirs.reset(seed=seed))))
        for t, action in enumerate(actions_of(ours.action_space, 9, 5, dtype)):
            ours_step, theirs_step = ours.step(action), theirs.step(action)
            check_same(f"step {t}", sorted_keys(ours_step), sorted_keys(theirs_step))
            assert ours.observation_space.contains(ours_step[0])
            if ours_step[2] or ours_step[3]:
                break
    ours.close(), theirs.close()


@pytest.mark.parametrize("options", [{}, {"num_threads": 2}, {"lanes": 0}, {"copy": False}], ids=str)
@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("id", ["HalfCheetah-v5", "Hopper-v4"])
def test_vector(id: str, mode: AutoresetMode, options: dict[str, Any]) -> None:
    """Rows whose episodes end at different times: the dicts in final_obs, too."""
    rows, (names, counts) = 9, parts_of(id)
    case = {"observation": "dict", "history": 3}
    ours = mjenv.make_vec(id, rows, autoreset_mode=mode, max_episode_steps=13, **options, **case)

    def one() -> Any:
        env = FrameStackObservation(Parts(gymnasium.make(id, max_episode_steps=13), names, counts), 3)
        env.metadata = dict(env.metadata)  # SyncVectorEnv writes into it, which would change that of the class
        return env

    check_vectors(ours, SyncVectorEnv([one] * rows, autoreset_mode=mode), steps=40)
