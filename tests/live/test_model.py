"""Model-v0 against plain MuJoCo: every row as an mjData of its own, bit for bit."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import mjenv
from mjenv.verify import check_same

# Tendons, a stateful actuator, sensors, a mocap body, a free joint and contacts.
MIXED = """
<mujoco>
  <option timestep="0.004" integrator="RK4"/>
  <worldbody>
    <geom type="plane" size="2 2 0.1"/>
    <body name="goal" mocap="true" pos="0.5 0 1"><geom size="0.02" contype="0" conaffinity="0"/></body>
    <body name="box" pos="0 0 0.4"><freejoint/><geom type="box" size="0.1 0.15 0.2"/></body>
    <body name="upper" pos="1 0 1">
      <joint name="shoulder" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.04"/>
      <body pos="0.4 0 0">
        <joint name="elbow" axis="0 1 0" range="-90 90" limited="true"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03"/><site name="hand" pos="0.3 0 0"/>
      </body>
    </body>
  </worldbody>
  <tendon><fixed name="arm"><joint joint="shoulder" coef="1"/><joint joint="elbow" coef="-0.5"/></fixed></tendon>
  <actuator>
    <motor name="lift" joint="shoulder" gear="5"/>
    <general tendon="arm" dyntype="filter" dynprm="0.1" gainprm="3"/>
  </actuator>
  <sensor><framepos objtype="site" objname="hand"/><actuatorfrc actuator="lift"/></sensor>
</mujoco>
"""
ARRAYS = ("qpos", "qvel", "act", "qacc", "qacc_warmstart", "xpos", "xquat", "site_xpos", "sensordata", "actuator_force")
ROWS = 3


def models() -> dict[str, tuple[dict[str, Any], str]]:
    """The options of Model-v0 and the text of the same model for MuJoCo."""
    found: dict[str, tuple[dict[str, Any], str]] = {"mixed": ({"xml_string": MIXED}, MIXED)}
    for name in ("hopper.xml", "humanoid.xml", "pusher.xml"):
        found[name] = ({"xml_file": name}, mjenv.model_xml(f"{name.removesuffix('.xml').capitalize()}-v5"))
    return found


MODELS = models()


@pytest.mark.parametrize("frame_skip", [1, 5])
@pytest.mark.parametrize("name", MODELS)
def test_equals_mj_step(name: str, frame_skip: int) -> None:
    options, xml = MODELS[name]
    model = mujoco.MjModel.from_xml_string(xml)
    plain = [mujoco.MjData(model) for _ in range(ROWS)]
    for data in plain:
        mujoco.mj_forward(model, data)
    arrays = [array for array in ARRAYS if getattr(plain[0], array).size]
    skip = {} if frame_skip == 1 else {"frame_skip": frame_skip}
    envs = mjenv.make_vec("Model-v0", ROWS, num_threads=2, arrays=" ".join(arrays), **skip, **options)
    assert envs.single_observation_space.shape == (model.nq + model.nv,)
    assert envs.single_action_space.shape == (model.nu,)
    observed, _ = envs.reset(seed=4)
    assert observed.tobytes() == np.array([[*data.qpos, *data.qvel] for data in plain]).tobytes()

    rng = np.random.default_rng(8)
    for step in range(150):
        actions = rng.uniform(-1, 1, (ROWS, model.nu))
        observed, rewards, terminated, truncated, infos = envs.step(actions)
        for row, data in enumerate(plain):
            data.ctrl[:] = actions[row]
            for _ in range(frame_skip):
                mujoco.mj_step(model, data)
            assert observed[row].tobytes() == np.concatenate([data.qpos, data.qvel]).tobytes(), (step, row)
            for array in arrays:
                assert envs.arrays[array][row].tobytes() == getattr(data, array).tobytes(), (step, row, array)
        assert not rewards.any()
        assert not terminated.any()
        assert not truncated.any()
        assert infos == {}


def test_a_file(tmp_path: Path) -> None:
    path = tmp_path / "mixed.xml"
    path.write_text(MIXED)
    env = mjenv.make("Model-v0", xml_file=path)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    env.reset()
    for _ in range(50):
        data.ctrl[:] = 0.3
        mujoco.mj_step(model, data)
        assert env.step(np.full(2, 0.3))[0].tobytes() == np.concatenate([data.qpos, data.qvel]).tobytes()


# mj_kinematics of MuJoCo 2.2.2 normalizes mocap_quat in place, again and again: its last bits depend on how often.
MOCAP = """
<mujoco>
  <option timestep="0.01"/>
  <worldbody>
    <geom type="plane" size="2 2 0.1"/>
    <body name="hand" mocap="true" pos="0 0 0.3" quat="1 0.3 0.2 0.1"><geom type="box" size="0.3 0.3 0.02"/></body>
    <body name="ball" pos="0.01 0 0.5"><joint type="slide" axis="0 0 1"/><geom size="0.05"/></body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize("threads", [1, 2])
