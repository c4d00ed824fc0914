"""Plays mjenv's cartpole-swingup in dm_control's viewer. Prints the first observations and closes the window.

Usage: launch_viewer.py STEPS
"""

from __future__ import annotations

import json
import sys
from typing import Any

import glfw
import numpy as np
from dm_control import viewer
from numpy.typing import NDArray

from mjenv_dm_control import suite


def main() -> None:
    steps, random, seen = int(sys.argv[1]), np.random.RandomState(1), []

    def policy(timestep: Any) -> NDArray[np.float64]:
        seen.append(np.concatenate([*timestep.observation.values()]).tolist())
        if len(seen) == steps:
            glfw.set_window_should_close(glfw.get_current_context(), True)
        return random.uniform(-1, 1, 1)

    viewer.launch(lambda: suite.load("cartpole", "swingup", {"random": 3}), policy, width=320, height=240)
    print(json.dumps(seen[:steps]))


if __name__ == "__main__":
    main()
