"""Measures environments of a peer from Python, as create.c does in C: create.py seconds|bytes PEER ID ENVS THREADS

The outputs belong to the peers here, and count.
"""

from __future__ import annotations

import gc
import os
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

AGAIN, STEPS = 5, 3


def mjenv_creator(id: str, threads: int) -> Callable[[int], Any]:
    import mjenv

    return lambda envs: mjenv.make_vec(id, envs, num_threads=threads)


def mujoco_batch_creator(id: str, threads: int) -> Callable[[int], Any]:
    import gymnasium
    from mujoco.batch import Batch

    bare: Any = gymnasium.make(id).unwrapped
    return lambda envs: Batch(bare.model, envs, threads)


def envpool_creator(id: str, threads: int) -> Callable[[int], Any]:
    import envpool

    return lambda envs: envpool.make_gymnasium(id, num_envs=envs, num_threads=threads)


CREATORS = {"mjenv": mjenv_creator, "mujoco-batch": mujoco_batch_creator, "envpool": envpool_creator}


def play(env: Any, peer: str, envs: int) -> None:
    if peer == "mujoco-batch":
        env.bind("ctrl")[:] = 0.1
        for _ in range(STEPS):
            env.step()
    else:
        env.reset()
        space = env.single_action_space if peer == "mjenv" else env.action_space
        actions = np.full((envs, *space.shape), 0.1, space.dtype)
        for _ in range(STEPS):
            env.step(actions)


def resident() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")


def seconds_to_create(create: Callable[[int], Any], envs: int) -> float:
    gc.collect()
    start = time.perf_counter()
    env = create(envs)
    seconds = time.perf_counter() - start
    del env
    return seconds


def main() -> None:
    mode, peer, id = sys.argv[1:4]
    envs, threads = map(int, sys.argv[4:6])
    create = CREATORS[peer](id, threads)
    if mode == "seconds":
        first = seconds_to_create(create, envs)
        print(f"{first:.6f} {min(seconds_to_create(create, envs) for _ in range(AGAIN)):.6f}")
        return
    kept, sizes = [], []
    for count in (threads, envs):
        before = resident()
        env = create(count)
        play(env, peer, count)
        sizes.append(resident() - before)
        kept.append(env)
    print(*sizes)


if __name__ == "__main__":
    main()
