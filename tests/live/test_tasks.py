"""Tasks in C++ against the same written with MuJoCo's own calls, bit for bit."""

from __future__ import annotations

import copy
import os
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import mjenv

ROWS = 5
mjenv.load_tasks(Path(os.environ["MJENV_LIBRARY"]).parent / "tests" / "tasks" / "libfollow.so")
FOLLOW = mujoco.MjModel.from_xml_string(mjenv.model_xml("tests/Follow-v0"))
JOINTS = ((7, 6), (8, 7))  # of the legs, in qpos and qvel


class PlainFollow:
    """One row of the task in tests/tasks/follow.cpp, with mujoco's own calls."""

    def __init__(self, seed: int, current: bool) -> None:
        self.model, self.rng, self.current = copy.deepcopy(FOLLOW), np.random.default_rng(seed), current
        self.data = mujoco.MjData(self.model)

    def reset(self) -> None:
        data = self.data
        mujoco.mj_resetData(self.model, data)
        start = self.model.key_qpos[0] + [self.rng.uniform(-0.05, 0.05) for _ in range(9)]
        if self.current:  # it sees the simulation, which has to be up to date
            forward_without_actuation(self.model, data)
        data.qpos[:] = self.qpos = start
        if self.current:
            forward_without_actuation(self.model, data)
        else:
            mujoco.mj_forward(self.model, data)
            self.qpos = data.qpos.copy()
        self.target, self.torque = [0.0, 0.0], [0.0, 0.0]

    def step(self, action: NDArray[Any]) -> None:
        model, data = self.model, self.data
        data.qpos[:] = self.qpos
        for i, (qpos, _) in enumerate(JOINTS):
            wanted = model.key_qpos[0, qpos] + 0.5 * min(max(action[i], -0.8), 0.8)
            self.target[i] += 0.4 * (wanted - self.target[i])
        data.xfrc_applied[1, 0] = self.rng.uniform(-20, 20)
        for substep in range(4):
            data.xfrc_applied[1, 2] = substep
            for i, (qpos, qvel) in enumerate(JOINTS):
                data.ctrl[i] = self.torque[i]
                self.torque[i] = 30 * (self.target[i] - data.qpos[qpos]) - 1 * data.qvel[qvel]
            mujoco.mj_step(model, data)
        self.qpos = data.qpos.copy()
        if self.current:
            mujoco.mj_step1(model, data)
            model.geom_pos[1, 0] += 0.25
        data.qvel[1] += 0.1 * action[0]

    def observed(self) -> NDArray[Any]:
        data = self.data
        parts = [data.qpos, data.qvel, data.ctrl, self.target, data.xpos[1], data.xfrc_applied[1]]
        if self.current:
            parts += [self.model.geom_pos[1], data.geom_xpos[1]]
        return np.concatenate(parts)