def test_mocap_bodies(threads: int) -> None:
    """Poses of mocap bodies that are written, and that MuJoCo changes: each row as an mjData of its own."""
    model = mujoco.MjModel.from_xml_string(MOCAP)
    models = [mujoco.MjModel.from_xml_string(MOCAP) for _ in range(ROWS)]
    plain = [mujoco.MjData(model) for model in models]
    envs = mjenv.make_vec("Model-v0", ROWS, num_threads=threads, xml_string=MOCAP)
    rng = np.random.default_rng(3)

    def write(row: int, name: str, values: np.ndarray) -> None:
        getattr(plain[row], name)[:] = values
        getattr(envs.envs[row].data, name)[:] = values

    def check(what: str) -> None:
        for row, data in enumerate(plain):
            for name in ("qpos", "qvel", "mocap_pos", "mocap_quat", "xpos", "xquat", "geom_xpos"):
                ours = np.asarray(getattr(envs.envs[row].data, name))
                assert ours.tobytes() == getattr(data, name).tobytes(), (what, row, name)

    for episode in range(3):
        envs.reset(seed=episode)
        for model, data in zip(models, plain, strict=True):
            mujoco.mj_resetData(model, data)
            mujoco.mj_forward(model, data)
        check(f"reset {episode}")
        for step in range(60):
            what = f"episode {episode}, step {step}"
            row = int(rng.integers(ROWS))
            kind = rng.integers(6)
            if kind == 0:
                write(row, "mocap_quat", rng.normal(size=(1, 4)))
            elif kind == 1:
                write(row, "mocap_pos", np.array([[0, 0, rng.uniform(0.2, 0.4)]]))
            elif kind == 2:
                qpos, qvel = rng.uniform(-0.1, 0.1, (2, 1))
                plain[row].qpos[:], plain[row].qvel[:] = qpos, qvel
                mujoco.mj_forward(models[row], plain[row])
                envs.envs[row].set_state(qpos, qvel)
            elif kind == 3:
                mujoco.mj_setConst(models[row], plain[row])
                envs.envs[row].set_constants()
                if rng.random() < 0.7:
                    write(row, "mocap_pos", np.array([[0, 0, rng.uniform(0.2, 0.4)]]))
                    write(row, "mocap_quat", rng.normal(size=(1, 4)))
            if rng.random() < 0.3:
                check(f"{what} after {kind}")
            envs.step(np.zeros((ROWS, 0)))
            for model, data in zip(models, plain, strict=True):
                mujoco.mj_step(model, data)
            check(what)


