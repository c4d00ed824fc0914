"""Trains with PPO on Ray: one learner sends its weights to pools of environments on all nodes and takes their batches.

    train.py [ID] [--pools 2] [--rows 8] [--updates N] [--seed 1] [--out FOLDER]

Runs on a cluster when started by `ray job submit` or with RAY_ADDRESS set, otherwise on this machine alone. Every node
needs mjenv and PyTorch. Writes curve.csv and policy.txt as train_cleanrl.py does; prints the throughput of each node.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import deque
from dataclasses import replace
from pathlib import Path

import numpy as np
import ray
import ray.cloudpickle
import torch

sys.path.append(str(Path(__file__).resolve().parents[1] / "python"))

import pool
import train_cleanrl
from mjenv_learn.policy import Policy, layers_of
from pool import Array, Batch, Crew
from train_cleanrl import Agent, Experience, Moments, Settings

# Sends the code of these modules to the workers, because other nodes have no copy of the files.
for module in (pool, train_cleanrl):
    ray.cloudpickle.register_pickle_by_value(module)


def experience_of(batches: list[Batch], scale: float, gamma: float) -> tuple[Experience, torch.Tensor]:
    """Joins the batches, scales their rewards, and returns them with the values of the observations after them."""

    def joined(arrays: list[Array]) -> torch.Tensor:
        return torch.tensor(np.concatenate(arrays, axis=1), dtype=torch.float32)

    kept = Experience(0, 0, 0, 0)
    for name in ("observations", "actions", "log_probabilities", "values", "going_on"):
        setattr(kept, name, joined([getattr(batch, name) for batch in batches]))
    kept.rewards = joined([(batch.rewards / scale).clip(-10, 10) + gamma * batch.cut_off for batch in batches])
    return kept, torch.tensor(np.concatenate([batch.last_values for batch in batches]))


class Learner:
    """The networks, and the statistics by which observations and rewards are normalized."""

    def __init__(self, observations: int, actions: int, settings: Settings, seed: int) -> None:
        torch.manual_seed(seed)
        self._settings = settings
        self.agent = Agent(observations, actions)
        self._optimizer = torch.optim.Adam(self.agent.parameters(), settings.rate, eps=1e-5, fused=True)
        self.moments, self._returns = Moments(observations), Moments(1)

    def brain(self) -> pool.Brain:
        return pool.brain_of(self.agent, self.moments)

    def learn(self, batches: list[Batch], progress: float) -> None:
        """Makes one update; progress from 0 to 1 lowers the learning rate."""
        for batch in batches:
            self.moments.merge(*batch.moments, batch.rewards.size)
            self._returns.add(batch.discounted.reshape(-1, 1))
        scale = float(np.sqrt(self._returns.variance[0] + 1e-8))
        kept, last_values = experience_of(batches, scale, self._settings.gamma)
        self._optimizer.param_groups[0]["lr"] = self._settings.rate * (1 - progress)
        train_cleanrl.update(self.agent, self._optimizer, kept, last_values, self._settings)


def train(id: str, pools: int, rows: int, updates: int | None, seed: int, out: Path) -> Crew:
    """Trains and returns the crew with its reports."""
    settings = replace(train_cleanrl.SETTINGS.get(id, Settings()), envs=pools * rows)
    updates = updates or -(-settings.steps // (settings.rollout * settings.envs))
    envs = train_cleanrl.make(id, 1, "mjenv")
    (observations,), (actions,) = envs.single_observation_space.shape, envs.single_action_space.shape
    learner = Learner(observations, actions, settings, seed)
    crew = Crew(id, pools, rows, seed)
    returns: deque[float] = deque(maxlen=train_cleanrl.WINDOW)
    out.mkdir(parents=True, exist_ok=True)
    with (out / "curve.csv").open("w", buffering=1) as curve:
        print("steps,seconds,mean_return", file=curve)
        start = time.perf_counter()
        for index in range(updates):
            batches = crew.collect(learner.brain(), settings.rollout, settings.gamma)
            for batch in batches:
                returns.extend(batch.returns)
            mean = float(np.mean(returns)) if returns else float("nan")
            steps = (index + 1) * settings.rollout * settings.envs
            print(steps, f"{time.perf_counter() - start:.3f}", repr(mean), sep=",", file=curve)
            print(f"{steps:9} steps, mean return {mean:.1f}", flush=True)
            learner.learn(batches, index / updates)
    brain = learner.brain()
    first, _, second, _, third = learner.agent.actor
    space = envs.single_action_space
    layers = layers_of(first, second, third)
    Policy(id, brain.mean.tolist(), brain.scale.tolist(), 10.0, space.low.tolist(), space.high.tolist(), layers).save(
        out / "policy.txt"
    )
    crew.close()
    return crew


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("id", nargs="?", default="InvertedPendulum-v5")
    parser.add_argument("--pools", type=int, default=2)
    parser.add_argument("--rows", type=int, default=8, help="environments in a pool")
    parser.add_argument("--updates", type=int, help="default: as many as the id's number of steps takes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("trained"))
    given = parser.parse_args()
    torch.set_num_threads(1)
    ray.init()
    crew = train(given.id, given.pools, given.rows, given.updates, given.seed, given.out)
    print(f"{crew.restarts} pools were started again")
    for node, host, batches, steps, rate in crew.throughput():
        print(f"node {node} on {host}: {batches} batches, {steps} steps, {rate:.0f} steps/s a pool")
    ray.shutdown()


if __name__ == "__main__":
    main()
