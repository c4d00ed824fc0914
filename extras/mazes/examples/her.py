"""Trains SAC with hindsight experience replay (Stable-Baselines3) on a PointMaze, and prints how many goals it reaches.

On PointMaze_UMaze-v3: 100.0, 96.2 and 99.4 % of 1,000 with the seeds 1 to 3, after a minute of one core (AMD EPYC).
Usage: her.py [ID [SEED]]. Needs PyTorch and Stable-Baselines3.
"""

import sys

import mjenv_mazes  # noqa: F401 registers the ids
import mjenv_sb3
import numpy as np
import torch
from stable_baselines3 import SAC, HerReplayBuffer

import mjenv

ROWS, ACTIONS = 32, 30000
REPEAT = 5  # steps with each action: what a single step of 0.01 s changes is too little to learn from


class Repeated(mjenv_sb3.VecEnv):
    """Repeats actions. Episodes go on at their goals, as those do that hindsight makes of others."""

    def step_wait(self) -> mjenv_sb3.Results:
        return [super(Repeated, self).step_wait() for _ in range(REPEAT)][-1]


def train(id: str, seed: int = 1) -> SAC:
    """Trains a policy from a seed."""
    torch.set_num_threads(1)
    model = SAC(
        "MultiInputPolicy",
        Repeated(id, ROWS, num_threads=1),
        learning_rate=1e-3,
        gamma=0.97,
        tau=0.02,
        batch_size=512,
        learning_starts=ROWS * 62,  # HER needs whole episodes
        train_freq=1,
        gradient_steps=4,
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs={"n_sampled_goal": 4, "goal_selection_strategy": "future"},
        policy_kwargs={"net_arch": [128, 128]},
        seed=seed,
        device="cpu",
    )
    return model.learn(ACTIONS)


def reached(model: SAC, id: str, episodes: int = 1000) -> float:
    """The share of episodes that end at their goal."""
    envs = mjenv.make_vec(id, episodes, num_threads=1, continuing_task=False)
    obs, _ = envs.reset(seed=1000)
    ended, found, step = np.zeros(episodes, bool), np.zeros(episodes, bool), 0
    while not ended.all():
        if step % REPEAT == 0:
            action = model.predict(obs, deterministic=True)[0]
        obs, _, terminated, truncated, _ = envs.step(action)
        found |= terminated & ~ended
        ended |= terminated | truncated
        step += 1
    return float(found.mean())


if __name__ == "__main__":
    id = sys.argv[1] if len(sys.argv) > 1 else "mazes/PointMaze_UMaze-v3"
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    print(f"{reached(train(id, seed), id):.1%} of the goals")