# All that mj_setConst computes, from masses and positions of all kinds of bodies, and assets, which it leaves alone.
CONSTANTS = """
<mujoco>
  <size nuserdata="3"/>
  <asset>
    <mesh name="tetrahedron" vertex="0 0 0  0.2 0 0  0 0.2 0  0 0 0.2"/>
    <hfield name="hills" nrow="3" ncol="4" size="2 2 0.1 0.1"/>
    <texture type="skybox" builtin="gradient" rgb1="1 0 0" rgb2="0 0 1" width="64" height="64"/>
  </asset>
  <worldbody>
    <light name="lamp" pos="0 0 3" mode="targetbody" target="box"/>
    <camera name="eye" pos="0 -3 1" mode="targetbody" target="upper"/>
    <geom type="hfield" hfield="hills" pos="3 3 0"/>
    <body name="goal" mocap="true" pos="0.5 0 1"><geom size="0.02"/><site name="above"/></body>
    <body name="box" pos="0 0 0.4">
      <freejoint/><geom type="box" size="0.1 0.15 0.2"/><site name="side" pos="0.1 0 0"/>
    </body>
    <body name="stone" pos="0 2 0.4"><joint type="ball"/><geom type="mesh" mesh="tetrahedron"/></body>
    <body name="upper" pos="1 0 1">
      <joint name="shoulder" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.04"/>
      <geom name="pulley" size="0.06"/><camera name="track" mode="trackcom"/><light mode="track"/>
      <body name="lower" pos="0.4 0 0">
        <joint name="elbow" axis="0 1 0" ref="20"/><joint name="slide" type="slide" springref="0.3" stiffness="2"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03"/><site name="hand" pos="0.3 0 0"/>
      </body>
    </body>
  </worldbody>
  <equality>
    <connect body1="box" body2="stone" anchor="0.1 0.2 0.3"/><weld body1="lower" body2="goal"/>
    <joint joint1="shoulder" joint2="elbow"/>
  </equality>
  <tendon>
    <fixed name="both"><joint joint="shoulder" coef="1"/><joint joint="elbow" coef="-0.5"/></fixed>
    <spatial name="rope" stiffness="3"><site site="above"/><geom geom="pulley"/><site site="hand"/></spatial>
  </tendon>
  <actuator>
    <motor joint="shoulder" gear="5"/><position tendon="rope" kp="3"/><motor site="side" gear="1 2 3 0 1 0"/>
    <motor tendon="both"/>
  </actuator>
</mujoco>
"""


# An object with a name, and others, of each kind.
NAMED = """
<mujoco>
  <asset>
    <texture name="grid" type="2d" builtin="checker" rgb1="0.9 0.3 0.2" rgb2="0.2 0.3 0.9" width="8" height="4"/>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="1 0 0" rgb2="0 0 1" width="8" height="8"/>
    <material name="red" rgba="1 0 0 1"/><material name="tiles" texture="grid" texrepeat="2 3" shininess="0.3"/>
    <mesh name="left" vertex="0 0 0  0.2 0 0  0 0.2 0  0 0 0.2"/>
    <mesh name="right" vertex="0 0 0  0.1 0 0  0 0.2 0  0 0 0.3  0.1 0.1 0.1"/>
    <hfield name="flat" nrow="2" ncol="3" size="1 1 1 1"/><hfield name="hills" nrow="3" ncol="4" size="2 2 0.1 0.1"/>
    <skin name="cloth" material="tiles" vertex="-1 1 1  1 1 1  1 1 2  -1 1 2" texcoord="0 0 1 0 1 1 0 1"
          face="0 1 2 0 2 3">
      <bone body="one" bindpos="0 0 1" bindquat="1 0 0 0" vertid="0 1 2 3" vertweight="1 1 1 1"/>
    </skin>
  </asset>
  <worldbody>
    <geom name="wall" type="mesh" mesh="left" material="tiles" pos="0 4 0"/><geom type="mesh" mesh="right" pos="0 5 0"/>
    <body name="goal" mocap="true" pos="0.5 0 1"><geom size="0.02"/></body>
    <body name="one" pos="0 0 1"><joint name="a" type="slide"/><geom name="ball" size="0.1"/></body>
    <body name="two" pos="1 0 1"><joint name="b"/><geom name="stone" size="0.1"/></body>
    <body name="three" pos="2 0 1"><joint name="c"/><geom name="rock" size="0.1"/></body>
  </worldbody>
  <contact>
    <pair name="near" geom1="ball" geom2="stone" margin="0.1"/><pair geom1="rock" geom2="stone" friction="1 2 3 4 5"/>
    <exclude name="never" body1="one" body2="two"/>
  </contact>
  <equality>
    <joint name="gear" joint1="a" joint2="b" polycoef="0 2 0 0 0"/><weld name="glue" body1="three" body2="goal"/>
  </equality>
  <tendon>
    <fixed name="sum"><joint joint="a" coef="1"/><joint joint="b" coef="2"/></fixed>
    <fixed><joint joint="c" coef="3"/></fixed>
  </tendon>
  <actuator><motor name="m" joint="a"/><position joint="b" kp="2"/></actuator>
  <custom>
    <numeric name="gains" data="1 2 3"/><numeric name="one" data="4"/><text name="note" data="hello"/>
    <tuple name="both">
      <element objtype="body" objname="one" prm="2"/><element objtype="geom" objname="rock" prm="0.5"/>
    </tuple>
  </custom>
  <keyframe>
    <key name="home" qpos="0.1 0.2 0.3" qvel="4 5 6" ctrl="0.5 0.25" time="5"/>
    <key name="away" qpos="1 2 3" mpos="1 2 3"/>
  </keyframe>
</mujoco>
"""
SIZES = {"hfield": "nhfield", "texture": "ntex", "material": "nmat", "equality": "neq", "key": "nkey"}


