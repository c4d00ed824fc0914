"""Trains with PPO in one file, in the manner of CleanRL. Only make() depends on the backend; both learn the same bits.

    train_cleanrl.py Hopper-v5 [--backend mjenv|gymnasium] [--steps N] [--seed 1] [--out FOLDER]

Writes curve.csv (steps, wall time, mean return of the last 20 episodes) and policy.txt for deployment.
"""

from __future__ import annotations

import argparse
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import Tensor, nn

from mjenv.policy import Policy, layers_of

WINDOW = 20  # episodes


@dataclass(frozen=True)
class Settings:
    steps: int = 500_000
    envs: int = 8
    rollout: int = 512  # the steps of each environment between two updates
    epochs: int = 10
    minibatch: int = 256
    rate: float = 5e-4  # the learning rate, which falls linearly to 0
    gamma: float = 0.99
    trace: float = 0.95  # the lambda of the advantage estimation
    clip: float = 0.2
    value_weight: float = 0.5
    greatest_gradient: float = 0.5


SETTINGS = {
    "InvertedPendulum-v5": Settings(steps=100_000, rollout=256, epochs=5, minibatch=128, rate=1e-3),
    "Reacher-v5": Settings(steps=150_000, rollout=256, rate=1e-3, gamma=0.9),
    "Hopper-v5": Settings(steps=300_000),
}


def make(id: str, envs: int, backend: str) -> Any:
    if backend == "mjenv":
        import mjenv

        return mjenv.make_vec(id, envs, autoreset_mode=AutoresetMode.SAME_STEP)
    import gymnasium

    return gymnasium.make_vec(
        id, envs, vectorization_mode="sync", vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP}
    )


class Moments:
    """The running mean and variance of batches."""

    def __init__(self, size: int) -> None:
        self.mean, self.variance, self.count = np.zeros(size), np.ones(size), 1e-4

    def add(self, batch: np.ndarray[Any, Any]) -> None:
        self.merge(batch.mean(0), batch.var(0), len(batch))

    def merge(self, mean: np.ndarray[Any, Any], variance: np.ndarray[Any, Any], count: int) -> None:
        delta, total = mean - self.mean, self.count + count
        squares = self.variance * self.count + variance * count + delta**2 * (self.count * count / total)
        self.mean, self.variance, self.count = self.mean + delta * (count / total), squares / total, total


class Normalizer:
    """Scales observations to mean 0, variance 1 and rewards to discounted returns of variance 1; clips both to +-10."""

    def __init__(self, size: int, envs: int, gamma: float) -> None:
        self.observations, self._returns, self._gamma = Moments(size), Moments(1), gamma
        self._return = np.zeros(envs)

    @property
    def scale(self) -> np.ndarray[Any, Any]:
        return np.sqrt(self.observations.variance + 1e-8)

    def observe(self, batch: np.ndarray[Any, Any], *, learn: bool = True) -> Tensor:
        if learn:
            self.observations.add(batch)
        return torch.as_tensor(((batch - self.observations.mean) / self.scale).clip(-10, 10), dtype=torch.float32)

    def reward(self, rewards: np.ndarray[Any, Any], ended: np.ndarray[Any, Any]) -> Tensor:
        self._return = self._return * self._gamma + rewards
        self._returns.add(self._return[:, None])
        self._return[ended] = 0
        return torch.as_tensor((rewards / np.sqrt(self._returns.variance + 1e-8)).clip(-10, 10), dtype=torch.float32)


def linear(inputs: int, outputs: int, gain: float) -> nn.Linear:
    layer = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer


def network(inputs: int, outputs: int, gain: float) -> nn.Sequential:
    root = 2**0.5
    return nn.Sequential(
        linear(inputs, 64, root), nn.Tanh(), linear(64, 64, root), nn.Tanh(), linear(64, outputs, gain)
    )


class Agent(nn.Module):
    def __init__(self, observations: int, actions: int) -> None:
        super().__init__()
        self.actor, self.critic = network(observations, actions, 0.01), network(observations, 1, 1.0)
        self.log_deviation = nn.Parameter(torch.zeros(actions))

    def value(self, observations: Tensor) -> Tensor:
        return self.critic(observations).squeeze(-1)

    def log_probability(self, observations: Tensor, actions: Tensor) -> Tensor:
        distance = (actions - self.actor(observations)) / self.log_deviation.exp()
        return (-0.5 * distance**2 - self.log_deviation - 0.5 * np.log(2 * np.pi)).sum(-1)

    def sample(self, observations: Tensor, noise: torch.Generator | None = None) -> Tensor:
        mean = self.actor(observations)
        return mean + self.log_deviation.exp() * torch.randn(mean.shape, generator=noise)


class Experience:
    """The data of a rollout that an update needs; the arrays are [steps][environments]."""

    def __init__(self, steps: int, envs: int, observations: int, actions: int) -> None:
        self.observations = torch.zeros(steps, envs, observations)
        self.actions = torch.zeros(steps, envs, actions)
        self.log_probabilities, self.rewards, self.values = torch.zeros(3, steps, envs)
        self.going_on = torch.zeros(steps, envs)  # 0 where the episode ended with the step

    def advantages(self, last_value: Tensor, gamma: float, trace: float) -> Tensor:
        """Generalized advantage estimation; last_value is the value of the observations after the rollout."""
        found, ahead, following = torch.zeros_like(self.rewards), torch.zeros_like(last_value), last_value
        for step in reversed(range(len(self.rewards))):
            error = self.rewards[step] + gamma * following * self.going_on[step] - self.values[step]
            ahead = error + gamma * trace * self.going_on[step] * ahead
            found[step], following = ahead, self.values[step]
        return found


