"""Kicks, contacts, time in the air and heights of a terrain, in C++, against mujoco's own calls."""

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

FOLDER = Path(os.environ["MJENV_LIBRARY"]).parent / "tests" / "tasks"
mjenv.load_tasks(FOLDER / "libwalk.so")
MODEL = mujoco.MjModel.from_xml_path(str(FOLDER / "rough.xml"))
ROWS, DT, KICKS = 5, 0.02, 0.2
POINTS = [(0.0, 0.0), (0.3, 0.1), (-0.2, 0.15), (5.0, -7.0)]
TRUNK, GROUND, *FEET = (
    mujoco.mj_name2id(MODEL, kind, name)
    for kind, name in [
        (mujoco.mjtObj.mjOBJ_BODY, "trunk"),
        *((mujoco.mjtObj.mjOBJ_GEOM, name) for name in ("ground", "fl_foot", "fr_foot", "rl_foot", "rr_foot")),
    ]
)


class Plain:
    """One row of the task in tests/tasks/walk.cpp, with mujoco's own calls."""

    def __init__(self, seed: int, current: bool) -> None:
        self.rng, self.current, self.data = np.random.default_rng(seed), current, mujoco.MjData(MODEL)

    def reset(self) -> None:
        data, rng = self.data, self.rng
        mujoco.mj_resetData(MODEL, data)
        if self.current:
            mujoco.mj_forward(MODEL, data)
        data.qpos[:3] = rng.uniform(-20, 20), rng.uniform(-10, 10), 0.6
        data.qpos[3:] += rng.uniform(-0.1, 0.1, 16)
        self.qpos = data.qpos.copy()
        mujoco.mj_forward(MODEL, data)
        if not self.current:
            self.qpos = data.qpos.copy()
        self.air, self.flights = np.zeros(4), np.zeros(4)

    def step(self, action: NDArray[Any]) -> None:
        data = self.data
        data.qpos[:], data.ctrl[:] = self.qpos, action
        for _ in range(2):
            mujoco.mj_step(MODEL, data)
        self.qpos = data.qpos.copy()
        if self.current:
            mujoco.mj_step1(MODEL, data)
        for i, touches in enumerate(self.touching()):
            self.flights[i] = self.air[i] if touches else 0
            self.air[i] = 0 if touches else self.air[i] + DT
        self.kicked, kick = self.rng.random() < KICKS, self.rng.uniform(-0.5, 0.5, 6)
        if self.kicked:
            data.qvel[:6] += kick

    def touching(self) -> list[bool]:
        pairs = [{c.geom1, c.geom2} for c in self.data.contact[: self.data.ncon] if c.dist <= 0]
        return [{foot, GROUND} in pairs for foot in FEET]

    def observed(self) -> NDArray[Any]:
        return np.concatenate([self.data.qpos, self.data.qvel, self.touching(), self.air, self.flights])

    def height(self, x: float, y: float) -> float:
        """By a ray from above, which has to hit the field."""
        size, at = MODEL.hfield_size[0], MODEL.geom_pos[GROUND]
        x, y = (min(max(p, c - r + 1e-9), c + r - 1e-9) for p, c, r in zip((x, y), at, size, strict=False))
        down, above = np.array([0.0, 0.0, -1.0]), np.array([x, y, 9.0])
        function = getattr(mujoco, "mj_rayHfield", None) or mujoco.mj_rayHField
        found = function(MODEL, self.data, GROUND, above, down)
        distance = found if np.isscalar(found) else found[0]
        assert distance > 0
        return float(9 - distance)

    def heights(self) -> list[float]:
        (x, y, _), mat = self.data.xpos[TRUNK], self.data.xmat[TRUNK]
        yaw = np.arctan2(mat[3], mat[0])
        cos, sin = np.cos(yaw), np.sin(yaw)
        around = [self.height(x + cos * u - sin * v, y + sin * u + cos * v) for u, v in POINTS]
        return [self.height(*self.data.qpos[:2]), *around]


