"""Kicks, contacts, time in the air and heights of a terrain, in NumPy, against the same in C++."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mjenv
from mjenv.task.locomotion import Terrain, air_time, touching
from test_walk import FEET, FOLDER, GROUND, KICKS, POINTS, ROWS, TRUNK


class Walk(mjenv.Task):
    """The same task in NumPy."""

    model = str(FOLDER / "rough.xml")
    frame_skip = 2
    time_limit = 60
    needs = ("qpos", "qvel", "xpos", "xmat", "contacts")
    max_contacts = 24
    state = {"air": (4,), "flights": (4,)}  # noqa: RUF012

    def build(self, model: Any) -> None:
        self.terrain = Terrain(model, "ground")

    def reset(self, rng: Any, rows: int) -> tuple[Any, ...]:
        qpos = np.tile(self.qpos0, (rows, 1))
        qpos[:, 0], qpos[:, 1], qpos[:, 2] = rng.uniform(-20, 20, rows), rng.uniform(-10, 10, rows), 0.6
        qpos[:, 3:] += rng.uniform(-0.1, 0.1, (rows, 16))
        return qpos, np.zeros((rows, self.nv)), {"air": np.zeros((rows, 4)), "flights": np.zeros((rows, 4))}

    def observe(self, sim: Any) -> NDArray[Any]:
        height = self.terrain.height(sim.qpos[:, 0], sim.qpos[:, 1])[:, None]
        around = self.terrain.around(sim.xpos[:, TRUNK], sim.xmat[:, TRUNK], POINTS)
        touches = touching(sim, FEET, GROUND)
        return np.concatenate([sim.qpos, sim.qvel, touches, sim.air, sim.flights, height, around], axis=1)

    def step(self, sim: Any, action: NDArray[Any]) -> tuple[Any, ...]:
        rows, speed = len(action), sim.qvel[:, 0].copy()
        sim.flights[...] = air_time(sim.air, touching(sim, FEET, GROUND), self.dt)
        kicked, kick = sim.rng.random(rows) < KICKS, sim.rng.uniform(-0.5, 0.5, (rows, 6))
        sim.kick[kicked, :6] = kick[kicked]
        listed = (np.arange(24) < sim.ncon.reshape(-1, 1))[:, :, None]
        return speed, np.zeros(rows, bool), {"kicked": kicked, "force": np.where(listed, sim.contact.force, 0)}


class CurrentWalk(Walk):
    current = True


mjenv.register("tests/NumpyWalk-v0", Walk)
mjenv.register("tests/NumpyCurrentWalk-v0", CurrentWalk)


@pytest.mark.parametrize(("lanes", "threads"), [(0, 1), ("auto", 2)])
@pytest.mark.parametrize("current", [False, True])
def test_walk(current: bool, lanes: int | str, threads: int) -> None:
    """tests/live compares that in C++ with mujoco's own calls, and contact.force with mj_contactForce."""
    options: dict[str, Any] = {"num_threads": threads, "lanes": lanes}
    envs = mjenv.make_vec("tests/Walk-v0", ROWS, current=current, arrays="contact.force", max_contacts=24, **options)
    numpy = mjenv.make_vec("tests/NumpyCurrentWalk-v0" if current else "tests/NumpyWalk-v0", ROWS, **options)
    rng, kicks, flights, touched = np.random.default_rng(3), 0, 0, 0
    for episode in range(2):
        seeds = list(range(ROWS)) if episode == 0 else None
        got, _ = envs.reset(seed=seeds)
        same, _ = numpy.reset(seed=seeds)
        np.testing.assert_array_equal(same, got)
        for step in range(59):
            action = rng.uniform(-1, 1, (ROWS, 12))
            got, reward, _, _, infos = envs.step(action)
            same, same_reward, _, _, same_infos = numpy.step(action)
            np.testing.assert_array_equal(same, got)
            np.testing.assert_array_equal(same_reward, reward)
            np.testing.assert_array_equal(same_infos["kicked"], infos["kicked"])
            np.testing.assert_array_equal(same_infos["force"], envs.arrays["contact.force"])
            kicks += int(infos["kicked"].sum())
            flights += int((got[:, -9:-5] > 0).sum())
            touched += int((same_infos["force"] != 0).any(axis=(1, 2)).sum())
            if step == 30:  # rows go on from images
                for each in (envs, numpy):
                    each.restore(each.snapshot())
                    each.copy_row(0, np.arange(ROWS) == ROWS - 1)
    assert kicks > 50
    assert flights > 10
    assert (touched > 10) != current  # the next mj_step computes the forces of the contacts in the new state
    envs.close()
    numpy.close()


def test_refusal() -> None:
    turned = (FOLDER / "rough.xml").read_text().replace('<geom name="ground"', '<geom name="ground" euler="0 0 1"')
    (FOLDER / "turned-numpy.xml").write_text(turned)
    with pytest.raises(mjenv.InvalidValueError, match="not turned"):
        mjenv.make("tests/NumpyWalk-v0", xml_file=str(FOLDER / "turned-numpy.xml"))


def test_more_contacts_than_there_is_room_for() -> None:
    envs = mjenv.make_vec("tests/NumpyWalk-v0", 2, max_contacts=1)

    def play() -> None:
        envs.reset(seed=1)
        for _ in range(40):
            envs.step(np.zeros((2, 12)))

    with pytest.raises(mjenv.InvalidValueError, match=r"row \d has \d+ contacts, but the task has room for 1"):
        play()