class Rollout:
    """Plays rollouts in all environments."""

    def __init__(self, envs: Any, agent: Agent, normalizer: Normalizer, settings: Settings, seed: int) -> None:
        self._envs, self._agent, self._normalizer, self._settings = envs, agent, normalizer, settings
        sizes = envs.single_observation_space.shape[0], envs.single_action_space.shape[0]
        self.experience = Experience(settings.rollout, settings.envs, *sizes)
        self.returns: deque[float] = deque(maxlen=WINDOW)
        self._totals = np.zeros(settings.envs)
        first, _ = envs.reset(seed=seed)
        self._now = normalizer.observe(first)

    @torch.no_grad()
    def collect(self) -> Tensor:
        """Plays a rollout and returns the values of the observations after it."""
        low, high = self._envs.single_action_space.low, self._envs.single_action_space.high
        kept = self.experience
        for step in range(self._settings.rollout):
            action = self._agent.sample(self._now)
            kept.observations[step], kept.actions[step] = self._now, action
            kept.values[step] = self._agent.value(self._now)
            kept.log_probabilities[step] = self._agent.log_probability(self._now, action)
            after, rewards, terminated, truncated, infos = self._envs.step(action.numpy().clip(low, high))
            ended = terminated | truncated
            self._note_returns(rewards, ended)
            kept.rewards[step] = self._normalizer.reward(rewards, ended)
            self._add_values_cut_off(step, truncated & ~terminated, infos)
            kept.going_on[step] = torch.as_tensor(~ended, dtype=torch.float32)
            self._now = self._normalizer.observe(after)
        return self._agent.value(self._now)

    def _note_returns(self, rewards: np.ndarray[Any, Any], ended: np.ndarray[Any, Any]) -> None:
        self._totals += rewards
        self.returns.extend(self._totals[ended].tolist())
        self._totals[ended] = 0

    def _add_values_cut_off(self, step: int, truncated: np.ndarray[Any, Any], infos: dict[str, Any]) -> None:
        """Values the last observation of a truncated episode by the critic, because the episode would have gone on."""
        rows = np.flatnonzero(truncated)
        if len(rows):
            last = self._normalizer.observe(np.stack(infos["final_obs"][rows]), learn=False)
            self.experience.rewards[step, rows] += self._settings.gamma * self._agent.value(last)


def update(agent: Agent, optimizer: torch.optim.Optimizer, kept: Experience, last_value: Tensor, s: Settings) -> None:
    advantages = kept.advantages(last_value, s.gamma, s.trace)
    targets = (advantages + kept.values).flatten()
    observations, actions = kept.observations.flatten(0, 1), kept.actions.flatten(0, 1)
    before, advantages = kept.log_probabilities.flatten(), advantages.flatten()
    for _ in range(s.epochs):
        for rows in torch.randperm(len(targets)).split(s.minibatch):
            ratio = (agent.log_probability(observations[rows], actions[rows]) - before[rows]).exp()
            advantage = advantages[rows]
            advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
            gain = torch.minimum(ratio * advantage, ratio.clamp(1 - s.clip, 1 + s.clip) * advantage).mean()
            miss = ((agent.value(observations[rows]) - targets[rows]) ** 2).mean()
            optimizer.zero_grad()
            (s.value_weight * miss - gain).backward()
            nn.utils.clip_grad_norm_(agent.parameters(), s.greatest_gradient)
            optimizer.step()


def train(id: str, backend: str, steps: int | None, seed: int, out: Path) -> None:
    s = SETTINGS.get(id, Settings())
    torch.manual_seed(seed)
    envs = make(id, s.envs, backend)
    (observations,), (actions,) = envs.single_observation_space.shape, envs.single_action_space.shape
    agent = Agent(observations, actions)
    optimizer = torch.optim.Adam(agent.parameters(), s.rate, eps=1e-5)
    normalizer = Normalizer(observations, s.envs, s.gamma)
    rollout = Rollout(envs, agent, normalizer, s, seed)
    updates = -(-(steps or s.steps) // (s.rollout * s.envs))
    out.mkdir(parents=True, exist_ok=True)
    with (out / "curve.csv").open("w", buffering=1) as curve:
        print("steps,seconds,mean_return", file=curve)
        start = time.perf_counter()
        for index in range(updates):
            optimizer.param_groups[0]["lr"] = s.rate * (1 - index / updates)
            last_value = rollout.collect()
            seconds = time.perf_counter() - start
            mean = float(np.mean(rollout.returns)) if rollout.returns else float("nan")
            print((index + 1) * s.rollout * s.envs, f"{seconds:.3f}", repr(mean), sep=",", file=curve)
            update(agent, optimizer, rollout.experience, last_value, s)
    first, _, second, _, third = agent.actor
    Policy(
        id=id,
        mean=normalizer.observations.mean.tolist(),
        scale=normalizer.scale.tolist(),
        clip=10.0,
        low=envs.single_action_space.low.tolist(),
        high=envs.single_action_space.high.tolist(),
        layers=layers_of(first, second, third),
    ).save(out / "policy.txt")
    envs.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("id")
    parser.add_argument("--backend", choices=("mjenv", "gymnasium"), default="mjenv")
    parser.add_argument("--steps", type=int, help="environment steps; the default depends on the id")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("trained"))
    given = parser.parse_args()
    torch.set_num_threads(1)
    train(given.id, given.backend, given.steps, given.seed, given.out)


if __name__ == "__main__":
    main()
