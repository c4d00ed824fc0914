"""contact.force, the forces of a row's contacts: those of MuJoCo's mj_contactForce, every bit, on both engines."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import mjenv

ROWS, STEPS = 5, 60
# Contacts of each number of dimensions, and in the gap of a geom, where MuJoCo lists a contact without a force.
MODEL = """
<mujoco><option timestep="0.005" cone="{cone}" solver="{solver}"/><worldbody>
<geom type="plane" size="9 9 1" condim="1"/>
<body pos="0 0 .3"><freejoint/><geom size=".1" condim="1"/></body>
<body pos="1 0 .3"><freejoint/><geom type="box" size=".1 .2 .1" condim="3"/></body>
<body pos="2 0 .3"><freejoint/><geom type="capsule" size=".1 .2" condim="4" euler="0 80 0"/></body>
<body pos="3 0 .3"><freejoint/><geom type="ellipsoid" size=".1 .2 .1" condim="6"/></body>
<body pos="4 0 .3"><joint name="arm" type="hinge" axis="0 1 0"/><geom type="capsule" size=".1 .2" euler="0 90 0"/>
<geom pos=".4 0 -.1" size=".05" margin=".2" gap=".2"/></body></worldbody>
<actuator><motor joint="arm" gear="3"/></actuator></mujoco>"""


def forces_of(model: Any, data: Any) -> NDArray[np.float64]:
    found = np.zeros((data.ncon, 6))
    for number, force in enumerate(found):
        mujoco.mj_contactForce(model, data, number, force)
    return found


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
@pytest.mark.parametrize("solver", ["Newton", "PGS", "CG"])
def test_forces_are_those_of_mujoco(solver: str, cone: str) -> None:
    xml = MODEL.format(cone=cone, solver=solver)
    model = mujoco.MjModel.from_xml_string(xml)
    plain = [mujoco.MjData(model) for _ in range(ROWS)]
    envs = mjenv.make_vec("Model-v0", ROWS, xml_string=xml, arrays="contact.force ncon", num_threads=1)
    watched = mjenv.make_vec("Model-v0", ROWS, xml_string=xml, num_threads=1)  # whose arrays are only read
    for each in (envs, watched):
        each.reset(seed=0)
    rng = np.random.default_rng(1)
    dims: set[int] = set()
    unlike = pulls = 0
    for step in range(STEPS):
        actions = rng.uniform(-1, 1, (ROWS, 1))
        for each in (envs, watched):
            each.step(actions)
        for row, data in enumerate(plain):
            data.ctrl[:] = actions[row]
            mujoco.mj_step(model, data)
            expected = forces_of(model, data)
            exported = envs.arrays["contact.force"][row]
            assert exported[: data.ncon].tobytes() == expected.tobytes(), (step, row)
            assert not exported[data.ncon :].any()
            contacts = watched.envs[row].data.contact
            assert contacts.force.tobytes() == expected.tobytes(), (step, row)
            dims.update(np.asarray(contacts.dim)[expected.any(axis=1)].tolist())
            unlike += int((np.asarray(contacts.efc_address) < 0).sum())
            pulls += int((np.abs(expected[:, 1:3]) > 1e-6).sum())
            for number, force in enumerate(expected):
                assert contacts[number].force.tobytes() == force.tobytes()
    assert dims == {1, 3, 4, 6}
    assert unlike > 0
    assert pulls > 0


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_forces_of_a_row_with_its_own_cone(cone: str) -> None:
    """mj_contactForce reads the cone of the row's own model."""
    xml = MODEL.format(cone=cone, solver="Newton")
    model, env = mujoco.MjModel.from_xml_string(xml), mjenv.make("Model-v0", xml_string=xml)
    data = mujoco.MjData(model)
    model.opt.cone = env.unwrapped.model.opt.cone = 1 - model.opt.cone
    env.reset(seed=0)
    mujoco.mj_forward(model, data)
    seen = 0
    for _ in range(STEPS):
        env.step(np.ones(1))
        data.ctrl[:] = 1
        mujoco.mj_step(model, data)
        assert env.unwrapped.data.qpos.tobytes() == data.qpos.tobytes()
        assert env.unwrapped.data.contact.force.tobytes() == forces_of(model, data).tobytes()
        seen += data.ncon
    assert seen > 0


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
@pytest.mark.parametrize("solver", ["Newton", "PGS", "CG"])
@pytest.mark.parametrize("lanes", [0, 2])
def test_all_that_a_contact_has(solver: str, cone: str, lanes: int) -> None:
    """Each attribute of a contact in MuJoCo's bindings, except H, which only MuJoCo's solver reads."""
    xml = MODEL.format(cone=cone, solver=solver)
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    names = [name for name in dir(mujoco.MjContact) if not name.startswith("_") and name != "H"]
    arrays = [f"contact.{name}" for name in names if name != "geom"]
    options: dict[str, Any] = {"xml_string": xml, "lanes": lanes, "num_threads": 1}
    envs = mjenv.make_vec("Model-v0", ROWS, **options)
    exporting = mjenv.make_vec("Model-v0", ROWS, arrays=" ".join(arrays), **options)
    for each in (envs, exporting):
        each.reset(seed=0)
    mujoco.mj_forward(model, data)
    slides = 0
    for step in range(STEPS):
        for each in (envs, exporting):
            each.step(np.ones((ROWS, 1)))
        data.ctrl[:] = 1
        mujoco.mj_step(model, data)
        for row in (0, ROWS - 1) if step % 7 == 0 else ():
            contacts = envs.envs[row].data.contact
            assert len(contacts) == data.ncon
            for number, ours in enumerate(contacts):
                theirs = data.contact[number]
                for name in names:
                    value = np.asarray(getattr(theirs, name))
                    # With NumPy 2, the package for MuJoCo 2.2.2 gives arrays without strides.
                    value = np.lib.stride_tricks.as_strided(value, strides=(value.itemsize,) * value.ndim)
                    found = np.asarray(getattr(ours, name), value.dtype)
                    assert found.tobytes() == value.tobytes(), (step, row, number, name)
                    if name != "geom":
                        found = exporting.arrays[f"contact.{name}"][row, number].astype(value.dtype)
                        assert found.tobytes() == value.tobytes(), (step, row, number, name)
                slides += int(theirs.mu > 0)
                with pytest.raises(AttributeError, match="'H'"):
                    _ = ours.H
    assert slides > 0


def test_forces_after_set_state() -> None:
    """Those of mj_forward in the new state, and those of a step for rows whose arrays are computed again."""
    xml = MODEL.format(cone="pyramidal", solver="Newton")
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    envs = mjenv.make_vec("Model-v0", 2, xml_string=xml, num_threads=1)
    envs.reset(seed=0)
    for _ in range(80):
        envs.step(np.zeros((2, 1)))
        mujoco.mj_step(model, data)
    rows = envs.envs
    expected = forces_of(model, data)
    assert expected.any()
    assert [row.data.contact.force.tobytes() for row in rows] == [expected.tobytes()] * 2
    data.qpos[2] -= 0.001
    rows[0].set_state(data.qpos, data.qvel)
    mujoco.mj_forward(model, data)
    assert rows[0].data.contact.force.tobytes() == forces_of(model, data).tobytes()
    assert rows[1].data.contact.force.tobytes() == expected.tobytes()
