"""How long programs take that look into a simulation, on mjenv and on Gymnasium, in one process and in turns.

    measure.py [--rounds N]

Prints tables: CPU microseconds of each beyond those of an empty call, the least of the rounds, and the median of their
ratios. Needs Gymnasium with the mujoco package of the engine's version, and for the steps of MaMuJoCo
Gymnasium-Robotics.
"""

from __future__ import annotations

import argparse
import importlib
import operator
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import cycle
from pathlib import Path
from statistics import median
from types import SimpleNamespace
from typing import Any

import gymnasium
import mujoco
import numpy as np

import mjenv

sys.path.append(str(Path(__file__).parents[2] / "extras/classes/tests"))
from test_classes import ENGINE, NAMES, ROBOTS, Ours, Theirs, classes_on

ROWS = 1024
Call = Callable[[], object]


class Shaped(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A reward wrapper with seven reads, as people write them."""

    def step(self, action: Any) -> Any:
        obs, reward, terminated, truncated, info = super().step(action)
        env: Any = self.unwrapped
        data = env.data
        height, speed = data.body("torso").xpos[2], data.qvel[0] * env.dt
        effort = np.abs(data.ctrl).sum() + np.abs(data.qfrc_actuator).max() / env.model.nu
        return obs, reward + 0.1 * height - 0.01 * effort + speed + data.qpos[0], terminated, truncated, info


def environments(id: str) -> list[Any]:
    ours = mjenv.make(id, max_episode_steps=-1, engine=ENGINE, strict=False)
    return [ours, gymnasium.make(id, disable_env_checker=True).unwrapped]


def pairs() -> Iterator[tuple[str, list[Call]]]:
    """For each line of the table, the call on mjenv and on Gymnasium."""
    calls: dict[str, Callable[[Any], Call]] = {
        "data.qpos": lambda env: lambda: env.data.qpos,
        "data.qpos[0] = x": lambda env: lambda: env.data.qpos.__setitem__(0, 0.1),
        'data.body("torso").xpos': lambda env: lambda: env.data.body("torso").xpos,
        "model.nq": lambda env: lambda: env.model.nq,
        "dt": lambda env: lambda: env.dt,
        "state_vector()": lambda env: lambda: env.state_vector(),
    }
    envs = environments("HalfCheetah-v5")
    for env in envs:
        env.reset(seed=0)
    for name, call in calls.items():
        yield name, [call(env) for env in envs]
    for id in ("HalfCheetah-v5", "Ant-v5"):
        envs = environments(id)
        action = np.zeros(envs[0].action_space.shape, np.float32)
        for env in envs:
            env.reset(seed=0)
        reads: dict[str, Callable[[Any], Call]] = {
            "step": lambda env, a=action: lambda: env.step(a),
            "step, data.qpos": lambda env, a=action: lambda: (env.step(a), env.data.qpos),
            "step, data.qpos[0] += x": lambda env, a=action: lambda: (env.step(a), add(env)),
        }
        for name, call in reads.items():
            yield f"{id}: {name}", [call(env) for env in envs]
        shaped = [Shaped(env) for env in envs]
        yield f"{id}: step of the reward wrapper", [lambda env=env, a=action: env.step(a) for env in shaped]


def bounds() -> Iterator[tuple[str, list[Call]]]:
    """What is left of a step of the reward wrapper if all is free but the package's mj_step and the wrapper itself.
    mjenv's mj_step takes less: it computes fewer frames, searches fewer pairs of geoms, and reads no clock."""
    for id in ("HalfCheetah-v5", "Ant-v5"):
        env, still = environments(id)[1], gymnasium.Env[Any, Any]()
        env.reset(seed=0)
        model, data, torso = env.model, env.data, SimpleNamespace(xpos=env.data.body("torso").xpos.copy())
        zeros = np.zeros(model.nu, np.float32)
        arrays = {name: np.array(getattr(data, name)) for name in ("qpos", "qvel", "ctrl", "qfrc_actuator")}
        still.data = SimpleNamespace(**arrays, body=lambda _, torso=torso: torso)
        still.model, still.dt, still.step = (
            SimpleNamespace(nu=model.nu),
            env.dt,
            partial(operator.getitem, {None: env.step(zeros)}),
        )
        calls = [partial(mujoco.mj_step, model, data, env.frame_skip), partial(Shaped(still).step, None)]
        yield (
            f"{id}: mj_step and wrapper alone",
            [lambda calls=calls: [call() for call in calls], partial(Shaped(env).step, zeros)],
        )


def playing(env: Any) -> Call:
    """Episodes with random actions, of 200 steps at most: both sides then play the same states."""
    rng = np.random.default_rng(0)
    low, high = env.action_space.low, env.action_space.high
    env.reset(seed=0)
    turns = cycle(range(200))

    def step() -> None:
        if env.step(rng.uniform(low, high).astype(np.float32))[2] or next(turns) == 199:
            env.reset()

    return step


def classes() -> Iterator[tuple[str, list[Call]]]:
    """Gymnasium's own classes, and those of the tests."""
    for name in (f"{robot}_v{version}" for robot in ROBOTS for version in (4, 5)):
        try:
            module, kind = f"gymnasium.envs.mujoco.{name}", ROBOTS[name[:-3]]
            theirs = getattr(importlib.import_module(module), kind)()
        except ImportError:  # Pusher-v4 needs MuJoCo 2
            continue
        with mjenv.gymnasium_classes(engine=ENGINE):
            envs = [getattr(importlib.import_module(module), kind)(), theirs]
        yield name, [playing(env) for env in envs]
    folder = Path(tempfile.mkdtemp())
    for name in NAMES:
        yield name, [playing(classes_on(base, folder)[name]()) for base in (Ours, Theirs)]


def agents() -> Iterator[tuple[str, list[Call]]]:
    """Steps of MaMuJoCo, whose observations are made of many reads."""
    try:
        from gymnasium_robotics import mamujoco_v1
    except ImportError:
        return
    rng = np.random.default_rng(0)
    for robot, parts in {"Ant": "2x4", "HalfCheetah": "6x1", "Humanoid": "9|8", "Walker2d": "2x3"}.items():
        envs = [
            mamujoco_v1.parallel_env(robot, parts, gym_env=gymnasium.make(id, **options))
            for id, options in ((f"mjenv:mjenv/{robot}-v5", {"engine": ENGINE}), (f"{robot}-v5", {}))
        ]
        spaces = {agent: envs[0].action_space(agent) for agent in envs[0].possible_agents}
        actions = [
            {agent: rng.uniform(space.low, space.high).astype(np.float32) for agent, space in spaces.items()}
            for _ in range(100)
        ]
        for env in envs:
            env.reset(seed=0)
        yield f"{robot} {parts.replace('|', ', ')}", [partial(step_agents, env, cycle(actions)) for env in envs]


def step_agents(env: Any, actions: Iterator[Any]) -> None:
    if not env.agents:
        env.reset(seed=0)
    env.step(next(actions))


def add(env: Any) -> None:
    env.data.qpos[0] += 1e-9


def of_rows() -> dict[str, Call]:
    """Calls for all rows of a vector, which Gymnasium's vectors lack."""
    envs = mjenv.make_vec("Hopper-v5", ROWS, num_threads=1, engine=ENGINE)
    envs.reset(seed=0)
    action = np.zeros(envs.action_space.shape, np.float32)
    qpos, qvel = envs.data.qpos.copy(), envs.data.qvel.copy()
    rng = np.random.default_rng(0)

    def assign() -> None:
        envs.data.qpos = qpos + rng.uniform(-1e-6, 1e-6, qpos.shape)

    return {
        "step": lambda: envs.step(action),
        "envs.data.qpos": lambda: envs.data.qpos,
        "envs.data.xpos": lambda: envs.data.xpos,
        "envs.data.qpos = x": assign,
        "envs.set_state(qpos, qvel)": lambda: envs.set_state(qpos, qvel),
        'envs.get_attr("dt")': lambda: envs.get_attr("dt"),
    }


def microseconds(call: Call, seconds: float = 0.1) -> float:
    return _with_loop(call, seconds) - _with_loop(lambda: None, 0.02)


def _with_loop(call: Call, seconds: float) -> float:
    count, start = 0, time.process_time()
    while (now := time.process_time()) < start + seconds:
        for _ in range(10):
            call()
        count += 10
    return (now - start) / count * 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    for title, lines in (
        ("one environment", pairs),
        ("bound with the package's mj_step", bounds),
        ("step of a class", classes),
        ("step of MaMuJoCo", agents),
    ):
        print(f"\n| {title}, MuJoCo {ENGINE} | mjenv, us | Gymnasium, us | Gymnasium / mjenv |\n|---|---:|---:|---:|")
        for name, calls in lines():
            times = [[microseconds(call) for call in calls] for _ in range(rounds)]
            ours, theirs = (min(column) for column in zip(*times, strict=True))
            ratio = median(b / a for a, b in times)
            print(f"| {name} | {ours:.2f} | {theirs:.2f} | {ratio:.2f} |", flush=True)
    print(f"\n| {ROWS} Hoppers on one thread | ms |\n|---|---:|")
    for name, call in of_rows().items():
        print(f"| {name} | {min(microseconds(call) for _ in range(rounds)) / 1000:.3f} |", flush=True)


if __name__ == "__main__":
    main()
