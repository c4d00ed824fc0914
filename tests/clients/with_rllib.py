"""RLlib: PPO on environments of an id."""

import warnings

import ray
from ray.rllib.algorithms.ppo import PPOConfig

import mjenv  # noqa: F401
from common import id_of, show

warnings.simplefilter("ignore")
ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
config = (
    PPOConfig()
    .environment(id_of("Hopper-v5"), env_config={"reset_noise_scale": 0.01})
    .env_runners(num_env_runners=0, num_envs_per_env_runner=2)
)
config = config.training(train_batch_size=256, minibatch_size=128, num_epochs=1).debugging(seed=0)
algorithm = config.build_algo()
result = algorithm.train()
show("PPO", result["env_runners"]["episode_return_mean"])
algorithm.stop()
ray.shutdown()
