"""Trains with PPO in one file, in the manner of CleanRL. Only make() depends on the backend; both learn the same bits.

    train_cleanrl.py Hopper-v5 [--backend mjenv|gymnasium] [--steps N] [--seed 1] [--out FOLDER]

Writes curve.csv (steps, wall time, mean return of the last 20 episodes) and policy.txt for deployment.

Tasks of your own come from plug-ins (--tasks). A training can have stages with other options of the task, a curriculum:

    train_cleanrl.py MyRobot-v0 --tasks libmy_robots.so --stage 500000 speed=0,0.5 --stage 500000 speed=0,1
"""

from __future__ import annotations

import argparse
import ast
import math
import time
from collections import deque
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import Tensor, nn

from mjenv_learn.policy import Policy, layers_of, needs_of

WINDOW = 20  # episodes
SAVES = 10  # policy.txt is written so often, so that a training that is stopped leaves a policy


@dataclass(frozen=True)
class Settings:
    steps: int = 500_000
    envs: int = 8
    rollout: int = 512  # the steps of each environment between two updates
    epochs: int = 10
    minibatch: int = 256
    rate: float = 5e-4  # the learning rate, which falls linearly to 0 ...
    rate_steps: int = 0  # ... in so many steps, if these are more than the steps of the training
    gamma: float = 0.99
    trace: float = 0.95  # the lambda of the advantage estimation
    clip: float = 0.2
    value_weight: float = 0.5
    greatest_gradient: float = 0.5
    deviation: float = 1.0  # the standard deviation of the actions at the beginning


@dataclass(frozen=True)
class Stage:
    """A part of a training, and the options of the environments in it."""

    steps: int
    options: dict[str, Any]


# On one CPU, many environments, large minibatches and small deviations learn most in a given time.
WIDE = Settings(
    envs=64, rollout=64, epochs=5, minibatch=1024, rate=1e-3, value_weight=1.3, greatest_gradient=3.5, deviation=0.4
)

SETTINGS = {
    "Ant-v5": replace(WIDE, steps=2_000_000),
    "HalfCheetah-v5": replace(WIDE, steps=2_000_000, gamma=0.98),
    "Hopper-v5": Settings(steps=1_000_000),
    "Humanoid-v5": replace(WIDE, steps=2_000_000, rate=5e-4, rate_steps=8_000_000),
    "HumanoidStandup-v5": replace(WIDE, steps=600_000),
    "InvertedDoublePendulum-v5": replace(WIDE, steps=400_000),
    "InvertedPendulum-v5": Settings(steps=100_000, rollout=256, epochs=5, minibatch=128, rate=1e-3),
    "Pusher-v5": replace(WIDE, steps=1_500_000),
    "Reacher-v5": Settings(steps=150_000, rollout=256, rate=1e-3, gamma=0.9),
    "Swimmer-v5": Settings(steps=1_000_000, rollout=1024, rate=6e-4, gamma=0.9999, trace=0.98),
    "Walker2d-v5": replace(WIDE, steps=1_515_520, rate_steps=3_000_000),
}


def make(id: str, envs: int, backend: str, **options: Any) -> Any:
    if backend == "mjenv":
        import mjenv

        return mjenv.make_vec(id, envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
    import gymnasium

    return gymnasium.make_vec(
        id, envs, vectorization_mode="sync", vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP}, **options
    )


def shown(envs: Any, view: bool) -> Any:
    """A context in which a browser shows the environments, if `view` is true."""
    if not view:
        return nullcontext()
    import mjenv

    return mjenv.view(envs)


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
    def __init__(self, observations: int, actions: int, deviation: float = 1.0) -> None:
        super().__init__()
        self.actor, self.critic = network(observations, actions, 0.01), network(observations, 1, 1.0)
        self.log_deviation = nn.Parameter(torch.full((actions,), math.log(deviation)))

    def value(self, observations: Tensor) -> Tensor:
        return self.critic(observations).squeeze(-1)

    def log_probability(self, observations: Tensor, actions: Tensor) -> Tensor:
        return self._log_probability(self.actor(observations), actions)

    def _log_probability(self, mean: Tensor, actions: Tensor) -> Tensor:
        distance = (actions - mean) / self.log_deviation.exp()
        return (-0.5 * distance**2 - self.log_deviation - 0.5 * np.log(2 * np.pi)).sum(-1)

    def sample(self, observations: Tensor, noise: torch.Generator | None = None) -> tuple[Tensor, Tensor]:
        """Actions and the logarithms of their probabilities, by one evaluation of the actor."""
        mean = self.actor(observations)
        action = mean + self.log_deviation.exp() * torch.randn(mean.shape, generator=noise)
        return action, self._log_probability(mean, action)


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


