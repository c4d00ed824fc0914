"""The models of the suite compile to the same arrays and names as those of dm_control, bit for bit."""

from __future__ import annotations

from ast import literal_eval
from typing import Any

import mujoco
import pytest
from dm_control import suite

import mjenv
from compiled_model import differences, fields
from conftest import TASKS

# What dm_control's tasks write in each reset with the same numbers, and mjenv's models have from the start.
CONSTANTS: dict[tuple[str, str], dict[str, Any]] = {
    ("finger", "spin"): {
        "site_rgba['target', 3]": 0,
        "site_rgba['tip', 3]": 0,
        "dof_damping['hinge']": 0.03,
    },
    ("finger", "turn_easy"): {"site_size['target', 0]": 0.07},
    ("finger", "turn_hard"): {"site_size['target', 0]": 0.03},
    ("fish", "upright"): {"geom_rgba['target', 3]": 0},
    ("reacher", "easy"): {"geom_size['target', 0]": 0.05},
    # MuJoCo's compiler computes the radius of the sphere around the geom.
    ("reacher", "hard"): {"geom_size['target', 0]": 0.015, "geom_rbound['target']": 0.015},
}


@pytest.mark.parametrize("task", TASKS, ids="-".join)
def test_model(task: tuple[str, str]) -> None:
    got = mujoco.MjModel.from_xml_string(mjenv.model_xml(f"dm_control/{'-'.join(task)}-v0"))
    physics = suite.load(*task).physics
    for element, value in CONSTANTS.get(task, {}).items():
        array, _, index = element.partition("[")
        getattr(physics.named.model, array)[literal_eval(f"({index[:-1]})")] = value
    if task[0] == "lqr":  # drawn by dm_control, and by mjenv's first reset of a seed
        got.jnt_stiffness[:] = physics.model.jnt_stiffness
    if lines := differences(fields(got), fields(physics.model.ptr)):
        pytest.fail(f"{len(lines)} differences\n" + "\n".join(lines[:40]), pytrace=False)
