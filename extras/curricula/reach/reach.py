"""An arm whose hand has to reach a goal, which each episode draws: a task in NumPy, over all rows at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from mjenv_batch import Random, Sim
from numpy.typing import NDArray

import mjenv
from mjenv.task import Model

ID = "Reach-v0"
LENGTHS = (0.4, 0.3)  # of the links, m
SHOULDER = 0.5  # its height, m


def hand_at(angles: NDArray[Any]) -> NDArray[Any]:
    """The place of the hand for the angles of the joints in each row."""
    turn, shoulder, elbow = angles.T
    far = LENGTHS[0] * np.cos(shoulder) + LENGTHS[1] * np.cos(shoulder + elbow)
    high = LENGTHS[0] * np.sin(shoulder) + LENGTHS[1] * np.sin(shoulder + elbow)
    return np.stack([far * np.cos(turn), far * np.sin(turn), SHOULDER + high], axis=1)


class Reach(mjenv.Task):
    model = "./reach.xml"  # "./" is the folder of this file
    frame_skip = 2
    time_limit = 100
    needs = ("qpos", "qvel", "site_xpos", "site_xmat")
    options = {"effort": 0.01, "spread": 1.0}  # each becomes an attribute
    state = {"goal": (3,)}  # what a row remembers

    effort: float  # weight of the squared action
    spread: float  # how far the goals are from the first pose: 0 to 1

    def build(self, model: Model) -> None:
        self.hand = model.index("site", "hand")
        self.pose = np.array([0, 0.2, 1.2])

    def reset(self, rng: Random, rows: int) -> tuple[Any, ...]:
        qpos = self.pose + rng.uniform(-0.1, 0.1, (rows, 3))
        # The goal is the place of the hand at other angles, so the hand can reach it.
        angles = self.pose + self.spread * rng.uniform([-1.5, -0.8, -0.8], [1.5, 0.8, 0.8], (rows, 3))
        return qpos, np.zeros((rows, 3)), {"goal": hand_at(angles)}

    def error(self, sim: Sim) -> NDArray[Any]:
        return sim.goal - sim.site_xpos[:, self.hand]

    def observe(self, sim: Sim) -> NDArray[Any]:
        # In the frame of the forearm, in which each joint moves the hand in almost the same direction in all poses.
        seen = np.einsum("rji,rj->ri", sim.site_xmat[:, self.hand].reshape(-1, 3, 3), self.error(sim))
        # The weight of the links pulls at the joints in proportion to these cosines.
        tilts = np.stack([sim.qpos[:, 1], sim.qpos[:, 1] + sim.qpos[:, 2]], axis=1)
        return np.concatenate([seen, sim.qvel, np.cos(tilts)], axis=1)

    def step(self, sim: Sim, action: NDArray[Any]) -> tuple[Any, ...]:
        distance = np.sqrt(np.square(self.error(sim)).sum(axis=1))
        reward = -distance - self.effort * np.square(action).sum(axis=1)
        return reward, np.zeros(len(action), bool), {"distance": distance}  # reward, terminated, info


mjenv.register(ID, Reach)
