"""Solves Reach-v0 by the cross-entropy method: draws linear policies, plays each in a row, and goes on from the best.

    python solve.py

Writes policy.txt: an action is a matrix times the observation.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import mjenv
from mjenv_learn.policy import Layer, Policy
from reach import ID

ROWS, KEPT, GOALS, ROUNDS, STEPS = 256, 32, 4, 25, 100


def play(
    envs: mjenv.VectorEnv, policies: NDArray[np.float64], seed: int | list[int]
) -> tuple[NDArray[np.float64], ...]:
    """Returns and last distances of an episode of each row. policies: (rows, actions, observations)."""
    obs, _ = envs.reset(seed=seed)
    returns, distances = np.zeros((2, len(policies)))
    for _ in range(STEPS):
        obs, rewards, _, _, infos = envs.step(np.einsum("rao,ro->ra", policies, obs).clip(-1, 1))
        returns, distances = returns + rewards, infos["distance"]
    return returns, distances


def solve(rounds: int = ROUNDS) -> NDArray[np.float64]:
    """Returns the policy, and prints its progress."""
    envs, stream = mjenv.make_vec(ID, ROWS), np.random.default_rng(0)
    shape = (envs.single_action_space.shape[0], envs.single_observation_space.shape[0])
    mean, spread = np.zeros(shape), np.ones(shape)
    for number in range(rounds):
        policies = mean + spread * stream.normal(size=(ROWS, *shape))
        # All rows have the same seed and so the same goals. They differ only in the policy.
        played = [play(envs, policies, [GOALS * number + goal] * ROWS) for goal in range(GOALS)]
        returns, distances = np.sum(played, axis=0)
        best = np.argsort(returns)[-KEPT:]
        # Keeps the spread above 0, so that the search goes on.
        mean, spread = policies[best].mean(axis=0), policies[best].std(axis=0) + 0.02
        if number % 5 == 4:
            print(f"round {number + 1}: the best end {distances[best].mean() / GOALS:.3f} m from their goals")
    return mean


if __name__ == "__main__":
    policy = solve()
    envs = mjenv.make_vec(ID, 100)
    _, distances = play(envs, np.broadcast_to(policy, (100, *policy.shape)), seed=1000)
    layer = Layer("identity", policy.tolist(), [0.0] * 3)
    Policy(ID, [0.0] * 8, [1.0] * 8, 100.0, [-1.0] * 3, [1.0] * 3, [layer]).save(Path(__file__).with_name("policy.txt"))
    print(f"100 new goals: the hand ends {distances.mean():.3f} m from them")
