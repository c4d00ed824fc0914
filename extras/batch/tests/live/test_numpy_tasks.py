"""NumPy tasks against the same written with MuJoCo's own calls, bit for bit."""

from __future__ import annotations

import copy
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import mjenv
from mjenv.task import locomotion
from test_tasks import AROUND, ROWS, TERRAIN, check_own_arrays, forward_without_actuation

# A free body, whose quaternion MuJoCo 2.2.2 normalises; contacts, sensors of all stages, an activation.
MODEL = """
<mujoco>
  <option timestep="0.004" integrator="{integrator}"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1"/>
    <body name="trunk" pos="0 0 0.5">
      <freejoint/><geom type="capsule" fromto="-0.2 0 0 0.2 0 0" size="0.08"/><site name="trunk" pos="0.1 0 0.1"/>
      <body name="leg" pos="0.2 0 0">
        <joint name="hip" axis="0 1 0" range="-60 60" limited="true" damping="0.1"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03"/>
        <body name="shin" pos="0 0 -0.3">
          <joint name="knee" type="ball" damping="0.2"/><geom name="foot" size="0.05" pos="0 0 -0.1"/>
          <site name="foot" pos="0 0 -0.15" size="0.06"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="hip" joint="hip" kp="20" ctrllimited="true" ctrlrange="-1 1"/>
    <general name="lift" joint="hip" dyntype="filter" dynprm="0.05" gainprm="4" ctrllimited="true" ctrlrange="-1 1"/>
  </actuator>
  <sensor>
    <framepos objtype="site" objname="foot"/><framelinvel objtype="site" objname="trunk"/><accelerometer site="trunk"/>
    <touch site="foot"/><jointpos joint="hip"/>
  </sensor>
</mujoco>
"""
FEW = (
    "qpos",
    "qvel",
    "act",
    "xpos",
    "xquat",
    "site_xpos",
    "cvel",
    "subtree_com",
    "sensordata",
    "actuator_force",
    "qacc",
)
# With these, lanes leave all of mjData in memory.
ALL = (*FEW, "geom_xpos", "cfrc_ext", "contacts")
FRAMES = 3
INTEGRATORS = ("Euler", "RK4")


class Shown(mjenv.Task):
    """Observes every array that it needs."""

    frame_skip = FRAMES
    current = True

    def reset(self, rng: Any, rows: int) -> tuple[Any, Any]:
        qpos = self.qpos0 + rng.uniform(-0.3, 0.3, (rows, self.nq))  # no unit quaternions
        return qpos, rng.uniform(-1, 1, (rows, self.nv))

    def observe(self, sim: Any) -> NDArray[Any]:
        return seen([getattr(sim, name) for name in self.needs if name != "contacts"], self.contacts(sim))

    def contacts(self, sim: Any) -> list[NDArray[Any]]:
        if "contacts" not in self.needs:
            return []
        real = np.arange(20) < sim.ncon.reshape(-1, 1)
        return [np.where(real, getattr(sim.contact, name)[:, :20], 0) for name in ("geom1", "geom2", "dist")]

    def step(self, sim: Any, action: NDArray[Any]) -> tuple[Any, ...]:
        return sim.xpos[:, 1, 2], np.zeros(len(action), bool), {}


def seen(arrays: list[NDArray[Any]], contacts: list[NDArray[Any]]) -> NDArray[Any]:
    return np.concatenate([np.reshape(values, (len(values), -1)) for values in (*arrays, *contacts)], axis=1)


for integrator in INTEGRATORS:
    for name, arrays in (("Few", FEW), ("All", ALL)):
        text = MODEL.format(integrator=integrator)
        mjenv.register(f"{name}{integrator}-v0", type(name, (Shown,), {"model": text, "needs": arrays}))


