"""physics.model.ptr and physics.data.ptr: what functions of MuJoCo's package read and write in them."""

from __future__ import annotations

import copy
import sys
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from test_physics import UNCOMPARED
from test_suite import assert_same_step, pair

import mjenv
from compiled_model import differences, fields
from conftest import actions
from mjenv_dm_control import suite as ours


# Tasks whose resets change the model: springs, tendons, the ground.
@pytest.mark.parametrize("task", [("lqr", "lqr_6_2"), ("point_mass", "hard"), ("quadruped", "escape")], ids="-".join)
def test_model(task: tuple[str, str]) -> None:
    envs = pair(task, 0)
    for _ in range(2):
        got, want = (fields(env.physics.model.ptr) for env in envs)
        assert differences(got, want) == []
        for env in envs:
            env.reset()
    compiled = mujoco.MjModel.from_xml_string(mjenv.model_xml(f"dm_control/{'-'.join(task)}-v0"))
    assert differences(got, fields(compiled)) != []


@pytest.mark.parametrize(
    "task", [("humanoid", "walk"), ("quadruped", "fetch"), ("manipulator", "bring_peg")], ids="-".join
)
def test_data(task: tuple[str, str]) -> None:
    envs = pair(task, 3)
    got, want = (env.physics.data.ptr for env in envs)
    compared = 0
    for name in dir(envs[0].physics.data):
        wanted = getattr(want, name, None)
        if isinstance(wanted, float | np.ndarray) and not name.startswith(UNCOMPARED):
            np.testing.assert_array_equal(getattr(got, name), wanted, name)
            compared += 1
    assert compared > 50
    assert got.ncon == want.ncon
    assert got.ncon > 0 or task[0] != "quadruped"
    # MuJoCo 2.2.2 has normalised quaternions once more before it finds these contacts.
    for mine, wanted in zip(got.contact[: got.ncon], want.contact[: want.ncon], strict=True):
        assert (mine.geom1, mine.geom2) == (wanted.geom1, wanted.geom2)
        np.testing.assert_allclose(mine.pos, wanted.pos, atol=1e-12)


def test_identity() -> None:
    """The objects stay the same, also through resets: programs compare them to learn whether the model was replaced."""
    env = ours.load("cheetah", "run", {"random": 1})
    model, data = env.physics.model.ptr, env.physics.data.ptr
    env.reset()
    env.step(np.ones(6))
    assert env.physics.model.ptr is model
    assert env.physics.data.ptr is data
    assert data.time == env.physics.time() > 0


def push(physics: Any) -> None:
    physics.data.ptr.xfrc_applied[1] = [200, 0, 300, 0, 5, 0]


def move(physics: Any) -> None:
    """Moves and turns the root, with a quaternion that is not normalised."""
    data = physics.data.ptr
    data.qpos[:7] = [1, 2, 3, 0.9, 0.3, -0.2, 0.1]
    mujoco.mj_forward(physics.model.ptr, data)


def accelerate(physics: Any) -> None:
    data = physics.data.ptr
    data.qvel[:] += 0.5
    data.time = 7
    mujoco.mj_forward(physics.model.ptr, data)


def forward(physics: Any) -> None:
    """Writes to qacc_warmstart and, in MuJoCo 2.2.2, the last bits of quaternions."""
    for _ in range(3):
        mujoco.mj_forward(physics.model.ptr, physics.data.ptr)


def step(physics: Any) -> None:
    mujoco.mj_step(physics.model.ptr, physics.data.ptr)
    mujoco.mj_forward(physics.model.ptr, physics.data.ptr)


def turn_and_push(physics: Any) -> None:
    move(physics)
    push(physics)
    physics.data.xfrc_applied[2] = [0, 0, 10, 0, 0, 0]


@pytest.mark.parametrize("write", [push, move, accelerate, forward, step, turn_and_push])
def test_writes(write: Callable[[Any], None]) -> None:
    """What is written to data.ptr acts on the next step, as in dm_control."""
    envs = pair(("humanoid", "walk"), 3)
    draw = actions(envs[1], 4)
    for _ in range(5):
        for env in envs:
            write(env.physics)
        for name in ("time", "qpos", "qvel", "qacc_warmstart", "xfrc_applied", "xpos", "cvel"):
            mine, wanted = (getattr(env.physics.data, name) for env in envs)
            np.testing.assert_array_equal(mine, wanted, name)
        action = draw()
        assert_same_step(*(env.step(action) for env in envs))
        np.testing.assert_array_equal(*(env.physics.state() for env in envs))
    for env in envs:
        write(env.physics)
    assert_same_step(*(env.reset() for env in envs))  # which clears what was written
    assert_same_step(*(env.step(action) for env in envs))


def test_other_readers() -> None:
    """Observations, pictures and copies of the simulation see what was written, too."""
    envs = pair(("humanoid", "walk"), 3)
    readers = [
        lambda env: env.task.get_observation(env.physics)["velocity"],
        lambda env: env.physics.render(48, 64),
        lambda env: env.physics.copy().position(),
        lambda env: env.physics.data.ptr.qpos.copy(),
        lambda env: env.physics.named.data.xpos["torso"],
        lambda env: env.physics.data.body("torso").xpos if env is envs[0] else env.physics.named.data.xpos["torso"],
    ]
    for number, read in enumerate(readers):
        before = read(envs[0]).tolist()
        for env in envs:
            env.physics.data.ptr.qvel[:] = number + 1
            env.physics.data.ptr.qpos[:3] = number + 1
            mujoco.mj_forward(env.physics.model.ptr, env.physics.data.ptr)
        assert read(envs[0]).tolist() == read(envs[1]).tolist() != before
    envs[0].physics.data.ptr.qpos[0] = 9
    assert copy.deepcopy(envs[0]).physics.data.qpos[0] == 9


def test_buffer() -> None:
    """The size of the buffer for pictures, which programs enlarge. physics.render does not need it."""
    physics = ours.load("cheetah", "run").physics
    physics.model.vis.global_.offwidth = 1000
    assert physics.model.vis.global_.offwidth == physics.model.ptr.vis.global_.offwidth == 1000
    physics.model.vis.global_.offheight = 900
    assert physics.model.vis.global_.offheight == physics.model.ptr.vis.global_.offheight == 900
    with pytest.raises(mjenv.errors.UnknownNameError, match="only for drawing"):
        physics.model.vis.global_.azimuth = 10
    with pytest.raises(TypeError):
        physics.model.vis.global_.offwidth = 10.5


def test_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    physics = ours.load("cheetah", "run").physics
    engine = mjenv.engine().name
    monkeypatch.setattr(mujoco, "__version__", "3.1.0")
    with pytest.raises(ImportError, match=rf'need pip install "mujoco=={engine}\.\*", not 3\.1\.0: mjenv computes'):
        _ = physics.model.ptr
    monkeypatch.undo()
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ImportError, match=rf'physics\.data\.ptr need pip install "mujoco=={engine}\.\*" \(import of'):
        _ = physics.data.ptr
    assert physics.data.xpos.shape == (8, 3)
    monkeypatch.undo()
    assert physics.data.ptr.nefc >= 0
    if engine == "2.2.2":
        monkeypatch.setattr(np, "__version__", "2.2.6")
        with pytest.raises(ImportError, match=r'"numpy<2": with NumPy 2\.2\.6, this mujoco reads its arrays wrongly'):
            _ = ours.load("cheetah", "run").physics.data.ptr