@pytest.mark.parametrize(
    "kind",
    "tendon mesh skin hfield texture material pair exclude equality numeric tuple key tex mat eq keyframe".split(),
)
def test_assets_and_other_objects(kind: str) -> None:
    """model.key("home").qpos and so on, as in MuJoCo's bindings, of one row and of all."""
    model, ours = mujoco.MjModel.from_xml_string(NAMED), mjenv.make("Model-v0", xml_string=NAMED).model
    mine, theirs = getattr(ours, kind), getattr(model, kind)
    of_all = getattr(mjenv.make_vec("Model-v0", ROWS, xml_string=NAMED).model, kind)
    full = {"tex": "texture", "mat": "material", "eq": "equality", "keyframe": "key"}.get(kind, kind)
    for index in range(getattr(model, SIZES.get(full, f"n{full}"))):
        names = {name for name in dir(theirs(index)) if not name.startswith("_")}
        assert names <= set(dir(mine(index)))
        for name in names - {"id", "name"}:
            value = np.asarray(getattr(theirs(index), name))
            if name == "rgb":  # of which the bindings for 2.2.2 miss two thirds
                first, shape = int(theirs(index).adr[0]), (*value.shape, 3)
                value = model.tex_rgb.ravel()[first : first + 3 * value.size].reshape(shape)
            check_same(name, np.asarray(getattr(mine(index), name)), value)
            check_same(name, np.asarray(getattr(of_all(index), name)), np.stack([value] * ROWS))
        named = mujoco.mj_id2name(model, getattr(mujoco.mjtObj, f"mjOBJ_{full.upper()}"), index) or ""
        assert mine(index).name == named
        assert not named or mine(named).id == index


