"""Records a dataset of Minari in a maze, with actions that the action space draws, in many rows at once.

Usage: record_dataset.py ID DATASET STEPS
Example: record_dataset.py mazes/PointMaze_UMaze-v3 mjenv/pointmaze/random-v0 1000000
"""

import sys

import gymnasium
import minari
import mjenv_mazes  # noqa: F401 registers the ids
import numpy as np
from minari.data_collector import EpisodeBuffer

import mjenv

ROWS = 256


def episodes(id, steps):
    """Yields episodes until they have so many steps."""
    limit = gymnasium.spec(id).max_episode_steps
    envs = mjenv.make_vec(id, ROWS, autoreset_mode="disabled", strict=False)
    envs.action_space.seed(0)
    while steps > 0:
        obs, _ = envs.reset(seed=steps)
        seen, acted, results = [obs], [], []
        for _ in range(limit):
            acted.append(envs.action_space.sample())
            obs, *result, _ = envs.step(acted[-1])
            seen.append(obs), results.append(result)
        actions, (rewards, terminated, truncated) = (
            np.stack(acted, 1),
            (np.stack(x, 1) for x in zip(*results, strict=True)),
        )
        seen = {name: np.stack([obs[name] for obs in seen], 1) for name in obs}
        for row, ended in enumerate(terminated | truncated):
            length = int(ended.argmax()) + 1
            cut = {name: values[row, : length + 1] for name, values in seen.items()}
            parts = [values[row, :length] for values in (actions, rewards, terminated, truncated)]
            yield EpisodeBuffer(None, steps + row, None, cut, *parts)
        steps -= int(((terminated | truncated).argmax(1) + 1).sum())


if __name__ == "__main__":
    id, dataset, steps = sys.argv[1:]
    made = minari.create_dataset_from_buffers(dataset, list(episodes(id, int(steps))), env=gymnasium.spec(id))
    print(f"{made.total_steps} steps, {made.total_episodes} episodes")