class Plain:
    """One row of such a task, with mujoco's own calls."""

    def __init__(self, model: mujoco.MjModel, needs: tuple[str, ...]) -> None:
        self.model, self.data, self.needs = model, mujoco.MjData(model), needs
        self.qpos = self.data.qpos.copy()

    def reset(self, qpos: NDArray[Any], qvel: NDArray[Any]) -> None:
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = qpos, qvel
        self.qpos = qpos.copy()
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
        mujoco.mj_forward(model, data)
        model.opt.disableflags ^= mujoco.mjtDisableBit.mjDSBL_ACTUATION

    def step(self, ctrl: NDArray[Any]) -> None:
        model, data = self.model, self.data
        data.qpos[:] = self.qpos
        data.ctrl[:] = ctrl
        mujoco.mj_step(model, data, FRAMES)
        mujoco.mj_rnePostConstraint(model, data)
        self.qpos = data.qpos.copy()
        warnings = data.warning.number.sum()
        mujoco.mj_step1(model, data)
        if data.warning.number.sum() > warnings:  # it has reset the simulation
            self.qpos = data.qpos.copy()

    def observed(self) -> NDArray[Any]:
        data = self.data
        arrays = [np.array(getattr(data, name))[None] for name in self.needs if name != "contacts"]
        contacts = []
        if "contacts" in self.needs:
            for name in ("geom1", "geom2", "dist"):
                found = np.zeros((1, 20))
                found[0, : data.ncon] = [getattr(contact, name) for contact in data.contact[: data.ncon]]
                contacts.append(found)
        return seen(arrays, contacts)[0]


@pytest.mark.parametrize(("lanes", "threads"), [(0, 1), ("auto", 1), ("auto", 2)])
@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("needs", ["Few", "All"])
def test_new_state(needs: str, integrator: str, lanes: int | str, threads: int) -> None:
    model = mujoco.MjModel.from_xml_string(MODEL.format(integrator=integrator))
    plain = [Plain(model, FEW if needs == "Few" else ALL) for _ in range(ROWS)]
    streams = [np.random.default_rng(seed) for seed in range(ROWS)]
    envs = mjenv.make_vec(f"{needs}{integrator}-v0", ROWS, lanes=lanes, num_threads=threads)
    other = mjenv.make_vec(f"{needs}{integrator}-v0", ROWS, lanes=0)
    other.reset(seed=99)
    rng = np.random.default_rng(7)
    touched = 0
    for episode in range(2):
        got, _ = envs.reset(seed=list(range(ROWS)) if episode == 0 else None)
        for row, stream in zip(plain, streams, strict=True):
            row.reset(model.qpos0 + stream.uniform(-0.3, 0.3, model.nq), stream.uniform(-1, 1, model.nv))
        np.testing.assert_array_equal(got, [row.observed() for row in plain])
        for step in range(40):
            action = rng.uniform(-1, 1, (ROWS, 2))
            for row, ctrl in zip(plain, action, strict=True):
                row.step(ctrl)
            want = [row.observed() for row in plain]
            touched += sum(row.data.ncon for row in plain)
            got, reward, *_ = envs.step(action)
            np.testing.assert_array_equal(got, want)
            np.testing.assert_array_equal(reward, [row.data.xpos[1, 2] for row in plain])
            if step == 15:  # goes on from an image, in an environment that steps one by one
                other.restore(envs.snapshot())
                np.testing.assert_array_equal(other.observe(), want)
                envs, other = other, envs
            if step == 30:  # and with a copy of a row
                envs.copy_row(0, np.arange(ROWS) == ROWS - 1)
                plain[-1], streams[-1] = copy.deepcopy(plain[0]), copy.deepcopy(streams[0])
                np.testing.assert_array_equal(envs.observe(), [*want[:-1], want[0]])
    assert touched > 100
    envs.close()
    other.close()


@pytest.mark.parametrize("lanes", [0, "auto"])
def test_divergence_of_the_new_state(lanes: int | str) -> None:
    """Only mj_step1 finds that x has become greater than MuJoCo allows."""
    model = mujoco.MjModel.from_xml_string(MODEL.format(integrator="Euler"))
    plain = [Plain(model, FEW) for _ in range(ROWS)]
    envs = mjenv.make_vec("FewEuler-v0", ROWS, lanes=lanes)
    envs.reset(seed=1)
    qpos, qvel = np.tile(model.qpos0, (ROWS, 1)), np.zeros((ROWS, model.nv))
    qvel[2, 0] = 9e9
    qpos[2, 0] = 1e10 - (FRAMES - 0.5) * model.opt.timestep * qvel[2, 0]
    envs.set_state(qpos, qvel)
    for row, q, v in zip(plain, qpos, qvel, strict=True):
        row.reset(q, v)
    for _ in range(10):
        for row in plain:
            row.step(np.full(2, 0.5))
        got, *_ = envs.step(np.full((ROWS, 2), 0.5))
        np.testing.assert_array_equal(got, [row.observed() for row in plain])
    assert plain[2].data.warning[mujoco.mjtWarning.mjWARN_BADQPOS].number == 1
    envs.close()


