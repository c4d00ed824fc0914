"""How long programs take that look into a simulation, on mjenv and on Gymnasium, in one process and in turns.

    measure.py [--rounds N]

Prints a table: CPU microseconds of each, the least of the rounds, and their ratio. Needs Gymnasium with the mujoco
package of the engine's version.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import mujoco
import numpy as np

import mjenv
from mjenv.capi.engine import name_of

ENGINE = name_of(mujoco.__version__)
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


def pairs() -> dict[str, list[Call]]:
    """For each line of the table, the call on mjenv and on Gymnasium."""
    found: dict[str, list[Call]] = {}
    calls: dict[str, Callable[[Any], Call]] = {
        "data.qpos": lambda env: lambda: env.data.qpos,
        "data.qpos[0] = x": lambda env: lambda: env.data.qpos.__setitem__(0, 0.1),
        'data.body("torso").xpos': lambda env: lambda: env.data.body("torso").xpos,
        "model.nq": lambda env: lambda: env.model.nq,
        "dt": lambda env: lambda: env.dt,
        "state_vector()": lambda env: env.state_vector,
    }
    envs = environments("HalfCheetah-v5")
    for env in envs:
        env.reset(seed=0)
    for name, call in calls.items():
        found[name] = [call(env) for env in envs]
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
            found[f"{id}: {name}"] = [call(env) for env in envs]
        shaped = [Shaped(env) for env in envs]
        found[f"{id}: step of the reward wrapper"] = [lambda env=env, a=action: env.step(a) for env in shaped]
    return found


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
    print(f"| one environment, MuJoCo {ENGINE} | mjenv, us | Gymnasium, us | Gymnasium / mjenv |\n|---|---:|---:|---:|")
    for name, calls in pairs().items():
        times = [[microseconds(call) for call in calls] for _ in range(rounds)]
        ours, theirs = (min(column) for column in zip(*times, strict=True))
        print(f"| {name} | {ours:.2f} | {theirs:.2f} | {theirs / ours:.2f} |", flush=True)
    print(f"\n| {ROWS} Hoppers on one thread | ms |\n|---|---:|")
    for name, call in of_rows().items():
        print(f"| {name} | {min(microseconds(call) for _ in range(rounds)) / 1000:.3f} |", flush=True)


if __name__ == "__main__":
    main()