@pytest.mark.parametrize("kind", "body joint geom site camera light actuator tendon".split())
def test_objects_of_data(kind: str) -> None:
    """data.body("box").xpos and so on, as in MuJoCo's bindings, of one row and of all."""
    model = mujoco.MjModel.from_xml_string(CONSTANTS)
    data, ours = mujoco.MjData(model), mjenv.make_vec("Model-v0", ROWS, xml_string=CONSTANTS)
    ours.reset(seed=0)
    mujoco.mj_forward(model, data)
    data.ctrl[:] = 0.3
    for _ in range(20):
        mujoco.mj_step(model, data)
        ours.step(np.full((ROWS, model.nu), 0.3))
    mujoco.mj_rnePostConstraint(model, data)
    # A joint has no part of these: plastic is of flexes, and the rows of efc_JT are as long as there are constraints.
    left_out = {"plastic", *(name for name in dir(data.joint(0)) if name.startswith("efc_JT"))}
    compared = 0
    for index in range(
        {"actuator": model.nu, "joint": model.njnt, "camera": model.ncam}.get(kind) or getattr(model, f"n{kind}")
    ):
        theirs, one, of_all = (getattr(of, kind)(index) for of in (data, ours.envs[1].data, ours.data))
        for name in {name for name in dir(theirs) if not name.startswith("_")} - left_out - {"id", "name"}:
            value = np.asarray(getattr(theirs, name))
            if name.startswith("cdof"):  # which the bindings for 2.2.2 read elsewhere
                value = getattr(data, name)[model.jnt_dofadr[index] :][: len(value)]
            check_same(name, np.asarray(getattr(one, name)), value)
            check_same(name, np.asarray(getattr(of_all, name)), np.stack([value] * ROWS))
            compared += value.size
    assert compared > 5


def test_drawn_constants() -> None:
    """Resets that call mj_setConst compute what MuJoCo computes with a new mjData."""
    names = ("body_mass", "body_inertia", "body_pos", "body_ipos", "qpos0", "dof_armature", "site_pos", "cam_pos")
    names += ("geom_size", "geom_pos", "geom_margin")
    draws = {name: mjenv.Scale(0.7, 1.3, set_constants=name == "body_mass") for name in names}
    draws["geom_margin"] = mjenv.Offset(0, 0.01)
    envs = mjenv.make_vec("Model-v0", ROWS, xml_string=CONSTANTS, num_threads=2, randomize=draws)
    model = mujoco.MjModel.from_xml_string(CONSTANTS)
    arrays = [name for name in dir(model) if isinstance(getattr(model, name), np.ndarray) and hasattr(envs.model, name)]
    assert {"body_invweight0", "dof_M0", "tendon_lengthspring", "eq_data", "cam_pos0", "mesh_vert"} <= set(arrays)
    for seed in range(8):
        envs.reset(seed=seed)
        for row in range(ROWS):
            own = envs.envs[row].model
            expected = mujoco.MjModel.from_xml_string(CONSTANTS)
            for name in names:
                getattr(expected, name)[...] = np.asarray(getattr(own, name)).reshape(getattr(expected, name).shape)
            mujoco.mj_setConst(expected, mujoco.MjData(expected))
            for name in arrays:
                ours = np.asarray(getattr(own, name))
                assert ours.tobytes() == getattr(expected, name).astype(ours.dtype).tobytes(), (seed, row, name)
            for name in ("meaninertia", "meanmass", "meansize", "extent"):
                assert getattr(own.stat, name) == getattr(expected.stat, name), (seed, row, name)


# What mj_setConst of MuJoCo 4.0 reads besides: flexes, and what the flags of a model count.
FLEXES = """
<flexcomp name="cloth" type="grid" count="3 3 1" spacing="0.1 0.1 0.1" pos="0 0 3" radius="0.01" mass="0.1">
  <edge equality="true"/>
</flexcomp>
<body name="post" pos="-2 0 1" gravcomp="0.5"><geom size="0.1"/></body>
"""
# Integers that can be written, and what is written.
INTEGERS = {"geom_contype": 3, "geom_conaffinity": 3, "jnt_limited": 1, "tendon_limited": 1, "actuator_ctrllimited": 1}


