"""Model-v0, the physics of a model alone. tests/live/test_model.py compares its steps with MuJoCo."""

import re
from ctypes import c_float
from typing import Any

import gymnasium
import numpy as np
import pytest

import mjenv

PENDULUM = """<mujoco><worldbody><body pos="0 0 1"><joint axis="0 1 0"/><geom size="0.1" pos="0 0 0.3"/></body>
</worldbody></mujoco>"""


@pytest.mark.parametrize("make", [mjenv.make, mjenv.make_vec, gymnasium.make, gymnasium.make_vec])
def test_it_needs_a_model(make: Any) -> None:
    with pytest.raises(mjenv.InvalidValueError, match='set the option "xml_file" or "xml_string"'):
        make("mjenv/Model-v0")


def test_it_is_known_but_not_listed() -> None:
    assert "Model-v0" not in mjenv.ids()
    spec = mjenv.spec("Model-v0")
    assert (spec.max_episode_steps, spec.reward_threshold) == (None, None)
    assert gymnasium.spec("mjenv/Model-v0").max_episode_steps is None
    assert {"xml_file", "xml_string", "frame_skip", "trust_xml", "max_episode_steps", "arrays"} <= set(
        mjenv.options("Model-v0")
    )
    with pytest.raises(mjenv.UnknownIdError, match="nearest: Model-v0"):
        mjenv.spec("Modell-v0")
    with pytest.raises(mjenv.InvalidValueError, match="no default model"):
        mjenv.model_xml("Model-v0")


def test_a_model_without_actuators() -> None:
    env = gymnasium.make("mjenv/Model-v0", xml_string=PENDULUM, frame_skip=3)
    assert env.action_space.shape == (0,)
    obs, info = env.reset(seed=1)
    assert (obs.tolist(), info) == ([0, 0], {})
    env.unwrapped.set_state([0.1], [0])
    for _ in range(2000):
        obs, reward, terminated, truncated, info = env.step(np.zeros(0))
        assert (type(reward), reward, terminated, truncated, info) == (np.float64, 0, False, False, {})
    assert env.unwrapped.dt == 0.006
    assert env.unwrapped.data.qpos[0] == obs[0]


@pytest.mark.parametrize("make", [mjenv.make, mjenv.make_vec, gymnasium.make])
@pytest.mark.parametrize("timestep", ["0", "-1", "1e-320"])
def test_a_timestep_by_which_nobody_can_divide(make: Any, timestep: str) -> None:
    xml = PENDULUM.replace("<mujoco>", f'<mujoco><option timestep="{timestep}"/>')
    with pytest.raises(mjenv.ModelError, match="the timestep is"):
        make("mjenv/Model-v0", xml_string=xml)


def test_a_motor_without_ctrlrange() -> None:
    motors = '<motor joint="j"/><motor name="bounded" joint="j" ctrllimited="true" ctrlrange="-1 2"/>'
    xml = PENDULUM.replace("<joint", '<joint name="j"')
    xml = xml.replace("</mujoco>", f"<actuator>{motors}</actuator></mujoco>")
    env = mjenv.make_vec("Model-v0", 2, xml_string=xml)
    assert (env.single_action_space.low.tolist(), env.single_action_space.high.tolist()) == (
        [-np.inf, -1],
        [np.inf, 2],
    )
    with pytest.raises(mjenv.ModelError, match=r"actuator 0 \(j\) has infinite bounds.*give it a ctrlrange"):
        env._pool.rows.call(env._pool.rows.engine.mjenv_sample_actions, (c_float * 4)(), 4)
    # Gymnasium's space is that of the file, whatever the motor says.
    hopper = re.sub(r' ctrl(limited|range)="[^"]*"', "", mjenv.model_xml("Hopper-v5"))
    assert mjenv.make("Hopper-v5", xml_string=hopper).action_space.high.tolist() == [0, 0, 0]


def test_the_limit_is_an_option() -> None:
    envs = mjenv.make_vec("Model-v0", 2, xml_string=PENDULUM, max_episode_steps=4)
    envs.reset()
    assert [envs.step(np.zeros((2, 0)))[3].tolist() for _ in range(4)] == [[False] * 2] * 3 + [[True] * 2]
