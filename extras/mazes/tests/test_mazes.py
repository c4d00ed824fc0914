"""The mazes equal those of Gymnasium-Robotics: spaces, models, and every number of resets and steps."""

from __future__ import annotations

import pickle
from typing import Any

import gymnasium
import gymnasium_robotics
import mjenv_mazes  # noqa: F401 registers the ids
import mujoco
import numpy as np
import pytest

import mjenv
from compiled_model import differences, fields
from mjenv.capi.engine import name_of
from mjenv.verify import check_same

gymnasium.register_envs(gymnasium_robotics)
ENGINE = name_of(mujoco.__version__)
SIZES = "UMaze Open Open_Diverse_G Open_Diverse_GR Medium Medium_Diverse_G Medium_Diverse_GR Large Large_Diverse_G"
SIZES += " Large_Diverse_GR"
IDS = [
    f"{robot}Maze_{size}{reward}-{version}"
    for robot, version in (("Point", "v3"), ("Ant", "v4"), ("Ant", "v5"))
    for size in SIZES.split()
    for reward in ("", "Dense")
]
MAP = [[1, 1, 1, 1, 1, 1], [1, "r", 0, "c", "g", 1], [1, 0, "g", 1, 1, 1], [1, 1, 1, 1, 1, 1]]


def pair(id: str, **options: Any) -> tuple[Any, Any]:
    """mjenv's environment and Gymnasium-Robotics'."""
    ours = gymnasium.make(f"mazes/{id}", engine=ENGINE, disable_env_checker=True, **options)
    theirs = gymnasium.make(id, disable_env_checker=True, **options)
    return ours.unwrapped, theirs.unwrapped


def toward(obs: dict[str, Any], rng: np.random.Generator, size: int) -> Any:
    """An action: a ball goes to its goal, or for a while anywhere, so that it hits walls; an Ant struggles."""
    if size == 8:
        return rng.uniform(-1, 1, size).astype(np.float32)
    way = obs["desired_goal"] - obs["achieved_goal"]
    action = way - 0.3 * obs["observation"][2:] if rng.uniform() < 0.7 else rng.uniform(-3, 3, size)
    return np.clip(action, -1.5, 1.5).astype(np.float32)


def play(ours: Any, theirs: Any, seed: int, steps: int, reset: dict[str, Any] | None = None) -> int:
    """An episode in both. Returns in how many steps the goal was reached."""
    rng = np.random.default_rng(seed)
    mine, other = ours.reset(seed=seed, options=reset), theirs.reset(seed=seed, options=reset)
    check_same("reset", mine, other)
    reached = 0
    for step in range(steps):
        action = toward(mine[0], rng, ours.action_space.shape[0])
        mine, other = ours.step(action), theirs.step(action)
        check_same(f"step {step}", mine, other)
        reached += other[4]["success"]
        if other[2]:
            break
    check_same("the next reset", ours.reset(options=reset), theirs.reset(options=reset))
    return reached


@pytest.mark.parametrize("id", IDS)
def test_episodes(id: str, request: pytest.FixtureRequest) -> None:
    long = request.config.getoption("--long")
    ours, theirs = pair(id)
    assert ours.observation_space == theirs.observation_space
    assert list(ours.observation_space) == list(theirs.observation_space)  # the order of gymnasium.spaces.flatten
    vector = mjenv.make_vec(f"mazes/{id}", 1, engine=ENGINE)
    assert list(vector.single_observation_space) == list(vector.observation_space) == list(theirs.observation_space)
    assert ours.action_space == theirs.action_space
    assert mjenv.spec(f"mazes/{id}").max_episode_steps == gymnasium.spec(id).max_episode_steps
    limit = gymnasium.spec(id).max_episode_steps or 0
    for seed in range(3 if long else 1):
        play(ours, theirs, seed, limit if long else 60)


@pytest.mark.parametrize("id", ["PointMaze_Open-v3", "PointMaze_OpenDense-v3", "PointMaze_Open_Diverse_GR-v3"])
@pytest.mark.parametrize(
    "options",
    [
        {"reset_target": True},
        {"continuing_task": False},
        {"reward_type": "dense"},
        {"maze_map": MAP, "reset_target": True},
    ],
    ids=lambda options: "-".join(options),
)
def test_options(id: str, options: dict[str, Any]) -> None:
    ours, theirs = pair(id, **options)
    reached = [play(ours, theirs, seed, 300) for seed in range(3)]
    assert max(reached) > 0


@pytest.mark.parametrize("id", ["AntMaze_UMaze-v4", "AntMaze_UMaze-v5"])
@pytest.mark.parametrize(
    "options",
    [{"healthy_z_range": (0.5, 0.6)}, {"ctrl_cost_weight": 2, "healthy_reward": 3}, {"maze_map": MAP}],
    ids=lambda options: "-".join(options),
)
def test_options_of_the_ant(id: str, options: dict[str, Any]) -> None:
    play(*pair(id, **options), 0, 40)
    forces = {"use_contact_forces": True} if id.endswith("v4") else {"include_cfrc_ext_in_observation": False}
    play(*pair(id, **forces, terminate_when_unhealthy=False, contact_force_range=(-0.5, 0.7)), 1, 40)


