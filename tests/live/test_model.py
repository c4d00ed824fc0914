"""Model-v0 against plain MuJoCo: every row as an mjData of its own, bit for bit."""

from __future__ import annotations

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
    "kind", "mesh skin hfield texture material pair exclude equality numeric tuple key tex mat eq keyframe".split()
)
def test_assets_and_other_objects(kind: str) -> None:
    """model.key("home").qpos and so on, as in MuJoCo's bindings, which cannot read the pixels of a texture in 2.2.2."""
    model, ours = mujoco.MjModel.from_xml_string(NAMED), mjenv.make("Model-v0", xml_string=NAMED).model
    mine, theirs = getattr(ours, kind), getattr(model, kind)
    full = {"tex": "texture", "mat": "material", "eq": "equality", "keyframe": "key"}.get(kind, kind)
    for index in range(getattr(model, SIZES.get(full, f"n{full}"))):
        names = {name for name in dir(theirs(index)) if not name.startswith("_")}
        assert names - set(dir(mine(index))) <= ({"rgb", "data"} if full == "texture" else set())
        for name in names & set(dir(mine(index))) - {"id", "name"}:
            check_same(name, np.asarray(getattr(mine(index), name)), np.asarray(getattr(theirs(index), name)))
        named = mujoco.mj_id2name(model, getattr(mujoco.mjtObj, f"mjOBJ_{full.upper()}"), index) or ""
        assert mine(index).name == named
        assert not named or mine(named).id == index


def test_drawn_constants() -> None:
    """Resets that call mj_setConst compute what MuJoCo computes with a new mjData."""
    names = ("body_mass", "body_inertia", "body_pos", "body_ipos", "qpos0", "dof_armature", "site_pos", "cam_pos")
    draws = {name: mjenv.Scale(0.7, 1.3, set_constants=name == "body_mass") for name in names}
    envs = mjenv.make_vec("Model-v0", ROWS, xml_string=CONSTANTS, num_threads=2, randomize=draws)
    model = mujoco.MjModel.from_xml_string(CONSTANTS)
    arrays = [name for name in dir(model) if isinstance(getattr(model, name), np.ndarray) and hasattr(envs.model, name)]
    assert {"body_invweight0", "dof_M0", "tendon_lengthspring", "eq_data", "cam_pos0", "mesh_vert"} <= set(arrays)
    if envs.engine == "4.0":  # whose rows cannot have their own
        arrays = [name for name in arrays if name not in ("eq_data", "bvh_aabb")]
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
