"""The models in assets/ compile to the same arrays as Gymnasium's, bit for bit.

Runs on Python 3.10 with mujoco==2.2.2; record.py made the expected values.
"""

from __future__ import annotations

import mujoco
import pytest

from compiled_model import ASSETS, GOLDEN, MODELS, differences, fields, read


def test_every_model_is_here() -> None:
    assert sorted(path.stem for path in ASSETS.glob("*.xml")) == sorted(MODELS)
    assert sorted(path.stem for path in GOLDEN.glob("*.json")) == sorted(MODELS)


@pytest.mark.parametrize("name", MODELS)
def test_model(name: str) -> None:
    versions, want = read(GOLDEN / f"{name}.json")
    assert mujoco.mj_versionString() == versions["mujoco"]
    got = fields(mujoco.MjModel.from_xml_path(str(ASSETS / f"{name}.xml")))
    if lines := differences(got, want):
        pytest.fail(f"{name}.xml: {len(lines)} differences\n" + "\n".join(lines[:40]), pytrace=False)


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ('timestep="0.01"', 'timestep="0.010000000000000002"', "opt.timestep: "),
        ('range="-3 3"', 'range="-3 3.0000000000000004"', "jnt_range[1, 1]: "),
        ('joint name="joint1"', 'joint name="joint_1"', "names.jnt[1]: "),
        ('rgba="0.9 0.9 0.9 1"', 'rgba="0.9 0.9 0.9 0.99"', "geom_rgba[0, 3]: "),
        ('fromto="0 0 0 0 0 0.02"', 'fromto="0 0 0.02 0 0 0"', "geom_quat[5, 0]: "),
    ],
)
def test_a_change_is_found(old: str, new: str, field: str) -> None:
    text = (ASSETS / "reacher.xml").read_text()
    assert old in text
    if "joint_1" in new:
        text = text.replace('joint="joint1"', 'joint="joint_1"')
    changed = fields(mujoco.MjModel.from_xml_string(text.replace(old, new, 1)))
    lines = differences(changed, read(GOLDEN / "reacher.json")[1])
    assert any(line.startswith(field) for line in lines), lines