@pytest.mark.parametrize(
    "cells", [{"goal_cell": [1, 1]}, {"reset_cell": [3, 1]}, {"goal_cell": [3, 3], "reset_cell": [1, 2]}]
)
@pytest.mark.parametrize("id", ["PointMaze_UMaze-v3", "AntMaze_UMaze-v5"])
def test_cells_of_a_reset(id: str, cells: dict[str, Any]) -> None:
    play(*pair(id), 5, 30, {name: np.array(cell) for name, cell in cells.items()})


def test_cells_that_are_walls() -> None:
    with gymnasium.make("mazes/PointMaze_UMaze-v3") as env:
        for cell in ([0, 0], [2, 1], [9, 1], [1, 99]):
            with pytest.raises(mjenv.TaskError, match="is no free cell"):
                env.reset(options={"goal_cell": cell})
        for cell in ([np.inf, 1], [1, np.nan]):
            with pytest.raises(mjenv.InvalidValueError):
                env.reset(options={"goal_cell": cell})
        env.reset(seed=1)


@pytest.mark.parametrize("maze_map", [[], [[1, 1]], [[1, 0, 0], [1]], [[1, 0, 0, "x"]], [[0]]])
def test_maps_that_are_no_mazes(maze_map: Any) -> None:
    with pytest.raises(mjenv.InvalidValueError, match="is no maze"):
        gymnasium.make("mazes/PointMaze_UMaze-v3", maze_map=maze_map)


def test_a_model_without_the_walls_of_the_map() -> None:
    with pytest.raises(mjenv.ModelError, match="block_"):
        mjenv.make("mazes/PointMaze_UMaze-v3", maze_map="######/#....#/######")


@pytest.mark.parametrize("id", [id for id in IDS if "Dense" not in id and not id.endswith("v4")])
def test_model(id: str) -> None:
    ours, theirs = pair(id)
    mine = mujoco.MjModel.from_xml_string(mjenv.model_xml(f"mazes/{id}"))
    theirs.model.site_pos[theirs.target_site_id, :2] = 0  # resets move it
    lines = differences(fields(mine), fields(theirs.model))
    assert not lines, "\n".join(lines[:40])
    ours.close()


def test_goals() -> None:
    """What hindsight experience replay asks."""
    rng = np.random.default_rng(0)
    achieved = rng.uniform(-1, 1, (50, 2))
    desired = achieved + rng.uniform(-0.5, 0.5, (50, 2))
    for options in ({"continuing_task": False}, {"reward_type": "dense"}):
        ours, theirs = pair("PointMaze_UMaze-v3", **options)
        np.testing.assert_array_equal(
            ours.compute_reward(achieved, desired, {}), theirs.compute_reward(achieved, desired, {})
        )
        for goals in zip(achieved, desired, strict=True):
            assert ours.compute_terminated(*goals, {}) is theirs.compute_terminated(*goals, {})
        assert ours.compute_terminated(achieved, desired, {}).shape == (50,)
        assert not ours.compute_truncated(achieved, desired, {}).any()


def test_rows() -> None:
    """A vector gives what single environments give, in lanes too, also after snapshots."""
    for id in ("PointMaze_Medium-v3", "AntMaze_UMaze-v5"):
        envs = mjenv.make_vec(f"mazes/{id}", 8, engine=ENGINE, lanes="max", reset_target=True)
        singles = [pair(id, reset_target=True)[0] for _ in range(8)]
        obs, _ = envs.reset(seed=3)
        for row, env in enumerate(singles):
            check_same("reset", {name: values[row] for name, values in obs.items()}, env.reset(seed=3 + row)[0])
        image, rng = envs.snapshot(), np.random.default_rng(0)
        for _ in range(2):
            for step in range(20):
                actions = rng.uniform(-1, 1, envs.action_space.shape).astype(np.float32)
                obs, rewards, *_ = envs.step(actions)
                for row, env in enumerate(singles):
                    mine, reward, *_ = env.step(actions[row])
                    check_same(f"step {step}", {name: values[row] for name, values in obs.items()}, mine)
                    assert rewards[row] == reward
            envs.restore(image)
            for row, env in enumerate(singles):
                env.reset(seed=3 + row)


def test_target() -> None:
    """The site that shows the goal in pictures is where it is, also after the goal has moved."""
    ours, theirs = pair("PointMaze_Open-v3", reset_target=True)
    rng, places = np.random.default_rng(0), set()
    obs = ours.reset(seed=0)[0]
    theirs.reset(seed=0)
    for _ in range(300):
        for array in ("site_pos", "site_xpos"):
            mine, other = (getattr(env.model if array == "site_pos" else env.data, array) for env in (ours, theirs))
            np.testing.assert_array_equal(mine, other)
        places.add(tuple(ours.model.site_pos[0]))
        action = toward(obs, rng, 2)
        obs = ours.step(action)[0]
        theirs.step(action)
    assert len(places) > 1


def test_pickle() -> None:
    ours, theirs = pair("PointMaze_Open-v3", maze_map=MAP)
    ours.reset(seed=1), theirs.reset(seed=1)
    copy = pickle.loads(pickle.dumps(ours))
    check_same("step", copy.step(np.ones(2, np.float32)), theirs.step(np.ones(2, np.float32)))