def info_of_step(infos: dict[str, Any], name: str, ended: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """An info of a step in all rows. If a row's episode has ended, final_info has it, because a new one has begun."""
    going = infos.get(name, np.zeros(len(ended)))
    return np.where(ended, infos.get("final_info", {}).get(name, going), going)


class Rollout:
    """Plays rollouts in all environments. `watched` is the mean of the info `watch` in the last rollout."""

    def __init__(
        self, envs: Any, agent: Agent, normalizer: Normalizer, settings: Settings, seed: int, watch: str | None = None
    ) -> None:
        self._envs, self._agent, self._normalizer, self._settings = envs, agent, normalizer, settings
        self._watch, self.watched = watch, math.nan
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
        kept, watched = self.experience, 0.0
        for step in range(self._settings.rollout):
            action, log_probability = self._agent.sample(self._now)
            kept.observations[step], kept.actions[step] = self._now, action
            kept.values[step] = self._agent.value(self._now)
            kept.log_probabilities[step] = log_probability
            after, rewards, terminated, truncated, infos = self._envs.step(action.numpy().clip(low, high))
            ended = terminated | truncated
            self._note_returns(rewards, ended)
            if self._watch:
                watched += info_of_step(infos, self._watch, ended).mean() / self._settings.rollout
            kept.rewards[step] = self._normalizer.reward(rewards, ended)
            self._add_values_cut_off(step, truncated & ~terminated, infos)
            kept.going_on[step] = torch.as_tensor(~ended, dtype=torch.float32)
            self._now = self._normalizer.observe(after)
        self.watched = float(watched)
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


def train(
    id: str,
    backend: str,
    stages: Sequence[Stage],
    seed: int,
    out: Path,
    s: Settings,
    watch: str | None = None,
    view: bool = False,
) -> None:
    torch.manual_seed(seed)
    envs = make(id, s.envs, backend, **stages[0].options)
    (observations,), (actions,) = envs.single_observation_space.shape, envs.single_action_space.shape
    agent = Agent(observations, actions, s.deviation)
    optimizer = torch.optim.Adam(agent.parameters(), s.rate, eps=1e-5, fused=True)
    normalizer = Normalizer(observations, s.envs, s.gamma)
    batch = s.rollout * s.envs
    updates = [-(-stage.steps // batch) for stage in stages]
    rate_updates = max(sum(updates), -(-s.rate_steps // batch))
    done = 0
    out.mkdir(parents=True, exist_ok=True)
    with (out / "curve.csv").open("w", buffering=1) as curve:
        print("steps,seconds,mean_return" + (f",{watch}" if watch else ""), file=curve)
        start = time.perf_counter()
        for number, stage in enumerate(stages):
            if number:
                envs.close()
                envs = make(id, s.envs, backend, **stage.options)
            with shown(envs, view):
                rollout = Rollout(envs, agent, normalizer, s, seed + number, watch)
                for _ in range(updates[number]):
                    optimizer.param_groups[0]["lr"] = s.rate * (1 - done / rate_updates)
                    last_value = rollout.collect()
                    done += 1
                    seconds = time.perf_counter() - start
                    mean = float(np.mean(rollout.returns)) if rollout.returns else float("nan")
                    columns = [str(done * batch), f"{seconds:.3f}", repr(mean)] + (
                        [repr(rollout.watched)] if watch else []
                    )
                    print(*columns, sep=",", file=curve)
                    update(agent, optimizer, rollout.experience, last_value, s)
                    if done % -(-sum(updates) // SAVES) == 0 or done == sum(updates):
                        policy = policy_of(id, agent, normalizer, envs.single_action_space, stages[number].options)
                        policy.save(out / "policy.txt")
    envs.close()


def policy_of(id: str, agent: Agent, normalizer: Normalizer, actions: Any, options: dict[str, Any]) -> Policy:
    """The deterministic policy, with the normalization of its observations."""
    first, _, second, _, third = agent.actor
    return Policy(
        id=id,
        mean=normalizer.observations.mean.tolist(),
        scale=normalizer.scale.tolist(),
        clip=10.0,
        low=actions.low.tolist(),
        high=actions.high.tolist(),
        layers=layers_of(first, second, third),
        **needs_of(id, options),
    )


def options_of(texts: Sequence[str]) -> dict[str, Any]:
    """NAME=VALUE texts as options of make; the values are written as in Python."""
    return {name: ast.literal_eval(value) for name, _, value in (text.partition("=") for text in texts)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("id")
    parser.add_argument("--backend", choices=("mjenv", "gymnasium"), default="mjenv")
    parser.add_argument("--tasks", type=Path, action="append", default=[], help="a plug-in with tasks of your own")
    parser.add_argument("--option", action="append", default=[], metavar="NAME=VALUE", help="of make")
    parser.add_argument(
        "--stage",
        nargs="+",
        action="append",
        metavar=("STEPS", "NAME=VALUE"),
        help="a part of the training and its options, in addition to those of --option; can be repeated",
    )
    parser.add_argument("--watch", metavar="INFO", help="adds the mean of this info in each rollout to curve.csv")
    parser.add_argument("--view", action="store_true", help="shows the training in a browser, with --backend mjenv")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("trained"))
    for field in fields(Settings):
        parser.add_argument(f"--{field.name.replace('_', '-')}", type=type(field.default), help="depends on the id")
    given = parser.parse_args()
    for plugin in given.tasks:
        import mjenv

        mjenv.load_tasks(plugin)
    changed = {field.name: getattr(given, field.name) for field in fields(Settings)}
    settings = replace(
        SETTINGS.get(given.id, Settings()), **{name: value for name, value in changed.items() if value is not None}
    )
    common = options_of(given.option)
    stages = [Stage(int(steps), {**common, **options_of(texts)}) for steps, *texts in given.stage or []]
    torch.set_num_threads(1)
    stages = stages or [Stage(settings.steps, common)]
    train(given.id, given.backend, stages, given.seed, given.out, settings, given.watch, given.view)


if __name__ == "__main__":
    main()
