"""The models in assets/dm_control compile to the same arrays and names as those of dm_control's suite, bit for bit.

Runs on the Python of tools/setup dm_control, which has the originals.
"""

from __future__ import annotations

import os

os.environ["MUJOCO_GL"] = "disabled"

import mujoco
import pytest
from dm_control import suite

from compiled_model import ASSETS, differences, fields

FOLDER = ASSETS / "dm_control"
# Their code makes the model, for a number of poles, balls or links.
MADE_BY_CODE = {"cartpole", "lqr", "swimmer"}
# Not part of mjenv: dog has meshes, and escape a terrain that SciPy makes.
ABSENT = {("dog", task) for task in suite.TASKS_BY_DOMAIN["dog"]} | {("quadruped", "escape")}
TASKS = [task for task in suite.ALL_TASKS if task not in ABSENT and task[0] not in MADE_BY_CODE]


@pytest.mark.parametrize("task", TASKS, ids="-".join)
def test_model(task: tuple[str, str]) -> None:
    of_task = FOLDER / f"{'_'.join(task)}.xml"
    path = of_task if of_task.exists() else FOLDER / f"{task[0]}.xml"
    got = fields(mujoco.MjModel.from_xml_path(str(path)))
    if lines := differences(got, fields(suite.load(*task).physics.model.ptr)):
        pytest.fail(f"{path.name}: {len(lines)} differences\n" + "\n".join(lines[:40]), pytrace=False)