def contents(model: Any) -> dict[str, np.ndarray]:
    """All arrays, sizes, flags and statistics of MuJoCo's model, except stat.center, which the package for 2.2.2
    misreads."""
    found = {name: getattr(model, name) for name in dir(model) if not name.startswith("_")}
    found |= {f"stat.{name}": getattr(model.stat, name) for name in ("extent", "meaninertia", "meanmass", "meansize")}
    return {name: np.array(value) for name, value in found.items() if isinstance(value, np.ndarray | float | int)}


def of_row(model: Any, name: str) -> np.ndarray | None:
    owner, member = (model.stat, name.removeprefix("stat.")) if name.startswith("stat.") else (model, name)
    return np.asarray(getattr(owner, member)) if hasattr(owner, member) else None


def test_set_constants_after_each_write() -> None:
    """mjenv has all that MuJoCo has in its model after mj_setConst, whatever was written before."""
    texts = [CONSTANTS]
    if mujoco.__version__ >= "3":
        # Constraints of flexes have indices in eq_data, so rows share it, and mj_setConst must not change it.
        anchored = re.compile("<connect.*<weld[^>]*>")
        texts.append(anchored.sub("", CONSTANTS).replace("<worldbody>", f"<worldbody>{FLEXES}"))
    written, changed = set(), set()
    for text in texts:
        for name, old in contents(mujoco.MjModel.from_xml_string(text)).items():
            theirs = mujoco.MjModel.from_xml_string(text)
            env = mjenv.make("Model-v0", xml_string=text)
            if "." in name or not old.size or (old.dtype.kind != "f" and name not in INTEGERS):
                continue
            rng = np.random.default_rng(len(written))
            new = np.full(old.shape, INTEGERS.get(name)) if name in INTEGERS else old * rng.uniform(0.5, 2, old.shape)
            if name in ("geom_margin", "geom_gap", "body_gravcomp", "geom_surfacevel", "geom_adhesion"):
                new = new + rng.uniform(0, 0.1, old.shape)
            try:
                getattr(env.model, name)[...] = new.reshape(np.shape(getattr(env.model, name)))
            except (KeyError, ValueError):  # it cannot be written
                continue
            written.add(name)
            env.reset(seed=0)  # as a new mjData, whose mocap bodies are where the model has them
            getattr(theirs, name)[...] = new
            before = contents(theirs)
            try:
                mujoco.mj_setConst(theirs, mujoco.MjData(theirs))
            except mujoco.FatalError as error:
                with pytest.raises(mjenv.PhysicsError, match=re.escape(str(error).split(":")[-1].strip()[:20])):
                    env.set_constants()
                continue
            env.set_constants()
            for array, value in contents(theirs).items():
                ours = of_row(env.model, array)
                is_same = value.tobytes() == before[array].tobytes()
                changed |= set() if is_same else {array}
                assert is_same if ours is None else ours.astype(value.dtype).tobytes() == value.tobytes(), (name, array)
    assert {"body_mass", "body_ipos", "geom_size", "geom_contype", "site_pos", "qpos0", "qpos_spring"} <= written
    assert {"body_subtreemass", "dof_M0", "actuator_acc0", "eq_data", "cam_pos0"} <= changed
    if len(texts) > 1:
        assert {
            "bvh_aabb",
            "body_margin",
            "body_contype",
            "flexedge_invweight0",
            "flg_gravcomp",
            "ngravcomp",
        } <= changed


