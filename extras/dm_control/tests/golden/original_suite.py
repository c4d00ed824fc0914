"""dm_control's suite, as the tests compare with it and as record.py records it. Import it before NumPy."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import Any

# NumPy's AVX-512 kernels of exp, log1p and arctan2 differ from the C library's functions in the last bits.
os.environ.setdefault("NPY_DISABLE_CPU_FEATURES", "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL")

import mujoco
import numpy as np
from dm_control.mujoco.wrapper.mjbindings import sizes

if mujoco.__version__.startswith("4."):
    # dm_control lists arrays that MuJoCo 4.0 no longer has. Without their names it runs.
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    for struct, made in (("mjmodel", model), ("mjdata", mujoco.MjData(model))):
        for name in [name for name in sizes.array_sizes[struct] if not hasattr(made, name)]:
            del sizes.array_sizes[struct][name]

from dm_control import suite
from dm_control.suite import humanoid_CMU, quadruped


class NumPyWithoutAVX2:
    """NumPy with the C library's tanh, as it is on CPUs without AVX2 and FMA. On others, its last bits differ."""

    tanh = staticmethod(np.vectorize(math.tanh))

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)


quadruped.np = NumPyWithoutAVX2()
if os.environ.get("MUJOCO_GL") == "disabled":
    quadruped.Physics.contexts = None  # escape shows its terrain to OpenGL, also where nothing is drawn

if "walk" not in humanoid_CMU.SUITE:
    # dm_control 1.0.7 has all that this task of newer releases consists of, but does not list it.
    @humanoid_CMU.SUITE.add()
    def walk(**arguments: Any) -> Any:
        env = humanoid_CMU.run(**arguments)
        env.task._move_speed = humanoid_CMU._WALK_SPEED
        return env

    suite.ALL_TASKS += (("humanoid_CMU", "walk"),)

# dog's meshes are not part of mjenv.
ABSENT = {("dog", task) for task in suite.TASKS_BY_DOMAIN["dog"]}
TASKS = [task for task in suite.ALL_TASKS if task not in ABSENT]


def flat(observation: Mapping[str, Any]) -> np.ndarray:
    """The terms of an observation, one after the other."""
    return np.concatenate([np.ravel(value) for value in observation.values()])
