"""Stable-Baselines3: check_env, PPO in processes and normalised, SAC, HER."""

import warnings

import gymnasium
import mjenv_sb3
import torch
from stable_baselines3 import PPO, SAC, HerReplayBuffer
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecMonitor, VecNormalize

from common import ON_MJENV, digest, id_of, show

warnings.simplefilter("ignore")
torch.set_num_threads(1)
ID = id_of("HalfCheetah-v5")
SHORT = {"n_steps": 128, "batch_size": 128, "n_epochs": 2, "seed": 0, "device": "cpu"}


def weights(model):
    return digest([value.detach().numpy() for value in model.policy.state_dict().values()])


def ppo(envs, steps=1024):
    return PPO("MlpPolicy", envs, **SHORT).learn(steps)


def main():
    check_env(gymnasium.make(ID), skip_render_check=True)
    for kind in (DummyVecEnv, SubprocVecEnv):
        envs = VecNormalize(make_vec_env(ID, n_envs=4, seed=0, vec_env_cls=kind))
        model = ppo(envs)
        show("PPO", kind.__name__, weights(model), digest(envs.obs_rms.mean))
        envs.close()
    model.save("build/clients-sb3")
    show("load, evaluate", evaluate_policy(PPO.load("build/clients-sb3", device="cpu"), make_vec_env(ID, 1, seed=3), 1))
    show(
        "SAC",
        weights(SAC("MlpPolicy", make_vec_env(ID, 1, seed=0), learning_starts=100, seed=0, device="cpu").learn(200)),
    )
    # On Gymnasium with its DummyVecEnv, of which mjenv_sb3.VecEnv gives the bits.
    own = mjenv_sb3.VecEnv("HalfCheetah-v5", 4) if ON_MJENV else DummyVecEnv([lambda: gymnasium.make(ID)] * 4)
    show("PPO, mjenv_sb3.VecEnv", weights(ppo(VecMonitor(own))))
    import gymnasium_robotics
    import mjenv_mazes  # noqa: F401

    gymnasium.register_envs(gymnasium_robotics)
    maze = gymnasium.make("mazes/PointMaze_UMaze-v3" if ON_MJENV else "PointMaze_UMaze-v3", max_episode_steps=50)
    future = {"n_sampled_goal": 4, "goal_selection_strategy": "future"}
    options = {"learning_starts": 100, "batch_size": 64, "device": "cpu", "seed": 0}
    agent = SAC("MultiInputPolicy", maze, replay_buffer_class=HerReplayBuffer, replay_buffer_kwargs=future, **options)
    show("HER", weights(agent.learn(200)))


if __name__ == "__main__":
    main()