class Filtered(mjenv.Task):
    """Offsets from a pose that a filter smooths, in NumPy."""

    model = MODEL.format(integrator="Euler")
    frame_skip = FRAMES
    action_bounds = ((-1, 1),)
    needs = ("qpos", "ctrl")
    state = {"smooth": ()}  # noqa: RUF012

    def reset(self, rng: Any, rows: int) -> tuple[Any, ...]:
        return np.tile(self.qpos0, (rows, 1)), np.zeros((rows, self.nv)), {"smooth": np.zeros(rows)}

    def before_step(self, sim: Any, action: NDArray[Any]) -> NDArray[Any]:
        sim.smooth[...] = 0.5 * sim.smooth + 0.5 * action[:, 0]
        return np.stack([0.3 + sim.smooth, np.clip(sim.smooth, 0, 1)], axis=1)

    def observe(self, sim: Any) -> NDArray[Any]:
        return np.concatenate([sim.qpos, sim.ctrl, sim.smooth[:, None]], axis=1)

    def step(self, sim: Any, action: NDArray[Any]) -> tuple[Any, ...]:
        return action[:, 0], sim.qpos[:, 2] < 0.45, {}


mjenv.register("Filtered-v0", Filtered)


def test_map_in_numpy() -> None:
    model = mujoco.MjModel.from_xml_string(Filtered.model)
    plain = [mujoco.MjData(model) for _ in range(ROWS)]
    for data in plain:
        mujoco.mj_forward(model, data)
    envs = mjenv.make_vec("Filtered-v0", ROWS, autoreset_mode="disabled")
    assert envs.action_space.shape == (ROWS, 1)
    envs.reset(seed=0)
    smooth = np.zeros(ROWS)
    for _ in range(20):
        action = envs.action_space.sample().astype(np.float64)
        smooth = 0.5 * smooth + 0.5 * action[:, 0]
        for data, value in zip(plain, smooth, strict=True):
            data.ctrl[:] = 0.3 + value, min(max(value, 0), 1)
            mujoco.mj_step(model, data, FRAMES)
        got, reward, *_ = envs.step(action)
        want = [np.concatenate([data.qpos, data.ctrl, [value]]) for data, value in zip(plain, smooth, strict=True)]
        np.testing.assert_array_equal(got, want)
        np.testing.assert_array_equal(reward, action[:, 0])
        if got[:, 2].min() < 0.45:
            break
    envs.reset()
    with pytest.raises(mjenv.InvalidValueError, match=r"row 2: action\[0\] is nan"):
        envs.step(np.where(np.arange(ROWS) == 2, np.nan, 0)[:, None])
    envs.close()


class Settle(mjenv.Task):
    """A reset lets the ball fall until it touches the floor, and moves a marker; a step draws, and moves it, too."""

    model = """
        <mujoco>
          <option timestep="0.01"/>
          <worldbody>
            <geom name="floor" type="plane" size="5 5 0.1"/>
            <geom name="marker" pos="0 0 2" size="0.1" contype="0" conaffinity="0"/>
            <body name="ball" pos="0 0 1">
              <joint name="z" type="slide" axis="0 0 1"/><geom name="ball" size="0.1"/>
            </body>
          </worldbody>
          <actuator><motor joint="z" gear="30"/></actuator>
        </mujoco>"""
    frame_skip = 2
    current = True
    random_state = True
    own = ("geom_pos",)
    needs = ("qpos", "qvel", "xpos", "geom_xpos", "time")
    state = {"touched": (), "drawn": (2,)}  # noqa: RUF012
    options = {"most": 200}  # noqa: RUF012

    def reset_row(self, start: Any) -> dict[str, Any]:
        start.own["geom_pos"][1, 0] = start.random_state.uniform(0, 1)
        start.own["geom_pos"][1, 1] += 1
        start.qpos[0] = start.rng.uniform(0, 0.5)
        start.forward()
        for _ in range(self.most):  # type: ignore[attr-defined]
            if start.contact_count:
                break
            start.advance(1)
        else:
            raise RuntimeError("the ball does not touch the floor")
        touched = start.sim.xpos[1, 2]
        start.restart()
        assert start.qpos[0] == 0
        start.qpos[0], start.time = touched - 1 + 0.05, 0.5
        return {"touched": touched, "drawn": [start.rng.standard_normal(), start.rng.integers(0, 9)]}

    def observe(self, sim: Any) -> NDArray[Any]:
        parts = [sim.qpos, sim.qvel, sim.xpos[:, 1], sim.geom_xpos[:, 1], sim.own["geom_pos"][:, 1], sim.drawn]
        return np.concatenate([*parts, sim.touched[:, None], sim.time.reshape(-1, 1)], axis=1)

    def step(self, sim: Any, action: NDArray[Any]) -> tuple[Any, ...]:
        rows = len(action)
        kicked = sim.rng.random(rows) < 0.3
        sim.own["geom_pos"][kicked, 1, 2] += sim.rng.uniform(0, 1, (rows, 2)).sum(axis=1)[kicked]
        return action[:, 0], np.zeros(rows, bool), {"kicked": kicked}


