"""mjenv convert: models of MuJoCo 4.0 for the engine 2.2.2. The expected numbers are those that MuJoCo 4.0 compiles."""

from __future__ import annotations

import json
import operator
import re
import shutil
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import mujoco
import numpy as np
import pytest

import mjenv
from mjenv_command import main

MODELS = Path(__file__).resolve().parents[3] / "examples/models"
# Arrays that have the same meaning in both versions.
SAME = (
    "qpos0 qpos_spring body_parentid body_pos body_quat body_ipos body_iquat body_mass body_inertia body_mocapid "
    "jnt_type jnt_bodyid jnt_pos jnt_axis jnt_limited jnt_range jnt_margin jnt_stiffness jnt_solref jnt_solimp "
    "dof_armature dof_damping dof_frictionloss dof_solref dof_solimp geom_type geom_bodyid geom_size geom_friction "
    "geom_condim geom_contype geom_conaffinity geom_priority geom_margin geom_gap geom_solref geom_solimp geom_solmix "
    "geom_rgba geom_fluid site_bodyid site_pos site_quat site_type site_size cam_pos cam_quat cam_fovy light_pos "
    "light_dir tendon_num tendon_limited tendon_range tendon_stiffness tendon_damping tendon_frictionloss wrap_type "
    "wrap_objid wrap_prm eq_solref eq_solimp pair_geom1 pair_geom2 pair_friction key_qpos key_qvel key_mpos"
)
NORMALIZED = "body_quat body_iquat site_quat cam_quat light_dir jnt_axis".split()
OF_ACTUATORS = "trnid gear gainprm biasprm dynprm ctrlrange ctrllimited forcerange forcelimited lengthrange"

# What only sets numbers: both versions compute the same motion, up to rounding.
NUMBERS = """
<mujoco model="numbers">
  <compiler angle="degree" autolimits="true" eulerseq="zyx"/>
  <option timestep="0.001" integrator="Euler"><flag contact="disable"/></option>
  <default>
    <default class="limb">
      <joint axis="0 1 0" range="-80 90" damping="0.2" armature="0.01" stiffness="0.5" springref="20"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" density="800"/>
      <position kp="4" dampratio="0.7" inheritrange="0.9"/>
    </default>
  </default>
  <asset><model name="part" file="part.xml"/></asset>
  <worldbody>
    <body name="trunk" pos="0 0 1">
      <joint name="slide" type="slide" axis="0 0 1" stiffness="200" damping="3"/>
      <geom type="box" size="0.1 0.1 0.05" mass="2"/>
      <replicate count="3" euler="0 0 40" sep="-">
        <frame pos="0.1 0 0" euler="30 20 10">
          <body name="upper" childclass="limb">
            <joint name="hip"/>
            <geom/>
            <body name="lower" pos="0 0 -0.2"><joint name="knee"/><geom/><site name="end" pos="0 0 -0.2"/></body>
          </body>
        </frame>
      </replicate>
      <frame pos="-0.1 0 0" euler="0 0 90"><attach model="part" body="wheel" prefix="left-"/></frame>
    </body>
    <body name="weight" pos="0.3 0.1 0.6"><joint name="ball" type="ball" damping="0.1"/>
      <geom size="0.05" pos="0 0 -0.2"/><site name="weight" pos="0.01 0 -0.1"/></body>
    <body name="target" mocap="true" pos="1 0 1"/>
  </worldbody>
  <equality><connect site1="end-0" site2="weight" solref="0.1 1"/>
    <weld site1="end-1" site2="left-end" torquescale="0.5" solref="0.2 1" active="false"/></equality>
  <tendon><spatial name="rope" range="0 2"><site site="end-0"/><site site="end-2"/></spatial></tendon>
  <actuator>
    <position name="filtered" class="limb" joint="hip-0" timeconst="0.05" dampratio="0"/>
    <position name="hip" class="limb" joint="hip-1"/>
    <motor name="rope" tendon="rope" ctrlrange="-1 1"/>
  </actuator>
  <sensor><framepos objtype="site" objname="end-0"/><jointpos joint="hip-0"/></sensor>
  <keyframe><key name="up" qpos="0.1 .1 .2 .3 .4 .5 .6 .7 1 0 0 0" act="0.3" ctrl="1 2 3"/></keyframe>
</mujoco>"""
PART = """
<mujoco model="part"><compiler meshdir="shapes"/>
  <asset><mesh name="wheel" file="wheel.obj" scale="2 1 1" refpos="0.01 0 0"/></asset>
  <worldbody><body name="wheel"><joint name="axle" axis="1 0 0" frictionloss="0.1"/>
    <geom type="mesh" mesh="wheel" pos="0 0.02 0" euler="10 0 0"/><site name="end" pos="0 0 0.1"/></body></worldbody>
</mujoco>"""
WHEEL = "v 0 0 0\nv 0.1 0 0\nv 0 0.2 0\nv 0 0 0.3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


