"""MO-Gymnasium's robots: reward vectors instead of rewards."""

import gymnasium
import numpy as np

import mjenv

ROBOTS = {name.lower(): name for name in ("HalfCheetah", "Hopper", "Ant", "Walker2d", "Swimmer", "Humanoid")}
SECOND = {"Hopper": [("z_distance_from_origin", 10)], "Ant": [("y_velocity", 1)]}


def rewards(robot, info, cost_weight, cost_objective=True):
    """The objectives (2,) or (3,) of a step from its info; of all rows of a vector (rows, ...)."""
    cost, shared = info["reward_ctrl"], [info[name] for name in ("reward_survive", "reward_contact") if name in info]
    parts = [info["x_velocity"], *(factor * info[name] for name, factor in SECOND.get(robot, ()))]
    vector = np.stack(parts + [cost / cost_weight] * cost_objective, -1).astype(np.float32)
    for value in shared if cost_objective else [cost, *shared]:
        vector += np.asarray(value)[..., None]
    return vector


class MultiObjective(gymnasium.Wrapper):
    """The environment of one of MO-Gymnasium's ids, such as mo-hopper-2obj-v5."""

    def __init__(self, id, **options):
        self.robot, self.cost_objective = ROBOTS[id.split("-")[1]], "2obj" not in id
        super().__init__(mjenv.make(f"{self.robot}-v5", **options))
        self.unwrapped.reward_dim = 1 + (self.robot in SECOND) + self.cost_objective
        self.unwrapped.reward_space = gymnasium.spaces.Box(-np.inf, np.inf, (self.unwrapped.reward_dim,))

    def step(self, action):
        obs, _, terminated, truncated, info = self.env.step(action)
        vector = rewards(self.robot, info, self.unwrapped._ctrl_cost_weight, self.cost_objective)
        return obs, vector, terminated, truncated, info
