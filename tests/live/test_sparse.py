"""Model-v0 against MuJoCo's own wheel where Jacobians are sparse, and where sums are -0: bit for bit.

The wheel for x86-64 adds with AVX. There, sums of four or more products have another order than in MuJoCo's code for
other CPUs, and can be -0.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

import mjenv

if mujoco.__version__ != "2.2.2":
    pytest.skip("MuJoCo 4.0 is the wheel's own library", allow_module_level=True)

ROWS = 5
LEGS = 12
SMOOTH = (
    "qpos qvel qacc qacc_warmstart qfrc_bias qfrc_passive qfrc_actuator qfrc_constraint qM qLD "
    "ten_length ten_velocity actuator_velocity xpos xquat"
).split()
CONSTRAINTS = "pos margin D R vel aref b force state type frictionloss".split()


def leg(number: int, extra: bool) -> str:
    """A leg of six hinges with limits, whose foot touches the floor."""
    foot = ("sphere", "capsule", "box")[number % 3]
    condim = (1, 3, 4, 6)[number % 4] if extra else 3
    text = f'<geom type="{foot}" size="0.04 0.05 0.06" condim="{condim}"/><site name="foot{number}"/>'
    for joint in reversed(range(6)):
        loss = ' frictionloss="0.02"' if extra and joint == 2 else ""
        text = (
            f'<body name="b{number}_{joint}" pos="0.16 0 0">'
            f'<joint name="j{number}_{joint}" axis="{("0 1 0", "0 0 1", "1 0 0")[joint % 3]}" range="-20 20"{loss}/>'
            f'<geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.03"/>{text}</body>'
        )
    return f'<body euler="0 0 {360 / LEGS * number}" pos="0 0 0.1"><body pos="0.3 0 0">{text}</body></body>'


EXTRA = """
<equality>
  <connect body1="b0_5" body2="b1_5" anchor="0 0 0"/>
  <weld body1="b2_5" body2="b3_5"/>
  <joint joint1="j4_0" joint2="j5_0" polycoef="0.01 1 0.1 0 0"/>
  <joint joint1="j4_3"/>
  <tendon tendon1="sum" tendon2="rope"/>
</equality>
<tendon>
  <fixed name="sum" limited="true" range="-0.1 0.1">
    <joint joint="j6_0" coef="1"/><joint joint="j7_1" coef="-0.7"/>
  </fixed>
  <fixed name="rough" frictionloss="0.03"><joint joint="j8_0" coef="1"/><joint joint="j9_2" coef="0.3"/></fixed>
  <spatial name="rope" frictionloss="0.01"><site site="foot8"/><site site="foot9"/></spatial>
  <spatial name="leash" limited="true" range="0 0.5"><site site="foot10"/><site site="foot11"/></spatial>
</tendon>
"""


def legs(options: str, extra: bool) -> str:
    """72 degrees of freedom, for which MuJoCo chooses sparse Jacobians; `extra`: with each type of constraint."""
    motors = "".join(f'<motor joint="j{n}_{j}" gear="1.5"/>' for n in range(LEGS) for j in range(0, 6, 2))
    return f"""
<mujoco>
  <compiler autolimits="true"/>
  <option timestep="0.004" {options}/>
  <size njmax="2000" nconmax="400"/>
  <default><joint damping="0.05" armature="0.01"/></default>
  <worldbody><geom type="plane" size="5 5 0.1" condim="1"/>{"".join(leg(n, extra) for n in range(LEGS))}</worldbody>
  {EXTRA if extra else ""}
  <actuator>{motors}</actuator>
</mujoco>
"""


def compare(what: str, ours: Any, data: mujoco.MjData) -> None:
    """The simulation of a row and MuJoCo's."""
    for name in SMOOTH:
        expected = getattr(data, name)
        assert np.asarray(getattr(ours, name)).tobytes() == expected.tobytes(), (what, name)
    assert int(ours.nefc) == data.nefc, what
    for name in (f"efc_{name}" for name in CONSTRAINTS):
        expected = getattr(data, name).ravel()[: data.nefc]
        assert np.asarray(getattr(ours, name)).ravel()[: data.nefc].tobytes() == expected.tobytes(), (what, name)
    if data.nefc:
        row = data.nefc - 1
        used = data.efc_J_rowadr[row] + data.efc_J_rownnz[row]
        for name in ("efc_J", "efc_J_colind"):
            expected = getattr(data, name).ravel()[:used]
            assert np.asarray(getattr(ours, name)).ravel()[:used].tobytes() == expected.tobytes(), (what, name)


