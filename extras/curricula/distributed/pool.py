"""Pools of environments as Ray actors, and a crew of pools that survives the loss of actors and nodes.

The batches of a pool depend only on its state and on the brain that it receives. The crew keeps the state that each
pool had after its last batch. When a pool fails, the crew starts it again from that state, on any node, and requests
the batch again, which then has the same bits as the lost one.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import ray
import ray.exceptions
import torch
from gymnasium.vector import AutoresetMode

import mjenv
from train_cleanrl import Agent, Moments

Array = np.ndarray[Any, Any]
LOST = (ray.exceptions.RayActorError, ray.exceptions.ObjectLostError, ray.exceptions.NodeDiedError)
ATTEMPTS = 5  # how often the crew requests a batch before it gives up


@dataclass(frozen=True)
class Brain:
    """The networks and the normalization of observations, which the driver sends to all pools."""

    weights: dict[str, Array]
    mean: Array
    scale: Array


@dataclass(frozen=True)
class State:
    """The state from which a pool continues."""

    image: bytes  # a snapshot of the rows: simulation, random streams, step counts
    noise: bytes  # the state of the random generator of exploration
    observations: Array
    totals: Array  # the return of each row's present episode so far
    discounted: Array


@dataclass(frozen=True)
class Batch:
    """One rollout of a pool: arrays [steps][rows] with normalized observations and unchanged rewards."""

    observations: Array
    actions: Array
    log_probabilities: Array
    values: Array
    rewards: Array
    going_on: Array
    cut_off: Array  # the value of the last observation where an episode was truncated, otherwise 0
    discounted: Array  # running discounted returns; rewards are scaled by their variance
    last_values: Array  # [rows]
    moments: tuple[Array, Array]  # mean and variance of the observations before normalization
    returns: list[float]  # the returns of the episodes that ended

    def arrays(self) -> list[Array]:
        return [value for value in self.__dict__.values() if isinstance(value, np.ndarray)]


@dataclass(frozen=True)
class Report:
    """The pool that made a batch, its node, and the time that it took."""

    node: str
    host: str
    steps: int
    seconds: float


class Pool:
    """Rows of one id and the policy that steps them."""

    def __init__(self, id: str, rows: int, seed: int, state: State | None = None) -> None:
        torch.set_num_threads(1)
        # norm="plain" gives the same bits on every node, whatever its CPU.
        self._envs = mjenv.make_vec(id, rows, autoreset_mode=AutoresetMode.SAME_STEP, norm="plain")
        self._noise = torch.Generator()
        sizes = self._envs.single_observation_space.shape[0], self._envs.single_action_space.shape[0]
        with torch.random.fork_rng(devices=[]):  # the random weights are replaced by the brain's
            self._agent = Agent(*sizes)
        if state is None:
            self._noise.manual_seed(seed)
            self._now, _ = self._envs.reset(seed=seed)
            self._totals, self._discounted = np.zeros(rows), np.zeros(rows)
        else:
            self._noise.set_state(torch.frombuffer(bytearray(state.noise), dtype=torch.uint8))
            self._envs.restore(state.image)
            self._now, self._totals, self._discounted = state.observations, state.totals.copy(), state.discounted.copy()

    def _state(self) -> State:
        noise = self._noise.get_state().numpy().tobytes()
        return State(self._envs.snapshot(), noise, self._now, self._totals.copy(), self._discounted.copy())

    @torch.no_grad()
    def collect(self, brain: Brain, steps: int, gamma: float) -> tuple[Batch, State, Report]:
        """Plays a rollout and returns it with the state after it."""
        start = time.perf_counter()
        # Arrays from Ray's store are read-only.
        self._agent.load_state_dict({name: torch.tensor(array) for name, array in brain.weights.items()})
        rows, low, high = self._envs.num_envs, self._envs.single_action_space.low, self._envs.single_action_space.high
        seen = np.zeros((steps, rows, len(brain.mean)))
        normal = np.zeros(seen.shape, np.float32)
        actions = np.zeros((steps, rows, len(low)), np.float32)
        chances, values, cut_off = np.zeros((3, steps, rows), np.float32)
        rewards, discounted = np.zeros((2, steps, rows))
        going_on = np.zeros((steps, rows), np.float32)
        returns: list[float] = []
        for step in range(steps):
            now = self._normalized(self._now, brain)
            action = self._agent.sample(now, self._noise)
            seen[step], normal[step], actions[step] = self._now, now.numpy(), action.numpy()
            values[step] = self._agent.value(now).numpy()
            chances[step] = self._agent.log_probability(now, action).numpy()
            self._now, rewards[step], terminated, truncated, infos = self._envs.step(actions[step].clip(low, high))
            ended = terminated | truncated
            going_on[step] = ~ended
            self._totals += rewards[step]
            self._discounted = self._discounted * gamma + rewards[step]
            discounted[step] = self._discounted
            returns += self._totals[ended].tolist()
            self._totals[ended] = self._discounted[ended] = 0
            cut = np.flatnonzero(truncated & ~terminated)
            if len(cut):
                last = self._normalized(np.stack(infos["final_obs"][cut]), brain)
                cut_off[step, cut] = self._agent.value(last).numpy()
        flat = seen.reshape(-1, seen.shape[-1])
        batch = Batch(
            normal,
            actions,
            chances,
            values,
            rewards,
            going_on,
            cut_off,
            discounted,
            self._agent.value(self._normalized(self._now, brain)).numpy(),
            (flat.mean(0), flat.var(0)),
            returns,
        )
        return batch, self._state(), _report(steps * rows, time.perf_counter() - start)

    @staticmethod
    def _normalized(observations: Array, brain: Brain) -> torch.Tensor:
        return torch.as_tensor(((observations - brain.mean) / brain.scale).clip(-10, 10), dtype=torch.float32)


def _report(steps: int, seconds: float) -> Report:
    node = ray.get_runtime_context().get_node_id()[:8] if ray.is_initialized() else "none"
    return Report(node, socket.gethostname(), steps, seconds)


class Crew:
    """Pools on all nodes, whose results do not depend on which of them fail."""

    def __init__(self, id: str, pools: int, rows: int, seed: int) -> None:
        self._id, self._rows, self._seed = id, rows, seed
        self._states: list[State | None] = [None] * pools
        self.pools = [self._start(index) for index in range(pools)]
        self.reports: list[Report] = []
        self.restarts = 0

    def _start(self, index: int) -> Any:
        actor = ray.remote(num_cpus=1, scheduling_strategy="SPREAD")(Pool)
        return actor.remote(self._id, self._rows, self._seed + index * self._rows, self._states[index])

    def begin(self, brain: Brain, steps: int, gamma: float) -> list[Any]:
        """Sends the brain to every pool and begins a rollout there; end() returns the batches."""
        self._request = ray.put(brain), steps, gamma
        return [pool.collect.remote(*self._request) for pool in self.pools]

    def end(self, calls: Sequence[Any]) -> list[Batch]:
        """Waits for the batches and returns them in the order of the pools."""
        return [self._result(index, call) for index, call in enumerate(calls)]

    def collect(self, brain: Brain, steps: int, gamma: float) -> list[Batch]:
        return self.end(self.begin(brain, steps, gamma))

    def _result(self, index: int, call: Any) -> Batch:
        for attempt in range(1, ATTEMPTS + 1):
            try:
                batch, self._states[index], report = ray.get(call)
            except LOST:
                if attempt == ATTEMPTS:
                    raise
                self.restarts += 1
                ray.kill(self.pools[index])
                self.pools[index] = self._start(index)
                call = self.pools[index].collect.remote(*self._request)
            else:
                self.reports.append(report)
                return batch
        raise AssertionError("unreachable")

    def throughput(self) -> list[tuple[str, str, int, int, float]]:
        """For each node: its name, its host, batches, steps, and steps per second while its pools work."""
        found = []
        for node in dict.fromkeys(report.node for report in self.reports):
            own = [report for report in self.reports if report.node == node]
            steps, seconds = sum(report.steps for report in own), sum(report.seconds for report in own)
            found.append((node, own[0].host, len(own), steps, steps / seconds))
        return found

    def close(self) -> None:
        for pool in self.pools:
            ray.kill(pool)


def brain_of(agent: Agent, moments: Moments) -> Brain:
    weights = {name: value.detach().numpy().copy() for name, value in agent.state_dict().items()}
    return Brain(weights, moments.mean.copy(), np.sqrt(moments.variance + 1e-8))
