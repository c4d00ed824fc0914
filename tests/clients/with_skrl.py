"""skrl: PPO on an environment and on a vector."""

import gymnasium
import torch
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.trainers.torch import SequentialTrainer
from skrl.utils import set_seed

import mjenv
from common import ON_MJENV, digest, id_of, show

torch.set_num_threads(1)


class Policy(GaussianMixin, Model):
    def __init__(self, observation_space, action_space):
        Model.__init__(self, observation_space=observation_space, action_space=action_space, device="cpu")
        GaussianMixin.__init__(self)
        self.net = torch.nn.Linear(self.num_observations, self.num_actions)
        self.log_std = torch.nn.Parameter(torch.zeros(self.num_actions))

    def compute(self, inputs, role):
        return self.net(inputs["observations"]), {"log_std": self.log_std}


class Value(DeterministicMixin, Model):
    def __init__(self, observation_space, action_space):
        Model.__init__(self, observation_space=observation_space, action_space=action_space, device="cpu")
        DeterministicMixin.__init__(self)
        self.net = torch.nn.Linear(self.num_observations, 1)

    def compute(self, inputs, role):
        return self.net(inputs["observations"]), {}


def ppo(env):
    set_seed(0)
    env = wrap_env(env, wrapper="gymnasium")
    spaces = env.observation_space, env.action_space
    models = {"policy": Policy(*spaces), "value": Value(*spaces)}
    cfg = PPO_CFG(rollouts=32, learning_epochs=2)
    cfg.experiment.write_interval = cfg.experiment.checkpoint_interval = 0
    memory = RandomMemory(memory_size=32, num_envs=env.num_envs, device="cpu")
    agent = PPO(
        models=models, memory=memory, cfg=cfg, observation_space=spaces[0], action_space=spaces[1], device="cpu"
    )
    SequentialTrainer(
        env=env, agents=agent, cfg={"timesteps": 96, "headless": True, "disable_progressbar": True}
    ).train()
    return digest([value.detach().numpy() for value in models["policy"].state_dict().values()])


show("one", ppo(gymnasium.make(id_of("Hopper-v5"))))
vector = mjenv.make_vec("Hopper-v5", 4) if ON_MJENV else gymnasium.make_vec("Hopper-v5", 4, vectorization_mode="sync")
show("vector", ppo(vector))
