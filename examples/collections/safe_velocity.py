"""Safety-Gymnasium's velocity tasks (v1): a step costs 1 if the robot is faster than its limit."""

import gymnasium
import numpy as np

import mjenv

# m/s, as published
LIMITS = {
    "Ant": 2.6222, "HalfCheetah": 3.2096, "Hopper": 0.7402, "Humanoid": 1.4149, "Swimmer": 0.2282, "Walker2d": 2.3415
}  # fmt: skip


def cost(robot, info):
    """The cost of a step from its info; of all rows of a vector (rows,)."""
    speed = info["x_velocity"]
    if robot in ("Ant", "Humanoid"):
        speed = np.sqrt(speed**2 + info["y_velocity"] ** 2)
    return np.float64(speed > LIMITS[robot])


class SafeVelocity(gymnasium.Wrapper):
    """An environment whose steps return six results; the third is the cost."""

    def __init__(self, robot, **options):
        super().__init__(mjenv.make(f"{robot}-v4", **options))
        self.robot = robot

    def step(self, action):
        obs, reward, terminated, truncated, info = self.env.step(action)
        return obs, reward, cost(self.robot, info), terminated, truncated, info