mjenv.register("Settle-v0", Settle)


class PlainSettle:
    """One row of it, with mujoco's own calls."""

    def __init__(self, seed: int) -> None:
        self.rng, self.random_state = np.random.default_rng(seed), np.random.RandomState(seed)
        self.model = mujoco.MjModel.from_xml_string(Settle.model)
        self.data = mujoco.MjData(self.model)

    def reset(self) -> None:
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        forward_without_actuation(model, data)
        model.geom_pos[1, 0] = self.random_state.uniform(0, 1)
        model.geom_pos[1, 1] += 1
        data.qpos[0] = self.rng.uniform(0, 0.5)
        forward_without_actuation(model, data)
        while not data.ncon:
            mujoco.mj_step2(model, data)
            mujoco.mj_step1(model, data)
        self.touched = data.xpos[1, 2].copy()
        mujoco.mj_resetData(model, data)
        forward_without_actuation(model, data)
        data.qpos[0], data.time = self.touched - 1 + 0.05, 0.5
        forward_without_actuation(model, data)
        self.drawn = [self.rng.standard_normal(), self.rng.integers(0, 9)]

    def step(self, action: NDArray[Any]) -> bool:
        model, data = self.model, self.data
        data.ctrl[:] = action
        mujoco.mj_step(model, data, 2)
        mujoco.mj_step1(model, data)
        kicked = bool(self.rng.random() < 0.3)
        up = self.rng.uniform(0, 1, 2).sum()
        model.geom_pos[1, 2] += up if kicked else 0
        return kicked

    def observed(self) -> NDArray[Any]:
        data = self.data
        parts = [data.qpos, data.qvel, data.xpos[1], data.geom_xpos[1], self.model.geom_pos[1], self.drawn]
        return np.concatenate([*parts, [self.touched], [data.time]])


@pytest.mark.parametrize("threads", [1, 2])
def test_numpy_reset_that_simulates(threads: int) -> None:
    plain = [PlainSettle(seed) for seed in range(ROWS)]
    envs = mjenv.make_vec("Settle-v0", ROWS, num_threads=threads, autoreset_mode="disabled")
    other = mjenv.make_vec("Settle-v0", ROWS, autoreset_mode="disabled")
    other.reset(seed=99)
    rng = np.random.default_rng(5)
    for episode in range(3):
        mask = np.arange(ROWS) != 3 if episode == 1 else np.ones(ROWS, bool)
        got, _ = envs.reset(
            seed=list(range(ROWS)) if episode == 0 else None, options={"reset_mask": mask} if episode == 1 else None
        )
        for row, resets in zip(plain, mask, strict=True):
            if resets:
                row.reset()
        np.testing.assert_array_equal(got, [row.observed() for row in plain])
        for step in range(20):
            action = rng.uniform(-1, 1, (ROWS, 1))
            kicked = [row.step(of_row) for row, of_row in zip(plain, action, strict=True)]
            want = [row.observed() for row in plain]
            got, _, _, _, infos = envs.step(action)
            np.testing.assert_array_equal(got, want)
            np.testing.assert_array_equal(infos["kicked"], kicked)
            if step == 8:
                other.restore(envs.snapshot())
                np.testing.assert_array_equal(other.observe(), want)
                envs.copy_row(0, np.arange(ROWS) == ROWS - 1)
                plain[-1] = copy.deepcopy(plain[0])
                np.testing.assert_array_equal(envs.observe(), [*want[:-1], want[0]])
    envs.close()
    other.close()


