"""Observations that are a Dict, by the option observation. tests/live/test_dict.py compares them with Gymnasium's."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, Dict

import mjenv

STEPS = 12
SIZES = {"qpos": 5, "qvel": 6}


def joined(obs: dict[str, Any]) -> Any:
    """The parts behind each other, as the flat observation has them."""
    assert list(obs) == list(SIZES)
    return np.concatenate([obs["qpos"], obs["qvel"]], axis=-1)


def actions(rows: int, seed: int = 0) -> Any:
    return np.random.default_rng(seed).uniform(-1, 1, (STEPS, rows, 3)).astype(np.float32)


@pytest.mark.parametrize(
    "options", [{}, {"copy": False}, {"dtype": np.float32}, {"autoreset_mode": "same_step"}], ids=str
)
def test_vectors_have_the_parts_of_the_flat_observation(options: dict[str, Any]) -> None:
    made = {
        kind: mjenv.make_vec("Hopper-v5", 4, observation=kind, max_episode_steps=5, **options)
        for kind in ("flat", "dict")
    }
    flat, parts = made["flat"], made["dict"]
    dtype = options.get("dtype", np.float64)
    assert flat.single_observation_space == Box(-np.inf, np.inf, (11,), dtype)
    assert parts.single_observation_space == Dict(
        {name: Box(-np.inf, np.inf, (size,), dtype) for name, size in SIZES.items()}
    )
    assert np.array_equal(flat.reset(seed=1)[0], joined(parts.reset(seed=1)[0]))
    ends = 0
    for action in actions(4):
        a, b = flat.step(action), parts.step(action)
        assert parts.observation_space.contains(b[0])
        assert np.array_equal(a[0], joined(b[0]))
        assert b[0]["qpos"].flags.c_contiguous or not parts.copy
        for x, y in zip(a[4].get("final_obs", ()), b[4].get("final_obs", ()), strict=True):
            ends += x is not None
            assert (x is None and y is None) or np.array_equal(x, joined(y))
        assert np.array_equal(flat.observe(), joined(parts.observe()))
    assert ends > 0 or "autoreset_mode" not in options
    # A view of the library's memory, or a copy.
    obs = parts.step(actions(4)[0])[0]
    before = obs["qvel"].copy()
    parts.step(actions(4)[1])
    assert np.array_equal(before, obs["qvel"]) == parts.copy


def test_rollouts_and_single_rows() -> None:
    flat, parts = (mjenv.make_vec("Hopper-v5", 3, observation=kind) for kind in ("flat", "dict"))
    plan = actions(3).swapaxes(0, 1)
    for env in (flat, parts):
        env.reset(seed=5)
    whole, by_part = (env.rollout(plan, observations=True) for env in (flat, parts))
    assert by_part[3]["qvel"].shape == (3, STEPS, 6)
    assert np.array_equal(whole[3], joined(by_part[3]))
    for env in (flat, parts):
        env.reset(seed=6)
        env.send(plan[:2, 0], [2, 0])
    (rows, whole_obs, *_), (same_rows, obs, *_) = flat.recv(), parts.recv()
    assert rows.tolist() == same_rows.tolist() == [0, 2]
    assert np.array_equal(whole_obs, joined(obs))
    mask = {"reset_mask": np.array([False, True, False])}
    assert np.array_equal(flat.reset(seed=9, options=dict(mask))[0], joined(parts.reset(seed=9, options=dict(mask))[0]))


def test_snapshots_and_copies() -> None:
    """An image fits environments of both kinds, unless a history is kept key by key."""
    flat, parts = (mjenv.make("Hopper-v5", observation=kind) for kind in ("flat", "dict"))
    flat.reset(seed=3), parts.reset(seed=4)
    flat.step(actions(1)[0, 0])
    parts.restore(flat.snapshot())
    twins = [parts, copy.deepcopy(parts), pickle.loads(pickle.dumps(parts))]
    expected = flat.step(actions(1)[1, 0])[0]
    for twin in twins:
        assert np.array_equal(expected, joined(twin.step(actions(1)[1, 0])[0]))
    envs = mjenv.make_vec("Hopper-v5", 2, observation="dict")
    envs.reset(seed=1)
    other = pickle.loads(pickle.dumps(envs))
    a, b = envs.step(actions(2)[0])[0], other.step(actions(2)[0])[0]
    assert np.array_equal(joined(a), joined(b))
    stacked = [mjenv.make("Hopper-v5", observation=kind, history=2) for kind in ("flat", "dict")]
    for env in stacked:
        env.reset(seed=1)
    with pytest.raises(mjenv.SnapshotError):
        stacked[0].restore(stacked[1].snapshot())


def test_terms_of_a_history() -> None:
    env = mjenv.make("Hopper-v5", observation="dict", history="qvel=3")
    assert {name: space.shape for name, space in env.observation_space.spaces.items()} == {
        "qpos": (5,),
        "qvel": (3, 6),
    }
    obs, _ = env.reset(seed=2)
    assert np.array_equal(obs["qvel"], np.stack([obs["qvel"][0]] * 3))


def test_a_wrong_kind_is_refused() -> None:
    with pytest.raises(mjenv.InvalidValueError, match="one of auto, flat, dict"):
        mjenv.make("Hopper-v5", observation="list")
