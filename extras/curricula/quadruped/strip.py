"""Draws eight moments of a stride of the trained robot side by side, as strip.png. Needs imageio.

python strip.py PLUGIN
"""

from __future__ import annotations

import sys

import imageio.v3
import numpy as np

import mjenv
from evaluate import FORWARD, HERE, ID
from mjenv_learn.policy import Policy

PICTURES, EVERY, FIRST = 8, 4, 100  # a picture every 0.08 s, after 2 s


def main() -> None:
    mjenv.load_tasks(sys.argv[1])
    policy = Policy.load(HERE / "policy.txt")
    env = mjenv.make(ID, render_mode="rgb_array", width=240, height=200, **FORWARD)
    obs, _ = env.reset(seed=1000)
    pictures = []
    for step in range(FIRST + PICTURES * EVERY):
        if step >= FIRST and (step - FIRST) % EVERY == 0:
            pictures.append(env.render())
        obs, *_ = env.step(policy.act(obs))
    imageio.v3.imwrite(HERE / "strip.png", np.concatenate(pictures, axis=1))


if __name__ == "__main__":
    main()
