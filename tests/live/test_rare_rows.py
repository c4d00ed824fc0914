"""Rows that do what rows seldom do: read after another row had the thread, diverge, or have almost no mass."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import mjenv

READ = "qpos qvel qacc xpos cvel qLDiagInv qfrc_bias qfrc_applied qfrc_constraint efc_force".split()


class Rows:
    """Two rows of a Hopper on one thread. Row 0 does what Gymnasium's environment does."""

    def __init__(self, **options: Any) -> None:
        self.ours = mjenv.make_vec("Hopper-v5", 2, num_threads=1, **options)
        self.theirs: Any = gymnasium.make("Hopper-v5", **options)
        self.ours.reset(seed=[3, 4])
        self.theirs.reset(seed=3)

    @property
    def data(self) -> Any:
        return self.theirs.unwrapped.data

    @property
    def model(self) -> Any:
        return self.theirs.unwrapped.model

    def step(self, times: int = 1) -> None:
        for _ in range(times):
            action = np.full(3, 0.4, np.float32)
            self.ours.step(np.array([action, -action]))
            self.theirs.step(action)

    def check(self) -> None:
        """The thread computes row 1, so it must compute row 0 anew from what the row keeps."""
        _ = np.asarray(self.ours.data.xpos[1])
        for name in READ:
            expected = np.asarray(getattr(self.data, name), np.float64)
            found = np.asarray(getattr(self.ours.envs[0].data, name))
            if name == "efc_force":
                found = found[: expected.size]
            assert found.tobytes() == expected.tobytes(), name


def test_a_written_state() -> None:
    """The arrays that MuJoCo computes stay those of the step, beside the state that was written."""
    rows = Rows()
    rows.step(3)
    for name, value in (("qpos", 1.5), ("qvel", -0.5)):
        getattr(rows.data, name)[:] = value
        getattr(rows.ours.data, name)[0] = value
    rows.check()


def test_constants_of_earlier_values() -> None:
    """mj_setConst changes the values that the last step was computed with."""
    rows = Rows()
    rows.step(6)
    mass = rows.model.body_mass * 1.7
    rows.model.body_mass[:] = mass
    rows.ours.model.body_mass[0] = mass
    rows.step(2)
    assert rows.data.nefc > 0
    mujoco.mj_setConst(rows.model, rows.data)
    rows.ours.envs[0].set_constants()
    rows.check()


def test_a_force_that_diverges() -> None:
    """MuJoCo resets the simulation and clears the force by which it diverged."""
    rows = Rows(frame_skip=1)
    rows.step(2)
    rows.data.qfrc_applied[1] = 1e12
    rows.ours.data.qfrc_applied[0, 1] = 1e12
    rows.step()
    assert list(rows.ours.statuses != 0) == [True, False]
    rows.check()


def set_state(rows: Rows) -> None:
    qpos, qvel = rows.data.qpos + 0.01, rows.data.qvel.copy()
    rows.theirs.unwrapped.set_state(qpos, qvel)
    rows.ours.envs[0].set_state(qpos, qvel)


def write(rows: Rows) -> None:
    rows.data.qpos[:] += 0.01
    rows.ours.data.qpos[0] = rows.data.qpos


@pytest.mark.parametrize("change", [set_state, write])
def test_observations_after_a_change(change: Callable[[Rows], None]) -> None:
    """observe() repeats the noisy observation of a step, but the state that was set has no noise yet."""
    rows = Rows()
    rows.ours.perturb(noise=mjenv.Noise(observation=0.1))
    rows.ours.reset(seed=[3, 4])
    action = np.zeros(3, np.float32)
    observed = rows.ours.step(np.array([action, action]))[0].copy()
    assert rows.ours.observe().tobytes() == observed.tobytes()
    rows.theirs.step(action)
    change(rows)
    assert rows.ours.observe()[0].tobytes() == rows.theirs.unwrapped._get_obs().tobytes()
    assert rows.ours.observe()[1].tobytes() == observed[1].tobytes()


MASSES = """
<mujoco>
  <option timestep="0.0001"/>
  <worldbody>
    <body>
      <joint type="slide" axis="0 0 1" range="0 1" limited="true" solreflimit="0.0002 1"/><geom size="0.1" mass="1"/>
    </body>
    <body pos="1 0 0"><joint type="slide" axis="0 0 1"/><geom size="0.1" mass="2"/></body>
  </worldbody>
</mujoco>
"""


