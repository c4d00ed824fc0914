"""The options with which QuadrupedJoystick-v0 is trained: robots that differ, noisy and late sensors, and kicks."""

from __future__ import annotations

from typing import Any

import mjenv

ID = "QuadrupedJoystick-v0"

# Standard deviations of the terms of the group "policy", with their lengths. The critic sees no noise.
_POLICY_TERMS = ((0.03, 3), (0.1, 3), (0.15, 3), (0.02, 12), (0.5, 12), (0.0, 12), (0.0, 3), (0.0, 2))
_CRITIC_TERMS = 60
_NOISE = [*(std for std, count in _POLICY_TERMS for _ in range(count)), *[0.0] * _CRITIC_TERMS]

OPTIONS: dict[str, Any] = {
    "history": 3,
    "noise": mjenv.Noise(observation=_NOISE),
    "delay": mjenv.Delay(observation=(0, 1)),
    "randomize": {
        "geom_friction": mjenv.Scale(0.6, 1.2, columns=0, shared=True),
        "body_mass": mjenv.Offset(-1, 2, body="trunk"),
        # kp is in two arrays, which share one draw.
        "actuator_gainprm": mjenv.Scale(0.85, 1.15, columns=0, shared=True),
        "actuator_biasprm": mjenv.Same(columns=1),
    },
    "push": [
        mjenv.Push("trunk", velocity=((-0.4, 0.4), (-0.4, 0.4), (0, 0)), every=(100, 300)),
        mjenv.Push("trunk", force=((-15, 15), (-15, 15), (0, 0)), every=(100, 300), duration=(10, 50)),
    ],
}