def vector(xml: str, lanes: int) -> mjenv.VectorEnv:
    """Rows that are stepped in so many lanes if these can compute the model, which the option would demand."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MJENV_LANES", str(lanes))
        return mjenv.make_vec("Model-v0", ROWS, engine="2.2.2", xml_string=xml, num_threads=1)


def play(xml: str, lanes: int, steps: int) -> tuple[list[mujoco.MjData], set[int]]:
    """Rows with random actions beside an mjData each. Returns these, and the types of constraints that there were."""
    model = mujoco.MjModel.from_xml_string(xml)
    plain = [mujoco.MjData(model) for _ in range(ROWS)]
    for data in plain:
        mujoco.mj_forward(model, data)
    envs = vector(xml, lanes)
    envs.reset(seed=1)
    rng = np.random.default_rng(2)
    types: set[int] = set()
    for step in range(steps):
        actions = rng.uniform(-1, 1, (ROWS, model.nu))
        envs.step(actions)
        for row, data in enumerate(plain):
            data.ctrl[:] = actions[row]
            mujoco.mj_step(model, data)
            compare(f"step {step}, row {row}", envs.envs[row].data, data)
            types.update(data.efc_type.ravel()[: data.nefc].tolist())
    return plain, types


Type = mujoco.mjtConstraint


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
@pytest.mark.parametrize("solver", ["Newton", "PGS", "CG"])
def test_each_type_of_constraint(solver: str, cone: str) -> None:
    xml = legs(f'solver="{solver}" cone="{cone}" iterations="20"', extra=True)
    _, types = play(xml, lanes=0, steps=40)
    contacts = {Type.mjCNSTR_CONTACT_PYRAMIDAL if cone == "pyramidal" else Type.mjCNSTR_CONTACT_ELLIPTIC}
    others = {Type.mjCNSTR_EQUALITY, Type.mjCNSTR_FRICTION_DOF, Type.mjCNSTR_FRICTION_TENDON}
    others |= {Type.mjCNSTR_LIMIT_JOINT, Type.mjCNSTR_LIMIT_TENDON, Type.mjCNSTR_CONTACT_FRICTIONLESS}
    assert types == {int(kind) for kind in contacts | others}


@pytest.mark.parametrize("lanes", [0, 2, 4])
@pytest.mark.parametrize("solver", ["Newton", "PGS", "CG"])
def test_lanes(solver: str, lanes: int) -> None:
    """A model whose smooth dynamics lanes compute."""
    _, types = play(legs(f'solver="{solver}" iterations="20"', extra=False), lanes, steps=40)
    assert types == {int(Type.mjCNSTR_LIMIT_JOINT), int(Type.mjCNSTR_CONTACT_PYRAMIDAL)}


@pytest.mark.parametrize("id", "Ant HalfCheetah Hopper Humanoid Walker2d Swimmer Pusher".split())
def test_robots(id: str) -> None:
    """Gymnasium's robots, told to have sparse Jacobians."""
    xml = mjenv.model_xml(f"{id}-v5").replace("<worldbody>", '<option jacobian="sparse"/><worldbody>', 1)
    play(xml, lanes=2, steps=150)


@pytest.mark.parametrize("lanes", [0, 2])
@pytest.mark.parametrize("jacobian", ["dense", "sparse"])
@pytest.mark.parametrize("joints", [3, 4, 5, 8])
def test_negative_zeros(joints: int, jacobian: str, lanes: int) -> None:
    """Velocities of a tendon and of an actuator at rest, which are sums of products that are all -0 or 0."""
    bodies = "".join(
        f'<body pos="{n} 0 0"><joint name="j{n}" type="slide" axis="0 0 1" limited="true" '
        f'range="-1 {(n % 2 - 1) / 1000}"/><geom size="0.1"/></body>'
        for n in range(joints)
    )
    tendon = "".join(f'<joint joint="j{n}" coef="-1"/>' for n in range(joints))
    xml = f"""
<mujoco>
  <option gravity="0 0 0" jacobian="{jacobian}"><flag contact="disable"/></option>
  <worldbody>{bodies}</worldbody>
  <tendon><fixed name="all">{tendon}</fixed></tendon>
  <actuator><motor joint="j0" gear="-1"/><motor joint="j1" gear="-1"/></actuator>
</mujoco>
"""
    model = mujoco.MjModel.from_xml_string(xml)
    envs = vector(xml, lanes)
    envs.reset()
    plain = [mujoco.MjData(model) for _ in range(ROWS)]
    for row, data in enumerate(plain):
        mujoco.mj_forward(model, data)  # as the reset did
        data.qvel[row:] = -0.0 if row % 2 else 0.0
        data.qvel[0] = 0.0
        data.qvel[1:row] = -1.0 / 64
        envs.envs[row].set_state(data.qpos, data.qvel)
        mujoco.mj_forward(model, data)
        compare(f"row {row}", envs.envs[row].data, data)
    found = False
    for step in range(3):
        envs.step(np.zeros((ROWS, model.nu)))
        for row, data in enumerate(plain):
            mujoco.mj_step(model, data)
            compare(f"step {step}, row {row}", envs.envs[row].data, data)
            found |= data.ten_velocity[0] == 0 and bool(np.signbit(data.ten_velocity[0]))
    assert found == (joints >= 4)