def forward_without_actuation(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    mujoco.mj_forward(model, data)
    model.opt.disableflags ^= mujoco.mjtDisableBit.mjDSBL_ACTUATION


@pytest.mark.parametrize(("lanes", "threads"), [(0, 1), ("auto", 1), ("auto", 2)])
@pytest.mark.parametrize("current", [False, True])
def test_maps_of_actions(current: bool, lanes: int | str, threads: int) -> None:
    plain = [PlainFollow(seed, current) for seed in range(ROWS)]
    envs = mjenv.make_vec("tests/Follow-v0", ROWS, current=current, lanes=lanes, num_threads=threads)
    other = mjenv.make_vec("tests/Follow-v0", ROWS, current=current, lanes=0)
    assert envs.single_action_space == other.single_action_space
    assert envs.single_action_space.shape == (2,)
    assert (envs.single_action_space.low == -1).all()
    other.reset(seed=99)
    rng = np.random.default_rng(3)
    for episode in range(2):
        got, _ = envs.reset(seed=list(range(ROWS)) if episode == 0 else None)
        for row in plain:
            row.reset()
        np.testing.assert_array_equal(got, [row.observed() for row in plain])
        for step in range(30):
            action = rng.uniform(-1, 1, (ROWS, 2))
            for row, of_row in zip(plain, action, strict=True):
                row.step(of_row)
            want = [row.observed() for row in plain]
            got, reward, _, _, infos = envs.step(action)
            np.testing.assert_array_equal(got, want)
            np.testing.assert_array_equal(reward, action.sum(axis=1))
            np.testing.assert_array_equal(infos["speed"], [row.data.qvel[0] for row in plain])
            if step == 12:
                other.restore(envs.snapshot())
                np.testing.assert_array_equal(other.observe(), want)
                envs, other = other, envs
            if step == 20:
                envs.copy_row(0, np.arange(ROWS) == ROWS - 1)
                plain[-1] = copy.deepcopy(plain[0])
                np.testing.assert_array_equal(envs.observe(), [*want[:-1], want[0]])
    action = rng.uniform(-1, 1, (ROWS, 5, 2))
    *_, played = envs.rollout(action, observations=True)
    for step in range(5):
        for row, of_row in zip(plain, action[:, step], strict=True):
            row.step(of_row)
        np.testing.assert_array_equal(played[:, step], [row.observed() for row in plain])
    envs.close()
    other.close()


TERRAIN = Path(__file__).resolve().parent.parent / "tasks" / "terrain.xml"
mjenv.load_tasks(Path(os.environ["MJENV_LIBRARY"]).parent / "tests" / "tasks" / "libterrain.so")


AROUND = [(0.3, 0.1), (-0.2, 0.4), (9.0, -7.0)]


class PlainTerrain:
    """One row of it, with mujoco's own calls."""

    def __init__(self, seed: int) -> None:
        self.rng, self.random_state = np.random.default_rng(seed), np.random.RandomState(seed)
        self.model = mujoco.MjModel.from_xml_path(str(TERRAIN))
        self.data = mujoco.MjData(self.model)

    def reset(self) -> None:
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        forward_without_actuation(model, data)
        heights = self.random_state.permutation(30) / 30
        self.random_state.shuffle(heights[:7])
        model.hfield_data[:] = heights
        model.geom_rgba[0, 0] = self.random_state.choice(5) / 10
        model.geom_rgba[1, 0] = np.float64(model.geom_rgba[1, 0]) + 0.01
        data.qpos[0] = self.random_state.uniform(-1, 1)
        forward_without_actuation(model, data)
        while not data.ncon:
            mujoco.mj_step2(model, data)
            mujoco.mj_step1(model, data)
        self.touched, data.time = data.xpos[1, 2] - self.height(*data.xpos[1, :2]), 0
        self.air = self.flight = 0.0
        forward_without_actuation(model, data)

    def height(self, x: float, y: float) -> float:
        """By a ray from above, which has to hit the field."""
        x, y = (min(max(p, 1e-9 - 2), 2 - 1e-9) for p in (x, y))
        down, above = np.array([0.0, 0.0, -1.0]), np.array([x, y, 9.0])
        function = getattr(mujoco, "mj_rayHfield", None) or mujoco.mj_rayHField
        found = function(self.model, self.data, 0, above, down)
        distance = found if np.isscalar(found) else found[0]
        assert distance > 0
        return float(9 - distance)

    def touches(self) -> bool:
        return any({c.geom1, c.geom2} == {0, 1} and c.dist <= 0 for c in self.data.contact[: self.data.ncon])

    def heights(self) -> list[float]:
        (x, y, _), mat = self.data.xpos[1], self.data.xmat[1]
        points = [(x, y), *((x + mat[0] * u + mat[1] * v, y + mat[3] * u + mat[4] * v) for u, v in AROUND)]
        return [self.height(*point) for point in points]

    def step(self, action: NDArray[Any]) -> None:
        model, data = self.model, self.data
        data.ctrl[:] = action
        mujoco.mj_step(model, data, 4)
        mujoco.mj_step1(model, data)
        at = self.rng.integers(0, 30)
        model.hfield_data[at] = self.rng.random()
        self.flight, self.air = (self.air, 0.0) if self.touches() else (0.0, self.air + 4 * model.opt.timestep)

    def observed(self) -> NDArray[Any]:
        """Without what is computed from heights, which a ray finds with other rounding."""
        model, data = self.model, self.data
        numbers = [self.touches(), self.air]
        return np.concatenate(
            [data.qpos, data.qvel, model.hfield_data, model.geom_rgba.reshape(-1), numbers], dtype=np.float64
        )


def check_terrain(got: NDArray[Any], plain: list[PlainTerrain]) -> None:
    np.testing.assert_array_equal(np.delete(got, [44, *range(47, 51)], axis=1), [row.observed() for row in plain])
    np.testing.assert_allclose(got[:, 47:], [row.heights() for row in plain], rtol=0, atol=1e-6)


def check_own_arrays(id: str) -> None:
    plain = [PlainTerrain(seed) for seed in range(ROWS)]
    envs = mjenv.make_vec(id, ROWS, autoreset_mode="disabled")
    other = mjenv.make_vec(id, ROWS, autoreset_mode="disabled")
    rng, flights = np.random.default_rng(5), 0
    for episode in range(2):
        got, _ = envs.reset(seed=list(range(ROWS)) if episode == 0 else None)
        for row in plain:
            row.reset()
        check_terrain(got, plain)
        np.testing.assert_allclose(got[:, 44], [row.touched for row in plain], rtol=0, atol=1e-6)
        for step in range(20):
            action = rng.uniform(-1, 1, (ROWS, 2))
            for row, of_row in zip(plain, action, strict=True):
                row.step(of_row)
            got, _, _, _, infos = envs.step(action)
            check_terrain(got, plain)
            np.testing.assert_array_equal(infos["flight"], [row.flight for row in plain])
            flights += int((infos["flight"] > 0).sum())
            if step == 8:
                other.restore(envs.snapshot())
                np.testing.assert_array_equal(other.observe(), got)
    assert flights > 0
    envs.close()
    other.close()


def test_own_arrays_of_float32() -> None:
    check_own_arrays("tests/Terrain-v0")
