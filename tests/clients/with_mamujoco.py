"""MaMuJoCo: parallel_env on an environment of an id, and its state()."""

import gymnasium
import numpy as np
from gymnasium_robotics import mamujoco_v1

from common import digest, id_of, show

for robot, agents in {
    "Ant": "2x4",
    "HalfCheetah": "6x1",
    "Humanoid": "9|8",
    "Walker2d": "2x3",
    "InvertedPendulum": None,
}.items():
    env = mamujoco_v1.parallel_env(robot, agents, gym_env=gymnasium.make(id_of(f"{robot}-v5")))
    rng, found = np.random.default_rng(0), [env.reset(seed=3)[0]]
    for _ in range(60):
        actions = {agent: rng.uniform(-1, 1, env.action_space(agent).shape).astype(np.float32) for agent in env.agents}
        found.append([*env.step(actions)[:4], env.state()])
        if not env.agents:
            break
    show(robot, agents, digest(found))
