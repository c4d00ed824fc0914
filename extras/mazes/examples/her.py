"""Trains SAC with hindsight experience replay (Stable-Baselines3) on a PointMaze, and prints how many goals it reaches.

Usage: her.py [ID]. Needs PyTorch and Stable-Baselines3.
"""

import sys

import mjenv_mazes  # noqa: F401 registers the ids
import mjenv_sb3
import numpy as np
import torch
from stable_baselines3 import SAC, HerReplayBuffer

import mjenv

ROWS, STEPS = 16, 30000


def train(id: str, steps: int) -> SAC:
    """Trains a policy from a seed."""
    torch.set_num_threads(1)
    envs = mjenv_sb3.VecEnv(id, ROWS, num_threads=1, continuing_task=False)
    replay = {"n_sampled_goal": 4, "goal_selection_strategy": "future"}
    model = SAC(
        "MultiInputPolicy",
        envs,
        learning_rate=1e-3,
        gamma=0.98,
        learning_starts=ROWS * 310,  # HER needs whole episodes
        train_freq=1,
        gradient_steps=4,
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs=replay,
        policy_kwargs={"net_arch": [128, 128]},
        seed=1,
        device="cpu",
    )
    return model.learn(steps)


def reached(model: SAC, id: str, episodes: int = 200) -> float:
    """The share of episodes that end at their goal."""
    envs = mjenv.make_vec(id, episodes, num_threads=1, continuing_task=False)
    obs, _ = envs.reset(seed=1000)
    ended, found = np.zeros(episodes, bool), np.zeros(episodes, bool)
    while not ended.all():
        obs, _, terminated, truncated, _ = envs.step(model.predict(obs, deterministic=True)[0])
        found |= terminated & ~ended
        ended |= terminated | truncated
    return float(found.mean())


if __name__ == "__main__":
    id = sys.argv[1] if len(sys.argv) > 1 else "mazes/PointMaze_UMaze-v3"
    print(f"{reached(train(id, STEPS), id):.1%} of the goals")
