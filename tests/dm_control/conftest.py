"""What the comparisons with dm_control have in common."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

# Before NumPy is imported: its AVX-512 kernels of exp, log1p and arctan2 differ from the C library's in the last bits.
os.environ.setdefault("NPY_DISABLE_CPU_FEATURES", "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL")
os.environ.setdefault("MUJOCO_GL", "egl")

sys.path.insert(0, str(Path(__file__).parent.parent / "models"))  # compiled_model.py

import mujoco
import numpy as np
import pytest
from dm_control.mujoco.wrapper.mjbindings import sizes

if mujoco.__version__.startswith("4."):
    # dm_control lists arrays that MuJoCo 4.0 no longer has. Without their names it runs.
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    for struct, made in (("mjmodel", model), ("mjdata", mujoco.MjData(model))):
        for name in [name for name in sizes.array_sizes[struct] if not hasattr(made, name)]:
            del sizes.array_sizes[struct][name]

from dm_control import suite

# dog has meshes, and escape a terrain that SciPy makes.
ABSENT = {("dog", task) for task in suite.TASKS_BY_DOMAIN["dog"]} | {("quadruped", "escape")}
TASKS = [task for task in suite.ALL_TASKS if task not in ABSENT]
# Of each kind of what is drawn: lines, tendons, height fields, targets that move, and many lights.
DRAWN = {"cartpole-swingup", "point_mass-easy", "quadruped-fetch", "reacher-hard", "humanoid_CMU-stand"}


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="5 seeds and full episodes")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """drawn_task: the tasks whose pictures are compared, which takes long."""
    if "drawn_task" in metafunc.fixturenames:
        drawn = TASKS if metafunc.config.getoption("--long") else [task for task in TASKS if "-".join(task) in DRAWN]
        metafunc.parametrize("drawn_task", drawn, ids="-".join)


@pytest.fixture
def seeds(request: pytest.FixtureRequest) -> int:
    return 5 if request.config.getoption("--long") else 2


@pytest.fixture
def steps(request: pytest.FixtureRequest) -> int:
    return 1000 if request.config.getoption("--long") else 40


def flat(observation: Mapping[str, Any]) -> np.ndarray:
    return np.concatenate([np.ravel(value) for value in observation.values()])


def actions(env: Any, seed: int) -> Callable[[], np.ndarray]:
    """Draws actions, between -1 and 1 where the action has no bounds."""
    spec, random = env.action_spec(), np.random.RandomState(100 + seed)
    low, high = np.maximum(spec.minimum, -1), np.minimum(spec.maximum, 1)
    return lambda: random.uniform(low, high)
