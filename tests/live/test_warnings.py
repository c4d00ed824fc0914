"""data.warnings against the counts of plain MuJoCo: what it has warned of in any timestep of the last step."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

import mjenv

# Balls that begin in the floor, for whose contacts MuJoCo 2.2.2 has too little space, and that bounce out of it.
BALLS = 6
BALL = '<body pos="{x} 0 0.1"><joint type="slide" axis="0 0 1"/><geom size="0.1"/></body>'
MODEL = f"""
<mujoco>
  <size nconmax="3" njmax="40"/>
  <option timestep="0.01"/>
  <worldbody>
    <geom type="plane" size="9 9 1"/>
    {"".join(BALL.format(x=i) for i in range(BALLS))}
  </worldbody>
  <actuator><motor joint="lift"/></actuator>
</mujoco>
""".replace('<joint type="slide"', '<joint name="lift" type="slide"', 1)
ROWS, FRAMES, STEPS = 5, 5, 12


def given(data: Any) -> list[int]:
    return [int(data.warning[kind].number > 0) for kind in range(len(mujoco.mjtWarning.__members__) - 1)]


# Lanes follow MuJoCo 2.2.2.
@pytest.mark.parametrize("lanes", [0, 4] if mujoco.__version__.startswith("2.") else [0])
def test_warnings(lanes: int) -> None:
    envs = mjenv.make_vec(
        "Model-v0",
        ROWS,
        xml_string=MODEL,
        frame_skip=FRAMES,
        strict=False,
        lanes=lanes,
        arrays="warnings",
        num_threads=1,
    )
    envs.reset(seed=1)
    other = mjenv.make_vec("Model-v0", ROWS, xml_string=MODEL, frame_skip=FRAMES, strict=False)
    other.reset(seed=1)
    model = mujoco.MjModel.from_xml_string(MODEL)
    plain = [mujoco.MjData(model) for _ in range(ROWS)]
    random = np.random.default_rng(1)
    for data in plain:
        data.qpos[:] = random.uniform(-0.06, 0.02, BALLS)
        data.qvel[:] = random.uniform(0, 3, BALLS)
        mujoco.mj_forward(model, data)
    envs.set_state(np.array([data.qpos for data in plain]), np.array([data.qvel for data in plain]))
    assert [env.data.warnings.tolist() for env in envs.envs] == list(map(given, plain))
    seen, early = set(), 0
    for step in range(STEPS):
        actions = np.zeros((ROWS, 1))
        if step == 7:
            actions[1] = np.nan
        if step == 9:
            plain[2].qvel[0] = 1e11
            envs.envs[2].data.qvel[0] = 1e11
        envs.step(actions)
        wanted = []
        for data, action in zip(plain, actions, strict=True):
            for kind in range(len(given(data))):
                data.warning[kind].number = 0
            data.ctrl[:] = action
            for _ in range(FRAMES):
                mujoco.mj_step(model, data)
            wanted.append(given(data))
            seen |= {kind for kind, is_given in enumerate(wanted[-1]) if is_given}
            early += wanted[-1][mujoco.mjtWarning.mjWARN_CONTACTFULL] == 1 and data.ncon < 3
        assert envs.arrays["warnings"].tolist() == wanted
        # Read one after the other, so that derived arrays of rows are computed again.
        assert [env.data.warnings.tolist() for env in envs.envs] == wanted
        assert [[kind.number for kind in env.data.warning] for env in envs.envs] == wanted
        np.testing.assert_array_equal(envs.data.warnings, wanted)
        for row in range(ROWS):
            other.restore(envs.snapshot(row), (row + 1) % ROWS)
            assert other.envs[(row + 1) % ROWS].data.warnings.tolist() == wanted[row]
    kinds = {mujoco.mjtWarning.mjWARN_BADCTRL, mujoco.mjtWarning.mjWARN_BADQVEL}
    if mujoco.__version__.startswith("2."):  # MuJoCo 4.0 finds memory for all contacts
        kinds.add(mujoco.mjtWarning.mjWARN_CONTACTFULL)
        assert early > 0
    assert kinds <= seen
    envs.copy_row(2, np.arange(ROWS) == 0)
    assert envs.envs[0].data.warnings.tolist() == wanted[2]
    envs.reset()
    mujoco.mj_resetData(model, plain[0])
    mujoco.mj_forward(model, plain[0])
    assert envs.arrays["warnings"].tolist() == [given(plain[0])] * ROWS
    envs.close()
    other.close()
