"""MaMuJoCo: several agents move one robot. parallel_env is its own, on mjenv; MultiAgentRows has all rows at once."""

import gymnasium
import numpy as np
from gymnasium_robotics import mamujoco_v1

import mjenv


def parallel_env(robot, agents, agent_obsk=1, **options):
    env = gymnasium.make(f"mjenv:mjenv/{robot}-v5", disable_env_checker=True, **options)
    return mamujoco_v1.parallel_env(robot, agents, agent_obsk=agent_obsk, gym_env=env)


class MultiAgentRows:
    """Observations and actions are dicts of arrays (rows, ...), by agents; rewards and flags are all agents'."""

    def __init__(self, robot, agents, num_envs, agent_obsk=1, **options):
        one = parallel_env(robot, agents, agent_obsk)
        partitions = zip(one.possible_agents, one.agent_action_partitions, strict=True)
        self.seen, self.moved = one.observation_factorization, {a: [n.act_ids for n in part] for a, part in partitions}
        self.envs = mjenv.make_vec(f"{robot}-v5", num_envs, **options)
        self.actions = np.empty(self.envs.action_space.shape)

    def reset(self, seed=None):
        obs, info = self.envs.reset(seed=seed)
        return {agent: obs[:, columns] for agent, columns in self.seen.items()}, info

    def step(self, actions):
        for agent, columns in self.moved.items():
            self.actions[:, columns] = actions[agent]
        obs, *results = self.envs.step(self.actions)
        return {agent: obs[:, columns] for agent, columns in self.seen.items()}, *results
