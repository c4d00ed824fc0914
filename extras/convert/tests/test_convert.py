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
from mjenv_convert import older_mjcf

MODELS = Path(__file__).resolve().parents[3] / "examples/models"
# Arrays that have the same meaning in both versions.
SAME = (
    "qpos0 qpos_spring body_parentid body_pos body_quat body_ipos body_iquat body_mass body_inertia body_mocapid "
    "jnt_type jnt_bodyid jnt_pos jnt_axis jnt_limited jnt_range jnt_margin jnt_stiffness jnt_solref jnt_solimp "
    "dof_armature dof_damping dof_frictionloss dof_solref dof_solimp geom_type geom_bodyid geom_size geom_friction "
    "geom_condim geom_contype geom_conaffinity geom_priority geom_solref geom_solimp geom_solmix "
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
        "quadruped": {
            "implicitfast: Euler instead": 1,
            "contacts of sphere-box: other depths once a centre is inside the box": 1,
            "gravcomp: gravity acts in full": 1,
        },
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
            "connect: no centripetal and Coriolis accelerations": 1,
            "contacts of box-box, box-mesh, capsule-cylinder, capsule-mesh, cylinder-box, cylinder-cylinder, "
            "cylinder-mesh, mesh-mesh, plane-mesh: found by another method": 9,
            "contacts of capsule-box: other depths once a centre is inside the box": 1,
            "mesh: its geoms' frames are at another place of the shape": 2,
        },
        "hand": {
            "implicitfast: Euler instead": 1,
            "contacts of capsule-box, sphere-box: other depths once a centre is inside the box": 2,
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
        *EQUALITIES,
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


EQUALITIES = [
    "connect: no centripetal and Coriolis accelerations",
    "weld: no centripetal and Coriolis accelerations",
    "weld: rotations are held with another strength",
]


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
    assert list(changes(found)) == has_equality * EQUALITIES
    for one in found["apart"][: 1 if has_equality else 3]:
        assert one["qpos"] < 1e-12
        assert one["qvel"] < 1e-12


MORE = (
    "body_user jnt_user geom_user jnt_group sensor_dim sensor_adr sensor_cutoff sensor_noise hfield_size hfield_data "
    "mat_texrepeat mat_specular mat_rgba light_castshadow light_diffuse light_targetbodyid cam_targetbodyid "
    "cam_mode light_mode pair_dim pair_solref numeric_data tuple_objid tuple_objprm key_act key_ctrl "
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
    assert list(changes(found)) == [
        "RK4: ball and free joints are integrated less exactly",
        "CG: other forces where it stops before it has converged",
        "gap with o_margin: no contacts within the gap",
        *EQUALITIES[1:],
        "refsite: another moment if it moves",
        "contacts of ellipsoid-cylinder, hfield-ellipsoid, hfield-mesh, hfield-sphere, sphere-ellipsoid, sphere-mesh: "
        "found by another method",
    ]
    check_arrays(tmp_path / "rest.xml", tmp_path / "out.xml", found["actuators"], MORE)


# Random models have one of the features of each part. The converter lists the lines of these features, and no others.
# Models of features without a line move alike on both engines.
PARTS = """
<mujoco><option tolerance="0"/><option {option}/>
<worldbody><light name="light" pos="0 0 4" {light}/><camera name="eye" pos="0 -3 1" {camera}/>
  <site name="wall" pos="0 0 2"/><geom name="floor" type="plane" size="5 5 .1"/>
  <body pos="2 0 .09"><freejoint/><geom name="stone" size=".1" {stone}/></body>
  <body name="arm" pos="0 0 1" {body}><joint name="hinge" axis="0 1 0" {hinge}/><geom size=".05" pos=".2 .1 0" {geom}/>
    <site name="end" pos=".1 0 .2" {site}/>
    <body pos=".3 0 0"><joint name="slide" type="slide" axis="1 0 0"/><geom name="tip" size=".05" pos="0 0 .2"/></body>
  </body>
  <body name="free" pos="-1 0 1"><joint name="free" type="free" {free}/><site name="free"/>
    <geom type="ellipsoid" size=".1 .2 .3" contype="0" conaffinity="0" {fluid}/></body>
  <body pos="0 2 1"><joint name="ball" type="ball" {ball}/><geom size=".05" pos=".2 .1 0"/></body></worldbody>
<contact><pair geom1="floor" geom2="tip" {pair}/></contact>
<tendon><fixed name="sum" {tendon}><joint joint="hinge" coef="2"/><joint joint="slide" coef="-1"/></fixed>
  <spatial name="rope"><site site="wall"/><site site="end"/></spatial></tendon>
<equality>{equality}</equality><actuator>{actuator}<velocity name="motor" joint="slide" ctrlrange="-1 1"/></actuator>
<sensor><jointpos joint="hinge"/>{sensor}</sensor></mujoco>"""


def each(pattern: str, words: str) -> dict[str, str]:
    return {pattern.replace("*", word): "" for word in words.split()}


LIMITS = {
    'limited="false" range="-1 1"': "",
    'range="0 .1"': "",
    'range="0 .1" margin=".1" solreflimit=".1 .5" solimplimit=".5 .6 .1 .3 3"': "",
}
MOTION = LIMITS | {
    'damping=".3"': "",
    'stiffness="2"': "",
    'frictionloss=".2" solreffriction=".1 .5" solimpfriction=".3 .4 .1 .5 2"': "",
}
GENERAL = '<general joint="hinge" {}/>'
FEATURES = {
    "option": {'timestep=".004" gravity="1 2 -3"': "", 'wind="1 2 3" density="2" viscosity=".3"': ""}
    | {'magnetic="1 2 3" impratio="3"': "", 'jacobian="sparse"': "", 'cone="elliptic"': ""}
    | {'o_margin=".1" o_friction="1 1 1 1 1"': "", 'noslip_iterations="3"': ""}
    | each(
        '><flag *="disable"/></option><option',
        "clampctrl constraint damper equality frictionloss gravity limit nativeccd refsafe sensor spring",
    )
    | {'><flag energy="enable" fwdinv="enable"/></option><option': ""}
    | {
        'integrator="implicit"': "implicit: limits of actuators do not limit their damping",
        'integrator="implicitfast"': "implicitfast: Euler instead",
        'integrator="discrete"': "discrete: Euler instead",
        'integrator="RK4"': "RK4: ball and free joints are integrated less exactly",
        'solver="PGS"': "PGS: other forces where it stops before it has converged",
        'solver="CG"': "CG: other forces where it stops before it has converged",
        'iterations="2"': "Newton: other forces where it stops before it has converged",
        'actuatorgroupdisable="0"': "actuatorgroupdisable: all actuators act",
        'ls_iterations="7"': "ls_iterations: no effect",
        '><flag actuation="disable"/></option><option': "flag actuation: the velocities of actuators are 0",
        '><flag eulerdamp="disable"/></option><option': "flag eulerdamp: Euler always integrates damping implicitly",
        '><flag sleep="enable"/></option><option': "flag sleep: bodies never sleep",
        '><flag diagexact="enable"/></option><option': "flag diagexact: constraints have an approximate diagonal",
    },
    "light": {"": "", 'directional="true" castshadow="false"': "", 'mode="targetbody" target="arm" cutoff="30"': ""}
    | {'type="point"': "light type: spot instead", 'range="3"': "light range: no effect"},
    "camera": {"": "", 'mode="trackcom" fovy="33" ipd=".1"': ""}
    | {'projection="orthographic"': "orthographic camera: drawn in perspective"}
    | {'output="depth"': "cam output: no effect"},
    "site": {"": "", 'type="box" size=".1 .2 .3" quat="1 2 3 4" user="1"': ""},
    "body": {"": "", 'quat="1 2 3 4"': "", 'gravcomp=".5"': "gravcomp: gravity acts in full"},
    "stone": {"": "", 'margin=".03"': "", 'gap=".03"': "", 'margin=".02" gap=".03"': "", 'margin="-.01" gap=".03"': ""}
    | {'condim="6" friction="1 .2 .1" solref=".1 1" solmix="2"': "", 'priority="1" solimp=".5 .8 .1 .4 3"': ""}
    | {'margin="-.01"': "margin, gap: of two geoms the greater one, not the sum"},
    "pair": {"": "", 'gap=".9"': "", 'margin=".8" gap=".1" condim="4" friction=".3 .4 .1 .1 .1"': ""}
    | {'solreffriction=".1 1"': "solreffriction: solref instead"},
    "geom": {"": "", 'mass="2" friction=".3" group="2" user="1 2"': "", 'density="10"': ""}
    | {'castshadow="false"': "castshadow: geoms cast shadows"},
    "fluid": {"": "", 'fluidshape="ellipsoid" fluidcoef=".5 .2 1.5 1 .9"': "", 'mass="3" shellinertia="true"': ""},
    "hinge": MOTION
    | {'ref=".3" springref=".4" stiffness="3" armature=".2" pos=".1 .2 .3"': "", 'springdamper=".1 1"': ""}
    | {
        'actuatorfrcrange="-.1 .1"': "actuatorfrcrange: not limited",
        'actuatorgravcomp="true"': "actuatorgravcomp: no effect",
        'stiffness="3 1 2"': "stiffness: linear",
        'damping="1 2 3"': "damping: linear",
    },
    "ball": MOTION | {'limited="false" range="0 1"': "", 'armature=".2"': ""},
    "free": {"": "", 'damping=".3"': "", 'stiffness="2"': "", 'frictionloss=".2"': "", 'armature=".2" margin=".1"': ""},
    "tendon": MOTION
    | {'springlength=".3" stiffness="2" group="1"': ""}
    | {
        'springlength="0 1" stiffness="3"': "springlength: the middle of the range",
        'armature=".3"': "tendon armature: none",
        'actuatorfrcrange="-.1 .1"': "tendon actuatorfrcrange: not limited",
        'stiffness="3 1 2"': "tendon stiffness: linear",
        'damping="1 2 3"': "tendon damping: linear",
    },
    "equality": {"": "", '<joint joint1="hinge" joint2="slide" polycoef=".1 2 .3 0 .1"/>': ""}
    | {'<tendon tendon1="sum" polycoef=".1 0 0 0 0" active="false"/>': ""}
    | {'<connect body1="arm" body2="free" anchor="0 0 0"/>': "connect: no centripetal and Coriolis accelerations"},
    "actuator": {
        GENERAL.format(words): ""
        for words in (
            'ctrllimited="false" ctrlrange="-1 1"',
            'forcelimited="false" forcerange="-1 1"',
            'dyntype="integrator" actlimited="false" actrange="-1 1"',
            'dyntype="integrator" actrange="-.1 .1" ctrlrange="-1 1" forcerange="-.1 .1"',
            'dyntype="filter" dynprm=".1" gaintype="affine" gainprm="1 2 3" biastype="affine" biasprm="3 2 1"',
            'gainprm="1 2 3 4 5 6 7 8 9 10" gear="2" group="3" user="1"',
        )
    }
    | {'<position joint="hinge" kp="3" dampratio="1"/><velocity site="end" refsite="wall" gear="1 2 3 4 5 6"/>': ""}
    | {'<damper tendon="rope" kv="2" ctrlrange="0 1"/><motor jointinparent="ball" gear="1 2 3"/>': ""}
    | {'<motor site="end" refsite="free" gear="1 2 3 0 0 0"/>': "refsite: another moment if it moves"}
    | {'<adhesion body="free" ctrlrange="0 1" gain="3"/><motor joint="free" gear="1 2 3 4 5 6"/>': ""}
    | {'<motor cranksite="end" slidersite="wall" cranklength="3"/><cylinder joint="hinge" timeconst=".3"/>': ""}
    | {'<muscle joint="hinge" lengthrange="-1 1" force="3" timeconst=".1 .2" vmax="3"/>': ""}
    | {
        '<muscle joint="hinge" lengthrange="-1 1" force="3" tausmooth="1"/>': "tausmooth: none",
        '<position joint="hinge" timeconst=".2"/>': "filterexact: filter instead",
        GENERAL.format('dyntype="filter" dynprm=".1" actearly="true"'): "actuator actearly: no effect",
        GENERAL.format('damping="2"'): "actuator damping: none",
        GENERAL.format('armature="2"'): "actuator armature: none",
    },
    "sensor": each('<* site="end"/>', "touch accelerometer velocimeter gyro magnetometer rangefinder")
    | each('<tendon* tendon="sum"/>', "pos vel")
    | each('<joint* joint="hinge" cutoff=".01" noise=".1"/>', "vel")
    | each('<actuator* actuator="motor"/>', "pos vel frc")
    | each('<subtree* body="arm" user="1 2"/>', "com linvel angmom")
    | each('<ball* joint="ball"/>', "quat angvel")
    | each(
        '<frame* objtype="geom" objname="tip" reftype="body" refname="free"/>',
        "pos quat xaxis yaxis zaxis linvel angvel",
    )
    | each('<frame* objtype="xbody" objname="arm"/>', "pos linacc angacc")
    | {'<user dim="3" objtype="joint" objname="hinge" needstage="vel" datatype="axis"/><clock/>': ""}
    | {'<user dim="2"/>': ""}
    | {
        '<force site="end"/>': "force, torque: without the forces of tendons",
        "<e_kinetic/>": "e_kinetic sensor: left out of sensordata",
        '<rangefinder camera="eye"/>': "rangefinder sensor: left out of sensordata",
        '<jointpos joint="hinge" delay=".1" nsample="3"/>': "sensor delay: none",
    },
}


def check_motion(file: Path, out: Path, actuators: list[int], random: np.random.Generator) -> None:
    """Both engines compute the same from random states and controls."""
    model = mujoco.MjModel.from_xml_path(str(file))
    data, env = mujoco.MjData(model), mjenv.make("Model-v0", engine="2.2.2", xml_file=str(out))
    activations = [model.actuator_actadr[one] for one in actuators if model.actuator_actadr[one] >= 0]
    for scale in (0, 0.1, 0.1):
        mujoco.mj_resetData(model, data)
        mujoco.mj_integratePos(model, data.qpos, random.normal(0, scale, model.nv), 1)
        data.qvel[:], data.act[:] = random.normal(0, scale, model.nv), random.uniform(0, 1, model.na)
        data.ctrl[:] = random.uniform(-2, 2, model.nu)
        env.reset()
        env.data.ctrl = data.ctrl[actuators]
        if model.na:
            env.data.act = data.act[activations]
        env.set_state(data.qpos, data.qvel)
        mujoco.mj_forward(model, data)
        for name in "qfrc_bias qfrc_passive qfrc_actuator qfrc_constraint qacc sensordata ten_length ncon nefc".split():
            np.testing.assert_allclose(
                np.ravel(getattr(env.data, name)), np.ravel(getattr(data, name)), 1e-6, 1e-6, err_msg=name
            )
        env.do_simulation(data.ctrl[actuators], 1)
        mujoco.mj_step(model, data)
        for name, expected in (("qpos", data.qpos), ("qvel", data.qvel), ("act", data.act[activations])):
            np.testing.assert_allclose(np.ravel(getattr(env.data, name)), expected, 1e-7, 1e-7, err_msg=name)
    env.close()


@pytest.mark.parametrize("changes_are_listed", [False, True])
def test_promise(changes_are_listed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    random = np.random.default_rng(3)
    parts = {
        part: [*random.permutation([text for text, line in texts.items() if changes_are_listed or not line])]
        for part, texts in FEATURES.items()
    }
    file, out = tmp_path / "model.xml", tmp_path / "out.xml"
    for number in range(max(map(len, parts.values()))):
        chosen = {part: str(texts[number % len(texts)]) for part, texts in parts.items()}
        file.write_text(PARTS.format(**chosen))
        found = convert(capsys, file, out)
        lines = {FEATURES[part][text] for part, text in chosen.items()} - {""}
        expected = {*lines}
        if found["actuators"] != sorted(found["actuators"]):
            expected |= {line for line in changes(found) if line.startswith("actuators: ")}
        if any("armature" in line for line in lines):
            expected.add("body_invweight0: other numbers, so constraints are stiffer or softer")
        assert {*changes(found)} == expected, chosen
        if not lines:
            check_motion(file, out, found["actuators"], random)


BALL = '<geom name="f" type="plane" size="5 5 .1"/><body pos="0 0 .11"><freejoint/><geom name="g" size=".1" {}/></body>'
OVERRIDE = '</worldbody><option {}><flag override="enable"/></option><worldbody>'
MOCAP = '<body mocap="true"><geom size=".1"/><body pos=".15 0 0"><joint axis="0 1 0"/><geom size=".1"/>{}</body></body>'
MESH = '</worldbody><asset><mesh name="m" inertia="shell" vertex="0 0 0 1 0 0 0 2 0 0 0 3"/></asset><worldbody>'
# Models, by the text of their worldbody, with what changes.
CHANGES: dict[str, list[str]] = {
    BALL.format('gap=".05"'): [],
    BALL.format('margin=".02" gap=".01"'): [],
    '</worldbody><default><geom gap=".05"/></default><worldbody>' + BALL.format(""): [
        "margin, gap: of two geoms the greater one, not the sum"
    ],
    BALL.format('conaffinity="0" contype="0"')
    + '</worldbody><contact><pair geom1="f" geom2="g" margin=".01" gap=".05"/></contact><worldbody>': [],
    BALL.format('margin=".02" gap=".01"') + OVERRIDE.format('o_margin=".03"'): [
        "gap with o_margin: no contacts within the gap"
    ],
    BALL.format("") + OVERRIDE.format('o_friction="2 1 1 1 1"'): ["o_friction: the geoms' own friction"],
    '<body><joint name="j" axis="0 1 0"/><geom size="1"/></body></worldbody>'
    '<default><joint limited="false" range="-1 1"/>'
    '<motor ctrllimited="false" ctrlrange="-1 1" forcelimited="false" forcerange="-1 1"/></default><actuator>'
    '<motor joint="j"/></actuator><worldbody>': [],
    MOCAP.format(""): [],  # the two spheres overlap, and MuJoCo 4.0 finds no contact
    MOCAP.format('<body pos=".3 0 0"><joint axis="0 1 0"/><geom size=".1"/></body>'): [],
    '<geom size=".1"/><body><joint type="slide"/><geom size=".1"/></body>': [
        "body_invweight0: other numbers, so constraints are stiffer or softer"
    ],
    '<geom type="plane" size="5 5 1"/><replicate count="26" offset="1 0 0">'
    '<body><freejoint/><geom size=".1"/></body></replicate>': [
        "size: no more contacts than nconmax (100) and rows of constraints than njmax (500)"
    ],
    MESH + '<body><joint/><geom type="mesh" mesh="m"/></body>': [
        "mesh: its geoms' frames are at another place of the shape"
    ],
    '</worldbody><visual><global orthographic="true" fovy="30"/></visual><worldbody>': [
        "global orthographic: no effect"
    ],
}


@pytest.mark.parametrize("part", CHANGES)
def test_changes(part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    moving = '<body pos="0 9 9"><joint/><geom size="1" contype="0" conaffinity="0"/></body>'
    (tmp_path / "model.xml").write_text(f"<mujoco><worldbody>{moving}{part}</worldbody></mujoco>")
    found = convert(capsys, tmp_path / "model.xml", tmp_path / "out.xml", "--check")
    assert list(changes(found)) == CHANGES[part]
    if not CHANGES[part]:
        assert all(one["qpos"] < 1e-9 and one["qvel"] < 1e-9 for one in found["apart"])


# The arrays that MuJoCo 4.0 computes from those that the converter reads, or that belong to what it refuses.
COMPUTED = re.compile(
    "flex|mesh|bvh|oct|tree|plugin|efm|[BDM]_|map|name|ten_J|.*(adr|num|treeid|plugin|plastic|springyield|actuatorid|bvh.*)$"
)
OTHER_ARRAYS = (
    "actuator_ctrlspec actuator_history body_conaffinity body_contype body_margin cam_intrinsic dof_length geom_aabb "
    "jnt_actfrcrange sensor_history sensor_intprm site_dataid tendon_actfrcrange tendon_type tex_data tex_nchannel"
)


def test_arrays() -> None:
    """The converter names each array of MuJoCo 4.0 that 2.2.2 lacks, so that none that is added is forgotten."""
    source = Path(older_mjcf.__file__).read_text()
    handled = {*re.findall(r"\w+", source), *OTHER_ARRAYS.split()}
    env = mjenv.make("Hopper-v5", engine="2.2.2")
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    arrays = {name for name in dir(model) if isinstance(getattr(model, name), np.ndarray)}
    lacking = arrays - {*dir(env.model)} - handled
    assert not {name for name in lacking if not COMPUTED.match(name)}
    env.close()


def test_for_people(numbers: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = numbers.with_name("out.xml")
    assert main(["convert", str(numbers), "--out", str(out), "--check"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{out}: for the engine 2.2.2"
    assert lines[1] == f"  {EQUALITIES[0]}"
    assert [line.split()[0] for line in lines[-4:]] == ["steps", "1", "10", "100"]


FLEX = '<flexcomp name="cloth" type="grid" count="3 3 1" spacing=".1 .1 .1" mass="1" radius="0.01" dim="2"/>'
REFUSED = {
    f"<worldbody>{FLEX}</worldbody>": "it has flexes (1)",
    '<worldbody><body><joint name="j"/><geom size="1"/></body></worldbody>'
    '<actuator><dcmotor joint="j" motorconst="1" resistance="1"/></actuator>': "dcmotor",
    "<worldbody><unknown/></worldbody>": "unknown",
    '<worldbody><body><joint name="j"/><geom size="1"/></body></worldbody>'
    '<actuator><position joint="j" delay="0.1" nsample="3"/></actuator>': "actuators with delays",
    '<asset><hfield name="h" nrow="2" ncol="2" elevation="0 1 2 3" size="1 1 1 1"/></asset>': "reads height fields",
    '<custom><numeric name="n" data="1 nan"/></custom>': "attribute 'data' is not a number",
    '<asset><mesh name="m" file="../model.obj"/></asset>': "outside",
}


@pytest.mark.parametrize("part", REFUSED)
def test_refusals(part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What the output had before stays, and nothing else is left in its folder."""
    (tmp_path / "in").mkdir()
    (tmp_path / "in/model.xml").write_text(f"<mujoco>{part}</mujoco>")
    (tmp_path / "model.obj").write_text(WHEEL)
    (tmp_path / "out.xml").write_text("before")
    assert main(["convert", str(tmp_path / "in/model.xml"), "--out", str(tmp_path / "out.xml")]) == 2
    assert REFUSED[part] in capsys.readouterr().err
    assert (tmp_path / "out.xml").read_text() == "before"
    assert {one.name for one in tmp_path.iterdir()} == {"in", "model.obj", "out.xml"}


def test_trusted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Only a trusted model may refer to files outside of its folder."""
    (tmp_path / "in").mkdir()
    (tmp_path / "wheel.obj").write_text(WHEEL)
    (tmp_path / "in/model.xml").write_text(
        '<mujoco><asset><mesh name="m" file="../wheel.obj"/></asset>'
        '<worldbody><body><joint/><geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
    )
    convert(capsys, tmp_path / "in/model.xml", tmp_path / "out.xml", "--trust-xml", "yes")
    assert 'file="wheel.obj"' in (tmp_path / "out.xml").read_text()


def test_files(numbers: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = numbers.read_text()
    assert main(["convert", str(numbers), "--out", str(numbers)]) == 2
    assert "write the converted model to another file" in capsys.readouterr().err
    assert numbers.read_text() == text
    assert main(["convert", str(numbers), "--out", str(numbers.parent)]) == 2
    assert "no file" in capsys.readouterr().err
    assert main(["convert", str(numbers.with_name("missing.xml")), "--out", str(numbers)]) == 2
    assert "missing.xml" in capsys.readouterr().err
    assert main(["convert", str(numbers), "--out", str(numbers.with_name("none") / "out.xml")]) == 2
    assert "out.xml" in capsys.readouterr().err