@pytest.fixture
def numbers(tmp_path: Path) -> Path:
    (tmp_path / "shapes").mkdir()
    (tmp_path / "shapes/wheel.obj").write_text(WHEEL)
    (tmp_path / "part.xml").write_text(PART)
    (tmp_path / "numbers.xml").write_text(NUMBERS)
    return tmp_path / "numbers.xml"


def convert(capsys: pytest.CaptureFixture[str], file: Path, out: Path, *words: str) -> Any:
    assert main(["convert", str(file), "--engine", "2.2.2", "--out", str(out), "--json", *words]) == 0
    return json.loads(capsys.readouterr().out)


def changes(found: Any) -> dict[str, int]:
    return {f"{one['what']}: {one['effect']}": one["times"] for one in found["changes"]}


def check_arrays(file: Path, out: Path, actuators: list[int], more: str = "") -> None:
    """Each array that both versions have is the same, bit for bit. Quaternions and directions, which MuJoCo 2.2.2
    normalizes again, may differ in the last bits."""
    model = mujoco.MjModel.from_xml_path(str(file))
    env = mjenv.make("Model-v0", engine="2.2.2", xml_file=str(out))
    compared = 0
    for name in f"{SAME} {more}".split():
        expected = np.asarray(operator.attrgetter(name)(model))
        found = np.asarray(operator.attrgetter(name)(env.model)).reshape(expected.shape)
        if name == "geom_size":  # those of meshes and height fields are computed from their files
            shapes = mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD
            found, expected = (sizes[~np.isin(model.geom_type, shapes)] for sizes in (found, expected))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14 * (name in NORMALIZED), err_msg=name)
        compared += expected.size
    for name in OF_ACTUATORS.split():
        expected = np.asarray(getattr(model, f"actuator_{name}"))[actuators]
        np.testing.assert_array_equal(getattr(env.model, f"actuator_{name}").reshape(expected.shape), expected, name)
        compared += expected.size
    env.close()
    assert compared > 1000