class Terrain(mjenv.Task):
    """tests/tasks/terrain.cpp written again. Its own arrays are float32 in MuJoCo."""

    model = TERRAIN
    frame_skip = 4
    time_limit = 25
    current = True
    random_state = True
    own = ("hfield_data", "geom_rgba")
    needs = ("qpos", "qvel", "xpos", "xmat", "ncon", "contact.geom1", "contact.geom2", "contact.dist")
    state = {"touched": (), "air": (1,)}  # noqa: RUF012

    def build(self, model: Any) -> None:
        self.ground = locomotion.Terrain(model, "ground")

    def reset_row(self, start: Any) -> dict[str, Any]:
        start.own["hfield_data"][:] = start.random_state.permutation(30) / 30
        start.random_state.shuffle(start.own["hfield_data"][:7])
        start.own["geom_rgba"][0, 0] = start.random_state.choice(5) / 10
        start.own["geom_rgba"][1, 0] += 0.01  # counts the resets
        start.qpos[0] = start.random_state.uniform(-1, 1)
        start.forward()
        for _ in range(200):
            if start.contact_count:
                break
            start.advance(1)
        start.time = 0
        x, y, z = start.sim.xpos[1]
        field = start.own["hfield_data"].astype(np.float32)
        return {"touched": z - self.ground.height(x, y, field), "air": np.zeros(1)}

    def observe(self, sim: Any) -> NDArray[Any]:
        rows = len(sim.qpos)
        field, rgba = sim.own["hfield_data"], sim.own["geom_rgba"].reshape(rows, -1)
        touching, at = locomotion.touching(sim, [1], 0), sim.xpos[:, 1]
        below = self.ground.height(at[:, 0], at[:, 1], field)[:, None]
        around = self.ground.around(at, sim.xmat[:, 1], AROUND, field)
        numbers = [sim.touched[:, None], touching, sim.air, below, around]
        return np.concatenate([sim.qpos, sim.qvel, field, rgba, *numbers], axis=1)

    def step(self, sim: Any, action: NDArray[Any]) -> tuple[Any, ...]:
        rows = len(action)
        flights = locomotion.air_time(sim.air, locomotion.touching(sim, [1], 0), self.dt)
        at = sim.rng.integers(0, 30, rows)
        sim.own["hfield_data"][np.arange(rows), at] = sim.rng.random(rows)
        return sim.qpos[:, 0], np.zeros(rows, bool), {"height": sim.qpos[:, 2], "flight": flights[:, 0]}


mjenv.register("NumpyTerrain-v0", Terrain)


def test_terrain_in_numpy_has_the_bits_of_that_in_cpp() -> None:
    """The heights, which the test below compares with rays, whose rounding is another."""
    both = [mjenv.make_vec(id, ROWS, autoreset_mode="disabled") for id in ("NumpyTerrain-v0", "tests/Terrain-v0")]
    rng = np.random.default_rng(6)
    got = [envs.reset(seed=3)[0] for envs in both]
    for _ in range(20):
        np.testing.assert_array_equal(*got)
        action = rng.uniform(-1, 1, (ROWS, 2))
        got = [envs.step(action)[0] for envs in both]
    for envs in both:
        envs.close()


def test_own_arrays_of_float32() -> None:
    check_own_arrays("NumpyTerrain-v0")


class Paints(Terrain):
    """Its step writes two arrays, and then fails if the option says so."""

    options = {"fails": ""}  # noqa: RUF012

    def step(self, sim: Any, action: NDArray[Any]) -> tuple[Any, ...]:
        sim.own["hfield_data"][:, 3] += 0.25
        sim.own["geom_rgba"][1:, 0, 1] = np.nan if self.fails == "value" else 0.5  # type: ignore[attr-defined]
        if self.fails == "late":  # type: ignore[attr-defined]
            raise RuntimeError("too late")
        return np.zeros(len(action)), np.zeros(len(action), bool), {}


mjenv.register("Paints-v0", Paints)


