"""What the comparisons with dm_control have in common."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("MUJOCO_GL", "egl")

sys.path.insert(0, str(Path(__file__).parents[3] / "tests/models"))  # compiled_model.py
sys.path.insert(0, str(Path(__file__).parent / "golden"))
sys.path.append(str(Path(__file__).parents[3] / "tests/pictures"))  # display.py; not its conftest.py

# original_suite sets what NumPy reads when it is imported.
from original_suite import ABSENT, TASKS, flat

# isort: split
import numpy as np
import pytest

__all__ = ["ABSENT", "TASKS", "actions", "flat"]

# Of each kind of what is drawn: lines, tendons, height fields, targets that move, and many lights.
DRAWN = {"cartpole-swingup", "point_mass-easy", "quadruped-escape", "reacher-hard", "humanoid_CMU-stand"}


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="5 seeds and full episodes")
    parser.addoption("--seeds", type=int, help="how many seeds: 2, with --long 5")
    parser.addoption("--steps", type=int, help="steps of an episode: 40, with --long 1000")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """drawn_task: the tasks whose pictures are compared, which takes long."""
    if "drawn_task" in metafunc.fixturenames:
        drawn = TASKS if metafunc.config.getoption("--long") else [task for task in TASKS if "-".join(task) in DRAWN]
        metafunc.parametrize("drawn_task", drawn, ids="-".join)


@pytest.fixture
def seeds(request: pytest.FixtureRequest) -> int:
    return request.config.getoption("--seeds") or (5 if request.config.getoption("--long") else 2)


@pytest.fixture
def steps(request: pytest.FixtureRequest) -> int:
    return request.config.getoption("--steps") or (1000 if request.config.getoption("--long") else 40)


def actions(env: Any, seed: int) -> Callable[[], np.ndarray]:
    """Draws actions, between -1 and 1 where the action has no bounds."""
    spec, random = env.action_spec(), np.random.RandomState(100 + seed)
    low, high = np.maximum(spec.minimum, -1), np.minimum(spec.maximum, 1)
    return lambda: random.uniform(low, high)
