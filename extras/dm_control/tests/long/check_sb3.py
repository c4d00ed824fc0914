"""Stable-Baselines3 learns cartpole-swingup on the ids that Shimmy has, with mjenv in the place of dm_control.

Part dm_control of tests/run --long runs it, on the Python of `tools/setup training` with dm_env added.
"""

from __future__ import annotations

import gymnasium
import torch
from gymnasium.wrappers import FlattenObservation
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecNormalize

ID = "mjenv_dm_control:dm_control/cartpole-swingup-v0"
ENOUGH, STEPS, ROWS = 800, 1_500_000, 16


class Until(BaseCallback):
    """Ends the training when the mean return of the last 20 episodes is high enough."""

    def _on_step(self) -> bool:
        returns = [episode["r"] for episode in self.model.ep_info_buffer][-20:]
        return len(returns) < 20 or sum(returns) / 20 <= ENOUGH + 20


def test_cartpole_swingup() -> None:
    torch.set_num_threads(1)
    envs = VecNormalize(make_vec_env(ID, ROWS, seed=1, wrapper_class=FlattenObservation))
    model = PPO("MlpPolicy", envs, 5e-4, n_steps=256, batch_size=512, n_epochs=10, seed=1, device="cpu")
    model.learn(STEPS, callback=Until())
    envs.training, envs.norm_reward = False, False
    mean, _ = evaluate_policy(model, envs, n_eval_episodes=ROWS)
    print(f"{model.num_timesteps} steps, mean return {mean:.1f} of {ROWS} episodes")
    assert mean > ENOUGH
    assert type(gymnasium.make(ID).unwrapped).__module__ == "mjenv_dm_control.gym"