@pytest.mark.parametrize(("lanes", "threads"), [(0, 1), ("auto", 2)])
@pytest.mark.parametrize("current", [False, True])
def test_walk(current: bool, lanes: int | str, threads: int) -> None:
    plain = [Plain(seed, current) for seed in range(ROWS)]
    options: dict[str, Any] = {"num_threads": threads, "lanes": lanes}
    envs = mjenv.make_vec("tests/Walk-v0", ROWS, current=current, **options)
    other = mjenv.make_vec("tests/Walk-v0", ROWS, current=current, lanes=0)
    rng, kicks, flights = np.random.default_rng(3), 0, 0
    for episode in range(2):
        seeds = list(range(ROWS)) if episode == 0 else None
        got, _ = envs.reset(seed=seeds)
        for row in plain:
            row.reset()
        np.testing.assert_array_equal(got[:, :-5], [row.observed() for row in plain])
        for step in range(59):
            action = rng.uniform(-1, 1, (ROWS, 12))
            for row, of_row in zip(plain, action, strict=True):
                row.step(of_row)
            got, _, _, _, infos = envs.step(action)
            want = np.array([row.observed() for row in plain])
            np.testing.assert_array_equal(got[:, :-5], want)
            np.testing.assert_allclose(got[:, -5:], [row.heights() for row in plain], rtol=0, atol=1e-6)
            np.testing.assert_array_equal(infos["kicked"], [row.kicked for row in plain])
            kicks += int(infos["kicked"].sum())
            flights += int((want[:, -4:] > 0).sum())
            if step == 30:  # rows go on from images
                other.restore(envs.snapshot())
                np.testing.assert_array_equal(other.observe(), got)
                envs, other = other, envs
                envs.copy_row(0, np.arange(ROWS) == ROWS - 1)
                plain[-1] = copy.deepcopy(plain[0])
    assert kicks > 50
    assert flights > 10
    for each in (envs, other):
        each.close()


def test_a_kicked_row_is_the_same_in_each_computation() -> None:
    """What is read of a kicked row does not depend on which row the work space holds."""
    envs = mjenv.make_vec("tests/Walk-v0", 3, kicks=1.0, arrays="qvel cvel")
    envs.reset(seed=1)
    envs.step(np.zeros((3, 12)))
    exported = [envs.arrays[name].copy() for name in ("qvel", "cvel")]
    for _ in range(2):
        for row in (2, 0, 1):
            np.testing.assert_array_equal(envs.data.qvel[row], exported[0][row])
            np.testing.assert_array_equal(envs.data.cvel[row], exported[1][row])
    image = envs.snapshot(1)
    envs.restore(image, 2)
    np.testing.assert_array_equal(envs.data.qvel[2], exported[0][1])
    np.testing.assert_array_equal(envs.snapshot(2), image)


def test_refusals() -> None:
    with pytest.raises(mjenv.Error, match=r'"floor" is no height field'):
        mjenv.make("tests/Walk-v0", terrain="floor")
    turned = (FOLDER / "rough.xml").read_text().replace('<geom name="ground"', '<geom name="ground" euler="0 0 1"')
    (FOLDER / "turned.xml").write_text(turned)
    with pytest.raises(mjenv.Error, match="not turned"):
        mjenv.make("tests/Walk-v0", xml_file=str(FOLDER / "turned.xml"))


def test_room_for_contacts_in_exported_arrays() -> None:
    """The first contacts of each row, as in an environment without the option."""
    arrays = "ncon contact.dist contact.force"
    few, all_ = mjenv.make_vec("Ant-v5", 3, arrays=arrays, max_contacts=2), mjenv.make_vec("Ant-v5", 3, arrays=arrays)
    for envs in (few, all_):
        envs.reset(seed=2)
    rng = np.random.default_rng(0)
    for _ in range(60):
        action = rng.uniform(-1, 1, (3, 8))
        few.step(action)
        all_.step(action)
        assert few.arrays["contact.force"].shape == (3, 2, 6)
        np.testing.assert_array_equal(few.arrays["ncon"], all_.arrays["ncon"])
        for name in ("contact.dist", "contact.force"):
            np.testing.assert_array_equal(few.arrays[name], all_.arrays[name][:, :2])
    assert (few.arrays["contact.force"][:, :, 0] > 0).any()