def in_lanes(xml: str, rows: int, **options: Any) -> mjenv.VectorEnv:
    envs = mjenv.make_vec("Model-v0", rows, num_threads=1, xml_string=xml, **options)
    envs.reset(seed=0)
    assert envs.lanes > 0, envs.lanes_reason
    return envs


def check_steps(envs: mjenv.VectorEnv, models: list[mujoco.MjModel], plain: list[mujoco.MjData]) -> None:
    for _ in range(3):
        observed = envs.step(np.zeros((len(plain), 0)))[0]
        for row, (model, data) in enumerate(zip(models, plain, strict=True)):
            mujoco.mj_step(model, data)
            assert observed[row].tobytes() == np.concatenate([data.qpos, data.qvel]).tobytes(), row


def test_accelerations_that_diverge() -> None:
    """The force of a limit makes an acceleration above mjMAXVAL, although the velocity that it leads to is not."""
    model = mujoco.MjModel.from_xml_string(MASSES)
    starts = [0.5, -1e4, -0.1, -2e4]
    envs = in_lanes(MASSES, len(starts))
    plain = [mujoco.MjData(model) for _ in starts]
    for row, data in enumerate(plain):
        mujoco.mj_forward(model, data)  # in the reset
        data.qpos[0] = starts[row]
        mujoco.mj_forward(model, data)
    envs.set_state(np.array([data.qpos for data in plain]), np.zeros((len(starts), 2)))
    check_steps(envs, [model] * len(starts), plain)
    assert [data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number for data in plain] == [0, 1, 0, 1]


@pytest.mark.parametrize("mass", [5e-16, 1e-15, 2e-15])
def test_masses_below_the_least(mass: float) -> None:
    """MuJoCo divides by mjMINVAL (1e-15) where the inertia is less."""
    models = [mujoco.MjModel.from_xml_string(MASSES) for _ in range(4)]
    envs = in_lanes(MASSES, len(models))
    for row in (1, 3):
        models[row].body_mass[2] = mass
        envs.model.body_mass[row] = models[row].body_mass
    assert envs.lanes > 0, envs.lanes_reason
    check_steps(envs, models, [mujoco.MjData(model) for model in models])


def outcomes(envs: mjenv.VectorEnv, steps: int) -> tuple[list[NDArray[np.float64]], list[int]]:
    """The observations of the rows, and the step in which a row failed."""
    observed, failed = [], []
    for step in range(steps):
        try:
            observed.append(envs.step(np.zeros((envs.num_envs, 0)))[0].copy())
        except mjenv.PhysicsError:
            failed.append(step)
    return observed, failed


BALLS = """
<mujoco>
  <size nstack="NSTACK"/>
  <option integrator="RK4"/>
  <worldbody>
    <geom type="plane" size="9 9 1"/>
    <body pos="0 0 0.11"><freejoint/><geom size="0.1"/></body>
    <body pos="1 0 0.11"><freejoint/><geom size="0.1"/></body>
  </worldbody>
</mujoco>
"""


@pytest.mark.skipif(mujoco.__version__ != "2.2.2", reason="4.0's stack lies in its arena")
def test_stacks_that_are_too_small() -> None:
    """RK4 keeps its own numbers on MuJoCo's stack, and too small a stack is an error in lanes, too."""
    failed = set()
    for size in range(150, 1400, 50):
        xml = BALLS.replace("NSTACK", str(size))
        try:
            alone, together = (
                mjenv.make_vec("Model-v0", 4, num_threads=1, xml_string=xml, lanes=lanes) for lanes in (0, 2)
            )
        except mjenv.Error:  # its trial step fails
            continue
        for envs in (alone, together):
            envs.reset(seed=0)
        assert together.lanes == 2, together.lanes_reason
        expected, when = outcomes(alone, 30)
        found, when_together = outcomes(together, 30)
        assert when_together == when, size
        assert [row.tobytes() for row in found] == [row.tobytes() for row in expected], size
        failed.add(bool(when))
    assert failed == {False, True}