@pytest.mark.parametrize("name", ["quadruped", "arm", "hand"])
def test_examples(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / f"{name}.xml"
    found = convert(capsys, MODELS / f"{name}.xml", out, "--check")
    check_arrays(MODELS / f"{name}.xml", out, found["actuators"])
    assert [one["steps"] for one in found["apart"]] == [1, 10, 100]
    assert all(0 < one["qpos"] < np.inf and 0 < one["qvel"] < np.inf for one in found["apart"])
    expected = {
        "quadruped": {"implicitfast: Euler instead": 1, "gravcomp: gravity acts in full": 1},
        "arm": {
            "implicitfast: Euler instead": 1,
            "gravcomp: gravity acts in full": 6,
            "actuatorgravcomp: no effect": 4,
            "actuatorfrcrange: not limited": 4,
            "filterexact: filter instead": 4,
            "maxhullvert: the convex hull keeps all its vertices": 1,
            "actuators: those with activation come last, so the controls are grip turn shoulder elbow wrist": 1,
            "jointactfrc sensor: left out of sensordata": 1,
            "geomdist sensor: left out of sensordata": 1,
            "contact sensor: left out of sensordata": 1,
        },
        "hand": {
            "implicitfast: Euler instead": 1,
            "gravcomp: gravity acts in full": 1,
            "actuatorfrcrange: not limited": 1,
        },
    }
    assert changes(found) == expected[name]


def test_numbers(numbers: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Damping ratios, inherited ranges, replicated and attached parts, frames, defaults and sites of equalities.

    The mesh is found from another folder, also after both have moved.
    """
    (numbers.parent / "out").mkdir()
    out = numbers.parent / "out/numbers222.xml"
    found = convert(capsys, numbers, out, "--check")
    assert list(changes(found)) == [
        "filterexact: filter instead",
        "actuators: those with activation come last, so the controls are hip rope filtered",
    ]
    assert found["actuators"] == [1, 2, 0]
    check_arrays(numbers, out, found["actuators"])
    env = mjenv.make("Model-v0", engine="2.2.2", xml_file=str(out))
    np.testing.assert_array_equal(np.ravel(env.model.key_ctrl), [2, 3, 1])
    np.testing.assert_array_equal(np.ravel(env.model.key_act), [0.3])
    env.close()
    assert 'file="../shapes/wheel.obj"' in out.read_text()
    moved = numbers.parent.with_name("moved")
    shutil.move(numbers.parent, moved)
    mjenv.make("Model-v0", engine="2.2.2", xml_file=str(moved / "out/numbers222.xml")).close()


@pytest.mark.parametrize("has_equality", [False, True])
def test_numbers_move_alike(has_equality: bool, numbers: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without filterexact, which 2.2.2 integrates otherwise, the motions differ only by rounding.

    Equalities have the same forces only at rest.
    """
    text = NUMBERS.replace(' timeconst="0.05"', "").replace(' act="0.3"', "")
    if not has_equality:
        text = re.sub("<equality>.*</equality>", "", text, flags=re.DOTALL)
    numbers.write_text(text)
    found = convert(capsys, numbers, numbers.with_name("out.xml"), "--check")
    assert changes(found) == {}
    for one in found["apart"][: 1 if has_equality else 3]:
        assert one["qpos"] < 1e-12
        assert one["qvel"] < 1e-12


MORE = (
    "body_user jnt_user geom_user jnt_group sensor_dim sensor_adr sensor_cutoff sensor_noise hfield_size hfield_data "
    "mat_texrepeat mat_specular mat_rgba light_castshadow light_diffuse light_targetbodyid cam_targetbodyid "
    "cam_mode light_mode pair_dim pair_solref pair_margin numeric_data tuple_objid tuple_objprm key_act key_ctrl "
    "key_time key_mquat actuator_cranklength actuator_trntype actuator_group actuator_actrange actuator_actlimited "
    "tendon_width tendon_rgba wrap_prm eq_type stat.extent stat.center nuserdata "
    "opt.timestep opt.gravity opt.wind opt.density opt.viscosity opt.integrator opt.cone opt.jacobian opt.solver "
    "opt.iterations opt.tolerance opt.impratio opt.noslip_iterations opt.noslip_tolerance opt.o_margin opt.o_solref "
    "opt.o_solimp"
)


def test_rest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    heights = np.arange(48, dtype=np.uint8).reshape(6, 8) * 5
    imageio.imwrite(tmp_path / "hills.png", heights)
    shutil.copy(Path(__file__).with_name("rest.xml"), tmp_path)
    found = convert(capsys, tmp_path / "rest.xml", tmp_path / "out.xml", "--check")
    assert found["actuators"] == list(range(7))
    assert list(changes(found)) == []
    check_arrays(tmp_path / "rest.xml", tmp_path / "out.xml", found["actuators"], MORE)


CHANGES = {
    '<option integrator="implicitfast" ls_iterations="7"/>': [
        "implicitfast: Euler instead",
        "ls_iterations: no effect",
    ],
    '<option><flag eulerdamp="disable" island="disable"/></option>': [
        "flag eulerdamp: Euler always integrates damping implicitly",
        "flag island: no effect",
    ],
    '<worldbody><body><joint actuatorfrcrange="-1 1"/><geom size="1"/></body></worldbody>': [
        "actuatorfrcrange: not limited"
    ],
    '<worldbody><geom size="1" margin="0.1"/></worldbody>': ["margin: of two geoms the greater one, not the sum"],
    '<worldbody><geom size="1"/></worldbody><sensor><e_kinetic/></sensor>': [
        "e_kinetic sensor: left out of sensordata"
    ],
}


@pytest.mark.parametrize("part", CHANGES)
def test_changes(part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    joint = '<worldbody><body><joint/><geom size="1"/></body></worldbody>'
    (tmp_path / "model.xml").write_text(f"<mujoco>{joint}{part}</mujoco>")
    assert list(changes(convert(capsys, tmp_path / "model.xml", tmp_path / "out.xml"))) == CHANGES[part]


def test_for_people(numbers: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = numbers.with_name("out.xml")
    assert main(["convert", str(numbers), "--out", str(out), "--check"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{out}: for the engine 2.2.2"
    assert lines[1] == "  filterexact: filter instead"
    assert [line.split()[0] for line in lines[-4:]] == ["steps", "1", "10", "100"]


FLEX = '<flexcomp name="cloth" type="grid" count="3 3 1" spacing=".1 .1 .1" mass="1" radius="0.01" dim="2"/>'
REFUSED = {
    f"<worldbody>{FLEX}</worldbody>": "it has flexes (1)",
    '<worldbody><body><joint name="j"/><geom size="1"/></body></worldbody>'
    '<actuator><dcmotor joint="j" motorconst="1" resistance="1"/></actuator>': "dcmotor",
    "<worldbody><unknown/></worldbody>": "unknown",
    '<worldbody><body><joint name="j"/><geom size="1"/></body></worldbody>'
    '<actuator><position joint="j" delay="0.1" nsample="3"/></actuator>': "actuators with delays",
}


@pytest.mark.parametrize("part", REFUSED)
def test_refusals(part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "model.xml").write_text(f"<mujoco>{part}</mujoco>")
    assert main(["convert", str(tmp_path / "model.xml"), "--out", str(tmp_path / "out.xml")]) == 2
    assert REFUSED[part] in capsys.readouterr().err
    assert not (tmp_path / "out.xml").exists()


def test_files(numbers: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = numbers.read_text()
    assert main(["convert", str(numbers), "--out", str(numbers)]) == 2
    assert "write the converted model to another file" in capsys.readouterr().err
    assert numbers.read_text() == text
    assert main(["convert", str(numbers.with_name("missing.xml")), "--out", str(numbers)]) == 2
    assert "missing.xml" in capsys.readouterr().err
    assert main(["convert", str(numbers), "--out", str(numbers.with_name("none") / "out.xml")]) == 2
    assert "out.xml" in capsys.readouterr().err
