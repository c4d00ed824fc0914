"""What MuJoCo 4.0 carries from step to step belongs to a row, against MuJoCo's own mj_step, bit for bit.

Several rows share one mjData, start anew in the middle of others' episodes, and go on in another environment.
"""

from __future__ import annotations

import copy
from typing import Any

import mujoco
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import mjenv

ROWS, STEPS = 3, 120
ARM = """
<mujoco>
  <option timestep="0.004" integrator="{integrator}">{option}</option>
  <worldbody>
    <geom type="plane" size="5 5 1" friction="1 0.01 0.01"/>
    <body name="cart" pos="0 0 0.4">
      <joint name="x" type="slide" axis="1 0 0" {joint}/>
      <geom type="box" size="0.1 0.1 0.05" mass="1"/>
      <site name="top" pos="0 0 0.1"/>
      <body name="pole" pos="0 0 0.05">
        <joint name="y" type="hinge" axis="0 1 0" {joint}/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0.3" size="0.03" mass="0.3"/>
        <site name="tip" pos="0.3 0 0.3"/>
      </body>
    </body>
    <body pos="0.5 0 0.15"><freejoint/><geom size="0.1" mass="0.2"/></body>
    {world}
  </worldbody>
  <tendon>
    <fixed name="sum" {tendon}><joint joint="x" coef="1"/><joint joint="y" coef="-0.5"/></fixed>
  </tendon>
  <actuator>
    <motor joint="x" gear="20" ctrlrange="-1 1" {actuator}/>
    {actuators}
  </actuator>
  <sensor>
    <framepos objtype="site" objname="tip" {sensor}/>
    <actuatorfrc actuator="drive" {sensor}/>
    <accelerometer site="tip" {sensor}/>
    {sensors}
  </sensor>
</mujoco>
"""
SERVO = '<position name="drive" joint="y" kp="30" ctrlrange="-1 1" {}/>'
NONE = dict.fromkeys(("option", "joint", "world", "tendon", "actuator", "actuators", "sensor", "sensors"), "")
PLAIN = NONE | {"integrator": "implicitfast", "actuators": SERVO.format("")}


def flex(inside: str, attributes: str = 'dim="2" count="4 4 1"') -> str:
    return (
        f'<flexcomp name="f" type="grid" {attributes} spacing="0.1 0.1 0.1" radius="0.01" mass="0.3" pos="0 1 0.4">'
        f"{inside}</flexcomp>"
    )


ELASTIC = '<elasticity young="3e4" poisson="0.2" thickness="0.01" elastic2d="both" damping="0.001" {}/>'
MODELS: dict[str, dict[str, str]] = {
    "plain": {},
    "euler": {"integrator": "Euler"},
    "runge_kutta": {"integrator": "RK4"},
    "discrete": {"integrator": "discrete"},
    "control_delay": {
        "actuator": 'nsample="5" delay="0.02"',
        "actuators": SERVO.format('nsample="9" delay="0.03" interp="linear"'),
    },
    "control_history": {"actuator": 'nsample="4"'},
    "sensor_delay": {"sensor": 'nsample="6" delay="0.02"'},
    "sensor_delay_cubic": {"sensor": 'nsample="6" delay="0.017" interp="cubic"'},
    "sensor_interval": {"sensor": 'nsample="3" interval="0.011"'},
    "sensor_interval_phase": {"sensor": 'nsample="3" interval="0.02 -0.008"'},
    "sensor_interval_delay": {"sensor": 'nsample="4" interval="0.011" delay="0.02"'},
    "runge_kutta_delays": {"integrator": "RK4", "actuator": 'nsample="5" delay="0.02"', "sensor": 'nsample="2"'},
    "filter": {"actuators": '<general name="drive" joint="y" dyntype="filterexact" dynprm="0.05" gainprm="9"/>'},
    "pid": {"actuators": '<pid name="drive" joint="y" kp="20" ki="9" kv="1" imax="5" slewmax="3" ctrlrange="-1 1"/>'},
    "motor": {"actuators": '<dcmotor name="drive" joint="y" motorconst="0.5" resistance="1" ctrlrange="-9 9"/>'},
    "plastic_joints": {"joint": 'stiffness="40" springyield="1"', "integrator": "Euler"},
    "plastic_tendon": {"tendon": 'stiffness="60" springyield="0.01" springlength="0"'},
    "flex_edges": {"world": flex('<edge equality="true" damping="0.1"/>'), "integrator": "Euler"},
    "flex_elastic": {"world": flex(ELASTIC.format("")), "integrator": "discrete"},
    "flex_plastic": {
        "world": flex(ELASTIC.format('yield="1e-4 1e-4"') + '<pin id="0 3"/>'),
        "integrator": "discrete",
    },
    "flex_nodes": {
        "world": flex('<elasticity young="3e4" poisson="0.2"/>', 'dim="3" count="3 3 3" dof="trilinear"'),
        "integrator": "discrete",
    },
    "rod": {
        "world": flex(
            '<edge equality="true"/><elasticity young="1e6" shear="4e5"/><pin id="0 1"/>', 'dim="1" count="6 1 1"'
        ),
        "integrator": "discrete",
    },
    "speculative": {"option": '<flag speculative="enable"/>'},
    "adhesion_energy": {"option": '<flag energy="enable" fwdinv="enable"/>'},
}
ARRAYS = (
    *("time", "qpos", "qvel", "act", "history", "plastic", "qacc", "qacc_warmstart", "sensordata", "actuator_force"),
    *("xpos", "cvel", "qfrc_passive", "qfrc_constraint", "ten_length", "flexvert_xpos"),
)


