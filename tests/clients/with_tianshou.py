"""Tianshou: its vectors of environments, and the adapter for mjenv.make_vec in docs/clients.md; PPO on both."""

import re
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np
import torch
from tianshou.algorithm import PPO
from tianshou.algorithm.modelfree.reinforce import ProbabilisticActorPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv, ShmemVectorEnv, SubprocVectorEnv
from tianshou.trainer import OnPolicyTrainerParams
from tianshou.utils.net.common import Net
from tianshou.utils.net.continuous import ContinuousActorProbabilistic, ContinuousCritic

from common import ON_MJENV, digest, id_of, show

torch.set_num_threads(1)
ADAPTER = re.search(r"```python\n(.*?)```", Path("docs/clients.md").read_text(), re.DOTALL)[1]


def make():
    return gymnasium.make(id_of("Hopper-v5"))


def play(envs):
    envs.seed(3)
    rng, found = np.random.default_rng(0), [envs.reset()[0]]
    for ids in [None, [2, 0], [1]] * 40:
        actions = rng.uniform(-1, 1, (len(ids or envs), 3)).astype(np.float32)
        obs, reward, terminated, truncated, infos = envs.step(actions, ids)
        found.append([obs, reward, terminated, truncated, [info["env_id"] for info in infos]])
        if (ended := np.flatnonzero(terminated | truncated)).size:
            found.append(envs.reset(np.arange(3)[ids or slice(None)][ended])[0])
    found.append(len(envs.get_env_attr("action_space", [2, 0])))
    envs.close()
    return digest(found)


def ppo(envs):
    torch.manual_seed(0)
    np.random.seed(0)
    envs.seed(3)
    [space, *_], [observed, *_] = envs.action_space, envs.observation_space
    net = partial(Net, state_shape=observed.shape, hidden_sizes=(32,))
    policy = ProbabilisticActorPolicy(
        actor=ContinuousActorProbabilistic(preprocess_net=net(), action_shape=space.shape),
        dist_fn=lambda parts: torch.distributions.Independent(torch.distributions.Normal(*parts), 1),
        action_space=space,
    )
    model = PPO(policy=policy, critic=ContinuousCritic(preprocess_net=net()), optim=AdamOptimizerFactory())
    model.run_training(
        OnPolicyTrainerParams(
            training_collector=Collector(model, envs, VectorReplayBuffer(600, len(envs))),
            max_epochs=2,
            epoch_num_steps=300,
            collection_step_num_env_steps=300,
            update_step_num_repetitions=2,
            batch_size=64,
            test_collector=None,
        )
    )
    envs.close()
    return digest([value.numpy() for value in model.state_dict().values() if isinstance(value, torch.Tensor)])


def main():
    for kind in (DummyVectorEnv, SubprocVectorEnv, ShmemVectorEnv):
        show(kind.__name__, play(kind([make] * 3)))
    names = {}
    exec(ADAPTER, names)
    rows = partial(names["Rows"], "Hopper-v5", 3) if ON_MJENV else partial(DummyVectorEnv, [make] * 3)
    show("adapter", play(rows()))
    show("PPO", ppo(DummyVectorEnv([make] * 3)), ppo(rows()))


if __name__ == "__main__":
    main()