@pytest.mark.parametrize(("fails", "words"), [("late", "too late"), ("value", r"row 1: .*geom_rgba\[1\] is nan")])
def test_numpy_step_that_fails_gives_own_arrays_back(fails: str, words: str) -> None:
    envs = mjenv.make_vec("Paints-v0", 3, autoreset_mode="disabled")
    envs.reset(seed=1)
    rows = envs._pool.rows  # type: ignore[attr-defined]
    shown = {name: values.copy() for name, values in rows._sim.own.items()}
    rows._task.fails = fails
    with pytest.raises((RuntimeError, mjenv.InvalidValueError), match=words):
        envs.step(np.zeros((3, 2)))
    for name, values in shown.items():
        np.testing.assert_array_equal(rows._sim.own[name], values)
        for row in range(3):
            np.testing.assert_array_equal(rows._read(row, name, values[row].size), values[row].reshape(-1))
    with pytest.raises(ValueError, match="read-only"):
        rows._sim.own["geom_rgba"][0] = 0
    envs.close()


def test_numpy_reset_that_fails() -> None:
    envs = mjenv.make_vec("Settle-v0", 2, autoreset_mode="disabled", most=90)
    envs.reset(seed=[1, 2])
    before, seen = envs.snapshot(), envs.observe()
    failing = mjenv.make_vec("Settle-v0", 2, autoreset_mode="disabled", most=3)
    with pytest.raises(RuntimeError, match="the ball does not touch the floor"):
        failing.reset(seed=[1, 2])
    envs._pool.rows._task.most = 3  # type: ignore[attr-defined]
    with pytest.raises(RuntimeError, match="the ball does not touch the floor"):
        envs.reset()
    assert envs.snapshot() == before
    np.testing.assert_array_equal(envs.observe(), seen)
    envs.close()
    failing.close()


class Running(mjenv.Task):
    """HalfCheetah-v5, whose velocity is what a step has added to the position before it."""

    model = mjenv.model_xml("HalfCheetah-v5")
    frame_skip = 5
    state = {"x": ()}  # noqa: RUF012

    def reset(self, rng: Any, rows: int) -> tuple[Any, ...]:
        return np.tile(self.qpos0, (rows, 1)), np.zeros((rows, self.nv)), {"x": np.zeros(rows)}

    def observe(self, sim: Any) -> NDArray[Any]:
        return np.concatenate([sim.qpos[:, 1:], sim.qvel], axis=1)

    def carry(self, sim: Any) -> None:
        sim.x[...] = sim.qpos[:, 0]

    def before_step(self, sim: Any, action: NDArray[Any]) -> NDArray[Any]:
        self.before = sim.qpos[:, 0].copy()
        return action

    def step(self, sim: Any, action: NDArray[Any]) -> tuple[Any, ...]:
        assert np.array_equal(sim.x, self.before)
        return (sim.qpos[:, 0] - sim.x) / self.dt, np.zeros(len(action), bool), {}


mjenv.register("Running-v0", Running)


def test_writes_between_steps() -> None:
    """A step begins with the state that a program has written into any of the arrays that show it."""
    theirs = gymnasium.make("HalfCheetah-v5").unwrapped
    envs, env = mjenv.make_vec("Running-v0", 3), mjenv.make("Running-v0")
    theirs.reset(seed=0), envs.reset(seed=0), env.reset(seed=0)
    mujoco.mj_resetData(theirs.model, theirs.data)
    for row in (env, *envs.envs):
        row.mj_resetData()
    action = np.full(6, 0.1, np.float32)
    for t in range(4):
        theirs.data.qpos[0] = env.data.qpos[0] = t + 2
        if t == 1:
            envs.data.qpos[:, 0] = t + 2
        elif t == 2:
            envs.handle.write(1, "qpos", theirs.data.qpos)
            envs.copy_row(1, np.arange(3) == 2)
            envs = copy.deepcopy(envs)
        else:
            envs.envs[1].data.qpos[0] = t + 2
        obs, _, _, _, info = theirs.step(action)
        of_rows = envs.step(np.tile(action, (3, 1)))
        for row in (1, 2) if t == 2 else (1,):
            np.testing.assert_array_equal(of_rows[0][row], obs)
            assert of_rows[1][row] == info["x_velocity"]
        got, velocity, *_ = env.step(action)
        np.testing.assert_array_equal(got, obs)
        assert velocity == info["x_velocity"]
    envs.close()