def text_of(name: str) -> str:
    return ARM.format(**(PLAIN | MODELS[name]))


class Pair:
    """The rows of mjenv, which share one mjData, and one mjData of MuJoCo's for each."""

    def __init__(self, name: str) -> None:
        self.model: Any = mujoco.MjModel.from_xml_string(text_of(name))
        self.models = [self.model] * ROWS
        self.plain = [mujoco.MjData(self.model) for _ in range(ROWS)]
        self.arrays = [array for array in ARRAYS if np.size(getattr(self.plain[0], array))]
        self.rng = np.random.default_rng(3)
        self.envs = self.another(name)

    def another(self, name: str) -> Any:
        return mjenv.make_vec(
            "Model-v0",
            ROWS,
            engine="4.0",
            num_threads=1,
            xml_string=text_of(name),
            autoreset_mode=AutoresetMode.DISABLED,
            arrays=" ".join(array for array in self.arrays if array != "time"),
            frame_skip=2,
        )

    def reset(self, mask: np.ndarray) -> None:
        self.envs.reset(seed=1, options={"reset_mask": mask})
        for model, data, chosen in zip(self.models, self.plain, mask, strict=True):
            if chosen:
                mujoco.mj_resetData(model, data)
                mujoco.mj_forward(model, data)

    def step(self) -> None:
        actions = self.rng.uniform(-1.2, 1.2, (ROWS, self.model.nu))
        self.envs.step(actions)
        for action, model, data in zip(actions, self.models, self.plain, strict=True):
            data.ctrl[:] = action
            for _ in range(2):
                mujoco.mj_step(model, data)

    def move(self, name: str) -> None:
        """The rows go on in another environment, whose mjData has been elsewhere."""
        other = self.another(name)
        other.reset(seed=2)
        other.step(self.rng.uniform(-1, 1, (ROWS, self.model.nu)))
        other.restore(self.envs.snapshot())
        self.envs = other

    def check(self, what: object) -> None:
        for row, data in enumerate(self.plain):
            for array in self.arrays:
                ours = self.envs.envs[row].data.time if array == "time" else self.envs.arrays[array][row]
                theirs = np.asarray(getattr(data, array), np.float64)
                assert np.asarray(ours, np.float64).tobytes() == theirs.tobytes(), (what, row, array)


@pytest.mark.parametrize("name", MODELS)
def test_rows(name: str) -> None:
    pair = Pair(name)
    pair.reset(np.ones(ROWS, np.bool_))
    pair.check("reset")
    carried = [pair.plain[0].history.copy(), pair.plain[0].plastic.copy()]
    for step in range(STEPS):
        if step % 17 == 16:
            pair.reset(np.arange(ROWS) != step % ROWS)
            pair.check(f"reset before step {step}")
        pair.step()
        pair.check(f"step {step}")
        if step % 25 == 24:
            pair.move(name)
    for before, after in zip(carried, (pair.plain[0].history, pair.plain[0].plastic), strict=True):
        assert before.size == 0 or before.tobytes() != after.tobytes()


