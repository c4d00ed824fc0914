"""The environments of Minari's datasets recover on mjenv, and datasets of mjenv's environments by themselves."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import gymnasium
import gymnasium_robotics
import minari
import mjenv_mazes  # noqa: F401 registers the ids
import mujoco
import numpy as np
import pytest

from mjenv.capi.engine import name_of

sys.path.append(str(Path(__file__).parents[2] / "examples"))
import record_dataset

gymnasium.register_envs(gymnasium_robotics)
MAP = [[1, 1, 1, 1, 1], [1, "r", 0, "g", 1], [1, 1, 1, 1, 1]]


def replay(env: Any, dataset: Any, episode: Any) -> None:
    """Plays the actions of an episode and compares all numbers."""
    (metadata,) = dataset.storage.get_episode_metadata([episode.id])
    seen = [env.reset(seed=int(metadata["seed"]))[0]]
    for step, action in enumerate(episode.actions):
        obs, *results, _ = env.step(action)
        seen.append(obs)
        assert results == [episode.rewards[step], episode.terminations[step], episode.truncations[step]]
    for name, values in episode.observations.items():
        np.testing.assert_array_equal(np.stack([obs[name] for obs in seen]), values)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))


@pytest.mark.parametrize("id", ["PointMaze_UMaze-v3", "AntMaze_UMaze-v5"])
@pytest.mark.parametrize("options", [{}, {"maze_map": MAP, "reward_type": "dense", "continuing_task": False}])
def test_theirs(id: str, options: dict[str, Any]) -> None:
    env = minari.DataCollector(gymnasium.make(id, max_episode_steps=50, **options))
    for seed in range(2):
        env.reset(seed=seed)
        while not any(env.step(env.action_space.sample())[2:4]):
            pass
    env.create_dataset("maze/theirs/random-v0")
    dataset = minari.load_dataset("maze/theirs/random-v0")
    spec = dataset.env_spec
    options = {"max_episode_steps": spec.max_episode_steps, **spec.kwargs}
    ours = gymnasium.make(f"mazes/{spec.id}", engine=name_of(mujoco.__version__), **options)
    for episode in dataset:
        replay(ours, dataset, episode)


def test_ours() -> None:
    episodes = list(record_dataset.episodes("mazes/PointMaze_UMaze-v3", 1000))
    minari.create_dataset_from_buffers("maze/ours/random-v0", episodes, env=gymnasium.spec("mazes/PointMaze_UMaze-v3"))
    dataset = minari.load_dataset("maze/ours/random-v0")
    assert dataset.total_steps >= 1000
    for episode in list(dataset)[::50]:
        replay(dataset.recover_environment(), dataset, episode)
