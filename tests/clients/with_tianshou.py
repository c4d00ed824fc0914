"""Tianshou: its vectors of environments, and the adapter for mjenv.make_vec in docs/clients.md."""

import re
from pathlib import Path

import gymnasium
import numpy as np
from tianshou.env import DummyVectorEnv, ShmemVectorEnv, SubprocVectorEnv

from common import ON_MJENV, digest, id_of, show

ADAPTER = re.search(r"```python\n(.*?)```", Path("docs/clients.md").read_text(), re.DOTALL)[1]


def make():
    return gymnasium.make(id_of("Hopper-v5"))


def play(envs):
    envs.seed(3)
    rng, found = np.random.default_rng(0), [envs.reset()[0]]
    for _ in range(60):
        obs, reward, terminated, truncated, _ = envs.step(rng.uniform(-1, 1, (3, 3)).astype(np.float32))
        found.append([obs, reward, terminated, truncated])
        if (ended := np.flatnonzero(terminated | truncated)).size:
            found.append(envs.reset(ended)[0])
    envs.close()
    return digest(found)


def main():
    for kind in (DummyVectorEnv, SubprocVectorEnv, ShmemVectorEnv):
        show(kind.__name__, play(kind([make] * 3)))
    names = {}
    exec(ADAPTER, names)
    show("adapter", play(names["Rows"]("Hopper-v5", 3) if ON_MJENV else DummyVectorEnv([make] * 3)))


if __name__ == "__main__":
    main()