def test_equality_constraints() -> None:
    """Equality constraints are switched on and off in mjData, whose eq_active a reset copies from the model."""
    pair = Pair("flex_edges")
    assert pair.model.neq == 1
    assert pair.model.eq_active0[0]

    def play(what: str) -> None:
        for step in range(8):
            pair.step()
            pair.check((what, step))
        for row, data in enumerate(pair.plain):
            assert pair.envs.envs[row].data.eq_active[0] == data.eq_active[0], (what, row)

    pair.reset(np.ones(ROWS, np.bool_))
    pair.envs.envs[1].data.eq_active[0] = False
    pair.plain[1].eq_active[0] = False
    play("off in row 1")
    pair.move("flex_edges")
    play("moved")
    assert pair.plain[0].qpos.tobytes() != pair.plain[1].qpos.tobytes()
    pair.reset(np.ones(ROWS, np.bool_))
    play("reset")
    pair.models[2] = copy.copy(pair.model)
    pair.models[2].eq_active0[0] = False
    pair.envs.envs[2].model.eq_active0[0] = False
    play("off in the model of row 2")
    pair.reset(np.ones(ROWS, np.bool_))
    play("reset with that model")
    pair.envs.envs[2].data.eq_active[0] = True
    pair.plain[2].eq_active[0] = True
    play("on in row 2")
    with pytest.raises(mjenv.InvalidValueError, match=r"eq_active\[0\] is 2"):
        pair.envs._pool.rows.write(0, "eq_active", [2.0])


@pytest.mark.parametrize(
    ("name", "array", "is_free"),
    [
        *(
            ("plain", "actuator_biasprm", True),
            ("plain", "actuator_gainprm", True),
            ("filter", "actuator_biasprm", True),
        ),
        *(("pid", "actuator_biasprm", True), ("pid", "actuator_gainprm", False), ("pid", "actuator_dynprm", False)),
        *(("motor", "actuator_gainprm", False), ("motor", "actuator_dynprm", False)),
    ],
)
def test_signs_of_parameters(name: str, array: str, is_free: bool) -> None:
    """A parameter may change its sign, unless the sign decides which variables its actuator's state consists of."""
    pair = Pair(name)
    pair.reset(np.ones(ROWS, np.bool_))
    values = -1 - getattr(pair.model, array)
    if not is_free:
        with pytest.raises(mjenv.InvalidValueError, match="state consists of"):
            pair.envs._pool.rows.write(0, array, values.ravel())
        return
    pair.models[1] = copy.copy(pair.model)
    for model in (pair.models[1], pair.envs.envs[1].model):
        getattr(model, array)[:] = values
    for step in range(5):
        pair.step()
        pair.check(step)


def test_divergence_without_a_reset() -> None:
    """A model can keep MuJoCo from resetting a simulation with bad numbers: then the inputs stay, too."""
    MODELS["kept"] = {"option": '<flag autoreset="disable"/>'}
    pair = Pair("kept")
    del MODELS["kept"]
    pair.reset(np.ones(ROWS, np.bool_))
    for value in (1e300, 0.0):
        pair.envs.envs[1].data.xfrc_applied[1, 0] = value
        pair.plain[1].xfrc_applied[1, 0] = value
        for step in range(3):
            pair.step()
            for row, data in enumerate(pair.plain):
                ours = pair.envs.envs[row].data
                for array in ("time", "qpos", "qvel", "xfrc_applied"):
                    assert np.asarray(getattr(ours, array)).tobytes() == np.asarray(getattr(data, array)).tobytes(), (
                        value,
                        step,
                        row,
                        array,
                    )
    assert not np.isfinite(pair.plain[1].qpos).all()


def test_the_models_have_what_they_are_for() -> None:
    def of(name: str) -> Any:
        return mujoco.MjModel.from_xml_string(text_of(name))

    for name in MODELS:
        assert (of(name).nhistory > 0) == any(word in name for word in ("delay", "history", "interval")), name
        assert (of(name).nplastic > 0) == any(word in name for word in ("plastic", "rod")), name
        assert (of(name).nflex > 0) == any(word in name for word in ("flex", "rod")), name


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"option": '<flag sleep="enable"/>'}, "sleeping"),
        ({"option": '<flag energy="enable"/>', "sensors": "<e_kinetic/>"}, "e_kinetic"),
        ({"option": '<flag ipc="enable"/>', "integrator": "discrete", "world": flex(ELASTIC.format(""))}, "ipc"),
    ],
)
def test_refused(changes: dict[str, str], why: str) -> None:
    xml = ARM.format(**(PLAIN | changes))
    assert mujoco.MjModel.from_xml_string(xml).nq > 0
    with pytest.raises(mjenv.ModelError, match=why):
        mjenv.make("Model-v0", engine="4.0", xml_string=xml)


def test_refused_flag() -> None:
    xml = ARM.format(**(PLAIN | {"sensors": "<e_kinetic/>"}))
    env = mjenv.make("Model-v0", engine="4.0", xml_string=xml)
    energy = int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    with pytest.raises(mjenv.InvalidValueError, match=f"the flag {energy}$"):
        env.unwrapped.model.opt.enableflags |= energy
