"""Models in today's MJCF (examples/models), against MuJoCo's own mj_step, bit for bit. MuJoCo 2.2.2 refuses them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from gymnasium.envs.mujoco.mujoco_rendering import OffScreenViewer

import mjenv

MODELS = Path(__file__).resolve().parents[2] / "examples" / "models"
NAMES = ("quadruped", "arm", "hand")
ROWS, STEPS, FRAME_SKIP = 3, 300, 2
# How much of the actuators' ranges the controls of each row use.
SHARES = (1.0, 0.3, 0.0)
ARRAYS = ("qpos", "qvel", "act", "qacc", "qacc_warmstart", "xpos", "xquat", "site_xpos", "sensordata", "actuator_force")


def path_of(name: str) -> str:
    return str(MODELS / f"{name}.xml")


def starts(model: Any) -> list[tuple[np.ndarray, np.ndarray]]:
    """The qpos and qvel from which the rows begin: the model's own state, and two others."""
    rng = np.random.default_rng(5)
    data = mujoco.MjData(model)
    found = [(data.qpos.copy(), data.qvel.copy())]
    for _ in range(ROWS - 1):
        velocity = rng.uniform(-0.3, 0.3, model.nv)
        mujoco.mj_resetData(model, data)
        mujoco.mj_integratePos(model, data.qpos, velocity, 0.2)
        found.append((data.qpos.copy(), velocity))
    return found


def drawn(rng: np.random.Generator, model: Any) -> np.ndarray:
    """Controls for each row, some of them outside of their range."""
    low, high = model.actuator_ctrlrange.T
    middle, half = (low + high) / 2, (high - low) / 2
    return np.array([middle + share * half * rng.uniform(-1.2, 1.2, model.nu) for share in SHARES])


def same(what: object, ours: np.ndarray, theirs: np.ndarray) -> None:
    assert ours.tobytes() == np.ascontiguousarray(theirs).tobytes(), what


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("threads", [1, 2])
def test_equals_mj_step(name: str, threads: int) -> None:
    model = mujoco.MjModel.from_xml_path(path_of(name))
    plain = [mujoco.MjData(model) for _ in range(ROWS)]
    arrays = [array for array in ARRAYS if getattr(plain[0], array).size]
    envs = mjenv.make_vec(
        "Model-v0",
        ROWS,
        engine="4.0",
        xml_file=path_of(name),
        frame_skip=FRAME_SKIP,
        num_threads=threads,
        arrays=" ".join(arrays),
    )
    envs.reset(seed=1)
    for data, (qpos, qvel) in zip(plain, starts(model), strict=True):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_forward(model, data)
    envs.set_state([data.qpos for data in plain], [data.qvel for data in plain])

    rng, contacts, image, saved = np.random.default_rng(8), 0, b"", []
    for step in range(STEPS):
        if step == STEPS // 3:
            image, saved = envs.snapshot(), [drawn(rng, model) for _ in range(20)]
            ahead = [envs.step(actions)[0] for actions in saved]
            envs.restore(image)
            again = [envs.step(actions)[0] for actions in saved]
            same("after restore", np.array(again), np.array(ahead))
            envs.restore(image)
        actions = drawn(rng, model)
        observed = envs.step(actions)[0]
        for row, data in enumerate(plain):
            data.ctrl[:] = actions[row]
            mujoco.mj_step(model, data, FRAME_SKIP)
            contacts += data.ncon
            same((step, row), observed[row], np.concatenate([data.qpos, data.qvel]))
            for array in arrays:
                same((step, row, array), envs.arrays[array][row], getattr(data, array))
    assert contacts > STEPS
    assert not any(data.warning[kind].number for data in plain for kind in range(len(data.warning)))


@pytest.mark.parametrize("name", NAMES)
def test_the_cheetahs_task_takes_them(name: str) -> None:
    env = mjenv.make("HalfCheetah-v5", engine="4.0", xml_file=path_of(name), reset_noise_scale=0)
    model = mujoco.MjModel.from_xml_path(path_of(name))
    data = mujoco.MjData(model)
    assert env.observation_space.shape == (model.nq + model.nv - 1,)
    env.reset(seed=1)
    mujoco.mj_forward(model, data)
    rng = np.random.default_rng(2)
    for step in range(100):
        action = drawn(rng, model)[1].astype(np.float32)
        before = data.qpos[0]
        data.ctrl[:] = action
        mujoco.mj_step(model, data, 5)
        observed, _, _, _, info = env.step(action)
        same(step, observed, np.concatenate([data.qpos[1:], data.qvel]))
        assert info["x_velocity"] == (data.qpos[0] - before) / env.unwrapped.dt


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_equals_gymnasiums(name: str) -> None:
    size = 120
    drawn = {"render_mode": "rgb_array", "width": size, "height": size, "camera_name": "track"}
    env = mjenv.make("Model-v0", engine="4.0", xml_file=path_of(name), **drawn)
    model = mujoco.MjModel.from_xml_path(path_of(name))
    data = mujoco.MjData(model)
    env.reset(seed=1)
    mujoco.mj_forward(model, data)
    for _ in range(10):
        data.ctrl[:] = 0.1
        mujoco.mj_step(model, data)
        env.step(np.full(model.nu, 0.1))
    picture = env.render()
    viewer = OffScreenViewer(model, data, size, size)
    expected = viewer.render("rgb_array", camera_id=model.camera("track").id)
    viewer.close()
    assert picture.shape == (size, size, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100
    same("the picture", picture, expected)


@pytest.mark.parametrize("name", NAMES)
def test_mujoco_2_names_the_engine_that_they_need(name: str) -> None:
    needed = r"; this is MuJoCo 2\.2\.2; if a newer MuJoCo knows it, load .* engine=\"4\.0\" in Python"
    with pytest.raises(mjenv.ModelError, match=needed):
        mjenv.make("Model-v0", engine="2.2.2", xml_file=path_of(name))
