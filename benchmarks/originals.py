"""How many times the original packages' steps the mazes and the collections take in the same CPU time, on one thread.

Prints for each case mjenv's steps per CPU second, the original's, and their ratio. Both take turns, A B A B; each
number is the median of the rounds. Usage: benchmarks/originals.py [--rows N] [--rounds N] [CASE...]
MuJoCo's version decides the engine. The packages: those of parts mazes and collections of tests/run.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import gymnasium
import gymnasium_robotics
import mjenv_mazes  # noqa: F401 registers the ids
import mo_gymnasium
import mujoco
import numpy as np
from gymnasium_robotics import mamujoco_v1

import mjenv
from mjenv.capi.engine import name_of

sys.path.append(str(Path(__file__).parents[1] / "examples/collections"))
from multi_agent import MultiAgentRows, parallel_env
from multi_objective import MultiObjective, rewards
from safe_velocity import SafeVelocity, cost
from test_collections import original

gymnasium.register_envs(gymnasium_robotics)
ENGINE = name_of(mujoco.__version__)
LANES = "max" if ENGINE == "2.2.2" else 4
Steps = Callable[[int], int]  # takes steps, returns how many of single environments


def single(env: Any) -> Steps:
    """Steps of one environment, of agents too."""
    agents = getattr(env, "possible_agents", [])
    spaces = {agent: env.action_space(agent) for agent in agents}
    samples = [{a: s.sample() for a, s in spaces.items()} if agents else env.action_space.sample() for _ in range(50)]
    env.reset(seed=0)

    def steps(count: int) -> int:
        for i in range(count):
            *_, terminated, truncated, _ = env.step(samples[i % 50])
            if not env.agents if agents else terminated or truncated:
                env.reset()
        return count

    return steps


def rows(envs: Any, then: Callable[[Any], Any] = lambda info: None) -> Steps:
    """Steps of a vector; then: what is also done with each info."""
    samples = [envs.action_space.sample() for _ in range(5)]
    envs.reset(seed=0)

    def steps(count: int) -> int:
        for i in range(max(count // envs.num_envs, 1)):
            then(envs.step(samples[i % 5])[-1])
        return max(count // envs.num_envs, 1) * envs.num_envs

    return steps


def of_agents(count: int) -> Steps:
    envs = MultiAgentRows("Ant", "2x4", count, engine=ENGINE, num_threads=1, lanes=LANES)
    samples = {a: np.random.default_rng(0).uniform(-1, 1, (count, len(c))) for a, c in envs.moved.items()}
    envs.reset(seed=0)
    return lambda steps: sum(len(envs.step(samples)[1]) for _ in range(max(steps // count, 1)))


def ours(id: str, count: int, **options: Any) -> Any:
    return mjenv.make_vec(id, count, engine=ENGINE, num_threads=1, lanes=LANES, **options)


def theirs(id: str, count: int) -> Any:
    count = min(count, 64)  # 1,024 need 11 GB, and are as fast
    return gymnasium.vector.SyncVectorEnv([lambda: gymnasium.make(id, disable_env_checker=True)] * count)


# By names: what makes mjenv's steps, and what the original's, of so many rows.
CASES: dict[str, tuple[Callable[[int], Steps], Callable[[int], Steps]]] = {
    **{
        id: (lambda n, id=id: rows(ours(f"mazes/{id}", n)), lambda n, id=id: rows(theirs(id, n)))
        for id in ("PointMaze_UMaze-v3", "PointMaze_Large-v3", "AntMaze_UMaze-v5", "AntMaze_Large-v5")
    },
    "one mo-hopper-v5": (
        lambda n: single(MultiObjective("mo-hopper-v5", engine=ENGINE)),
        lambda n: single(mo_gymnasium.make("mo-hopper-v5")),
    ),
    "rows of mo-hopper-v5": (
        lambda n: rows(ours("Hopper-v5", n), lambda info: rewards("Hopper", info, 1e-3)),
        lambda n: single(mo_gymnasium.make("mo-hopper-v5")),
    ),
    "one SafetyAntVelocity-v1": (
        lambda n: single(SafeVelocity("Ant", engine=ENGINE)),
        lambda n: single(original("Ant")),
    ),
    "rows of SafetyAntVelocity-v1": (
        lambda n: rows(ours("Ant-v4", n), lambda info: cost("Ant", info)),
        lambda n: single(original("Ant")),
    ),
    "one Ant of 2x4 agents": (
        lambda n: single(parallel_env("Ant", "2x4", engine=ENGINE)),
        lambda n: single(mamujoco_v1.parallel_env("Ant", "2x4", agent_obsk=1)),
    ),
    "rows of Ants of 2x4 agents": (of_agents, lambda n: single(mamujoco_v1.parallel_env("Ant", "2x4", agent_obsk=1))),
}


def rate(steps: Steps, count: int) -> float:
    """Steps per CPU second."""
    start = time.process_time()
    return steps(count) / (time.process_time() - start)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=1024)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"of {', '.join(CASES)} (default: all)")
    arguments = parser.parse_args()
    for name in arguments.cases or CASES:
        pair = [make(arguments.rows) for make in CASES[name]]
        found = [
            [rate(steps, count) for steps, count in zip(pair, (8 * arguments.rows, 1000), strict=True)]
            for _ in range(arguments.rounds + 1)
        ][1:]
        mine, other = (median(column) for column in zip(*found, strict=True))
        ratio = median(a / b for a, b in found)
        print(f"{name:30} {mine:10.0f} {other:8.0f} {ratio:6.2f}", flush=True)


if __name__ == "__main__":
    main()
