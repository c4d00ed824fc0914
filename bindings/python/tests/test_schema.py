"""What the library says of each id, against what Gymnasium declares (tests/golden/schema.txt)."""

from typing import Any

import gymnasium
import numpy as np
import pytest

import golden
import mjenv

Schema = dict[str, list[list[str]]]


def recorded() -> dict[str, Schema]:
    ids: dict[str, Schema] = {}
    for line in (golden.FOLDER / "schema.txt").read_text().splitlines():
        key, *words = line.split(" ")
        if key == "id":
            ids[words[0]] = {}
        elif ids and key != "#":
            ids[list(ids)[-1]].setdefault(key, []).append(words)
    return ids


SCHEMA = recorded()


def one(schema: Schema, key: str) -> str:
    [[value]] = schema[key]
    return value


def test_ids() -> None:
    assert mjenv.ids() == tuple(sorted(SCHEMA))
    assert len(SCHEMA) == 22


@pytest.mark.parametrize("id", SCHEMA)
def test_options(id: str) -> None:
    """Gymnasium's, with its defaults and in its order, before those of mjenv."""
    expected: dict[str, Any] = {name: golden.option_value(kind, v) for name, kind, *v in SCHEMA[id].get("option", [])}
    options = mjenv.options(id)
    assert list(options)[: len(expected)] == list(expected)
    assert {name: options[name].default for name in expected} == expected
    assert all(option.doc for option in options.values())
    assert {"max_episode_steps", "strict", "norm"} <= set(options) - set(expected)


@pytest.mark.parametrize("id", SCHEMA)
def test_spec(id: str) -> None:
    schema = SCHEMA[id]
    spec = mjenv.spec(id)
    threshold = one(schema, "reward_threshold")
    assert spec.reward_threshold == (None if threshold in ("none", "nan") else float.fromhex(threshold))
    assert spec.max_episode_steps == int(one(schema, "max_episode_steps"))
    gymnasiums = gymnasium.spec(id)
    gymnasiums.entry_point = spec.entry_point
    gymnasiums.vector_entry_point = spec.vector_entry_point
    assert spec == gymnasiums


@pytest.mark.parametrize("id", SCHEMA)
def test_environment(id: str) -> None:
    schema = SCHEMA[id]
    env = mjenv.make(id)
    assert env.metadata == {
        "render_modes": ["human", "rgb_array", "depth_array", "rgbd_tuple"],
        "render_fps": int(one(schema, "render_fps")),
    }
    assert env.frame_skip == int(one(schema, "frame_skip"))
    assert env.dt == float.fromhex(one(schema, "dt"))
    structure = {name: int(count) for name, count in schema.get("structure", [])}
    assert getattr(env, "observation_structure", {}) == structure
    assert hasattr(env, "observation_structure") == bool(structure)

    env.reset(seed=1)
    reward = env.step(env.action_space.sample())[1]
    assert type(reward) is golden.TYPES[one(schema, "reward")]

    spaces = {"observation": env.observation_space, "action": env.action_space}
    for role, dtype, count in schema["space"]:
        space = spaces[role]
        assert isinstance(space, gymnasium.spaces.Box)
        assert space.dtype == np.dtype(dtype)
        assert space.shape == (int(count),)
        for side in ("low", "high"):
            [bounds] = (words for name, *words in schema[side] if name == role)
            expected = np.broadcast_to([float.fromhex(word) for word in bounds], space.shape)
            assert getattr(space, side).tolist() == expected.tolist()