# A ball beside a geom that is grown or moved so that they touch.
BALL = """
<mujoco>
  <worldbody>
    <geom type="plane" size="3 3 0.1"/>
    {}
    <body pos="0.15 0 0.7"><freejoint/><geom name="ball" size="0.03"/></body>
  </worldbody>
</mujoco>
"""
BOX = '<geom name="box" type="box" size="0.02 0.02 0.02"/>'
PAIR = f'<body pos="0 0 0.5"><joint type="slide" damping="100"/>{BOX}<geom size="0.02" pos="-0.5 0 0"/></body>'
GROWN: dict[str, tuple[str, str, float | tuple[float, ...]]] = {
    "of the world": (BALL.format(BOX.replace("/>", ' pos="0 0 0.5"/>')), "geom_size", 0.24),
    "one geom": (BALL.format(f'<body pos="0 0 0.5">{BOX}</body>'), "geom_size", 0.24),
    "two geoms": (BALL.format(PAIR), "geom_size", 0.24),
    "moved": (BALL.format(PAIR), "geom_pos", (0.15, 0, 0)),
    "inertia": (BALL.format(PAIR.replace("0.02 0.02 0.02", "0.2 0.2 0.02")), "body_ipos", (3, 0, 0)),
    "humanoidstandup.xml": (mjenv.model_xml("HumanoidStandup-v5"), "body_ipos", (0.3, 0.3, 0.3)),
}


@pytest.mark.parametrize("is_constant", [False, True])
@pytest.mark.parametrize("name", GROWN)
def test_contacts_after_a_write(name: str, is_constant: bool) -> None:
    """MuJoCo's search for contacts sees what was written, or what mj_setConst has computed from it."""
    text, array, value = GROWN[name]
    model = mujoco.MjModel.from_xml_string(text)
    getattr(model, array)[1] = value
    data = mujoco.MjData(model)
    env = mjenv.make("Model-v0", **({"xml_file": name} if name.endswith(".xml") else {"xml_string": text}))
    getattr(env.model, array)[1] = value
    if is_constant:
        mujoco.mj_setConst(model, data)
        mujoco.mj_resetData(model, data)
        env.set_constants()
    env.reset(seed=0)
    mujoco.mj_forward(model, data)
    for step in range(400):
        mujoco.mj_step(model, data)
        observed = env.step(np.zeros(model.nu))[0]
        assert observed.tobytes() == np.concatenate([data.qpos, data.qvel]).tobytes(), step
        if step % 50 == 0:  # MuJoCo 2.2.2 keeps old forces behind those of the present constraints
            forces = env.data.efc_force
            assert forces.shape == data.efc_force.shape
            assert forces[: data.nefc].tobytes() == data.efc_force[: data.nefc].tobytes(), step


def test_forces_of_all_rows() -> None:
    envs = mjenv.make_vec("Ant-v5", 2)
    envs.reset(seed=1)
    for _ in range(40):
        envs.step(np.zeros((2, 8)))
    for forces, row in zip(envs.data.efc_force, envs.envs, strict=True):
        assert row.data.nefc > 0
        assert forces[: row.data.nefc].tobytes() == row.data.efc_force[: row.data.nefc].tobytes()


@pytest.mark.parametrize("array", ["geom_size", "geom_margin", "geom_gap", "geom_pos", "geom_contype", "body_gravcomp"])
def test_draws_of_geoms_with_constants(array: str) -> None:
    """After each reset, a row steps as MuJoCo does with the drawn values and what mj_setConst computes from them."""
    text = BALL.format(PAIR)
    if not hasattr(mujoco.MjModel.from_xml_string(text), array):
        pytest.skip("MuJoCo 2.2.2 has no such array")
    draw: Any = mjenv.Offset(0, 0.1, set_constants=True)
    if array == "geom_contype":
        draw = mjenv.Value(choices=(1, 2, 3), set_constants=True)
    env = mjenv.make("Model-v0", xml_string=text, randomize={array: draw})
    for seed in range(4):
        env.reset(seed=seed)
        model = mujoco.MjModel.from_xml_string(text)
        getattr(model, array)[...] = np.reshape(getattr(env.model, array), getattr(model, array).shape)
        mujoco.mj_setConst(model, mujoco.MjData(model))
        data = mujoco.MjData(model)
        data.qacc_warmstart[:] = env.data.qacc_warmstart
        for step in range(300):
            mujoco.mj_step(model, data)
            observed = env.step(np.zeros(0))[0]
            assert observed.tobytes() == np.concatenate([data.qpos, data.qvel]).tobytes(), (seed, step)
