"""Draws eight moments of the trained robot on rough ground side by side, as joystick/strip.png. Needs imageio.

python strip_joystick.py PLUGIN
"""

from __future__ import annotations

import sys

import imageio.v3
import numpy as np

import mjenv
from evaluate_joystick import HARDEST, HERE
from joystick_options import ID, OPTIONS
from mjenv_learn.policy import Policy

PICTURES, EVERY, FIRST = 8, 10, 100  # a picture every 0.2 s, after 2 s
AHEAD = {"command_forward": (0.6, 0.6), "command_left": (0, 0), "command_turn": (0, 0)}


def main() -> None:
    mjenv.load_tasks(sys.argv[1])
    policy = Policy.load(HERE / "joystick" / "policy.txt")
    ground = {"least_level": HARDEST, "most_level": HARDEST}
    settings = {"render_mode": "rgb_array", "width": 240, "height": 200}
    env = mjenv.make(ID, **{**OPTIONS, **AHEAD, **ground, **settings})
    obs, _ = env.reset(seed=1000)
    pictures = []
    for step in range(FIRST + PICTURES * EVERY):
        if step >= FIRST and (step - FIRST) % EVERY == 0:
            pictures.append(env.render())
        obs, *_ = env.step(policy.act(obs))
    imageio.v3.imwrite(HERE / "joystick" / "strip.png", np.concatenate(pictures, axis=1))


if __name__ == "__main__":
    main()
