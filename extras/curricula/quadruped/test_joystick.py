"""Tests of QuadrupedJoystick-v0 and its twin in NumPy."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from numpy.typing import NDArray

import mjenv
from mjenv_command.policies import policy_of
from mjenv_learn.policy import Policy

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE))

import joystick  # noqa: E402
import terrain  # noqa: E402
from evaluate_joystick import evaluate  # noqa: E402
from joystick_options import ID, OPTIONS  # noqa: E402
from train_joystick import SETTINGS  # noqa: E402

FRICTION, MASS, KP = -3, -2, -1  # in the critic's observation


def test_gymnasium_accepts_it() -> None:
    check_env(gymnasium.make(f"mjenv/{ID}").unwrapped, skip_render_check=True)


def test_it_follows_its_commands_on_rough_ground(engine: str) -> None:
    """What docs/tasks/quadruped.md states about the committed policy: 20 episodes, the mean over all of their steps."""
    assert evaluate(Policy.load(HERE / "joystick" / "policy.txt"), engine=engine).error < 0.2


def test_its_policy_acts_on_observations_as_they_are(engine: str) -> None:
    env, envs = (make(ID, engine=engine, **OPTIONS) for make in (mjenv.make, mjenv.make_vec))
    act = policy_of(HERE / "joystick" / "policy.txt", env, "PPO", None)  # what mjenv play and mjenv view call
    obs, many = env.reset(seed=3)[0], envs.reset(seed=3)[0]
    assert set(obs) == {"policy", "critic"}
    assert act(obs).shape == (12,)
    assert_same(act(many), act(obs)[None])


def test_it_does_not_without_the_policy(engine: str) -> None:
    envs = mjenv.make_vec(ID, 20, engine=engine)
    envs.reset(seed=1000)
    for _ in range(100):
        *_, infos = envs.step(np.zeros((20, 12)))
    assert infos["error"].mean() > 0.25


def assert_same(got: NDArray[Any], expected: NDArray[Any]) -> None:
    assert np.asarray(got, np.float64).tobytes() == np.asarray(expected, np.float64).tobytes()


@pytest.mark.parametrize("of_training", [{}, OPTIONS], ids=["plain", "of_the_training"])
@pytest.mark.parametrize("threads", [1, 2])
def test_the_twin_in_numpy_has_equal_bits(engine: str, threads: int, of_training: dict[str, Any]) -> None:
    """Also with histories, noise, delays, pushes and robots that differ."""
    options: dict[str, Any] = {"autoreset_mode": "same_step", "max_episode_steps": 40, "num_threads": threads}
    options |= {"engine": engine, **of_training}
    cpp, numpy = (mjenv.make_vec(id, 6, **options) for id in (ID, joystick.ID))
    both = [envs.reset(seed=3)[0] for envs in (cpp, numpy)]
    rng, compared = np.random.default_rng(0), 0
    for step in range(90):
        for group in both[0]:
            assert_same(both[1][group], both[0][group])
        if step == 30:
            for envs in (cpp, numpy):
                envs.parameters["command_forward"][:] = [0.5, 0.8]
                envs.parameters["least_level"][:3] = 3
        if step == 50:  # rows go on from images
            for envs in (cpp, numpy):
                envs.restore(envs.snapshot())
        action = rng.uniform(-1, 1, (6, 12)) * (step % 20 > 10)
        results = [envs.step(action.astype(np.float32) if step % 2 else action) for envs in (cpp, numpy)]
        both = [result[0] for result in results]
        for got, expected in zip(results[1][1:4], results[0][1:4], strict=True):
            assert_same(got, expected)
        told, expected_told = results[1][4], results[0][4]
        assert set(told) == set(expected_told)  # without infos if all episodes have ended
        for name in ("error", "level", "reward_air", "reward_gait", "reward_torque"):
            if name in told:
                assert_same(told[name], expected_told[name])
                compared += 1
    assert compared > 400


def test_the_twin_learns_the_same_policy(engine: str) -> None:
    cpp, numpy = (
        mjenv.train(id, steps=3 * 4096, settings=SETTINGS, engine=engine, **OPTIONS).policy()
        for id in (ID, joystick.ID)
    )
    assert cpp == replace(numpy, id=ID)


def test_commands_change_in_an_episode_and_can_be_set() -> None:
    envs = mjenv.make_vec(ID, 20, command_seconds=0.2, strict=False)
    envs.reset(seed=1)
    commands = np.array([envs.step(np.zeros((20, 12)))[0]["policy"][:, 45:48] for _ in range(60)])
    assert len(np.unique(commands[:, 0, 0])) > 2
    assert commands[..., 0].min() < -0.3
    assert commands[..., 0].max() > 0.7
    envs.parameters["command_forward"][:10] = [0.1, 0.1]
    for _ in range(100):
        obs, *_ = envs.step(np.zeros((20, 12)))
    assert (obs["policy"][:10, 45] == 0.1).mean() > 0.8
    assert not (obs["policy"][10:, 45] == 0.1).any()


def test_levels_of_rows() -> None:
    """A row that follows its commands rises, one that falls does not; the levels stay over resets."""
    still = {"command_forward": (0, 0), "command_left": (0, 0), "command_turn": (0, 0)}
    envs = mjenv.make_vec(ID, 2, **still, most_level=2, autoreset_mode="same_step")
    envs.reset(seed=7)
    action, seen = np.zeros((2, 12)), []
    action[1] = 1  # row 1 falls
    for _ in range(1800):
        envs.step(action)
        seen.append(np.floor(envs.data.qpos[:, 0] / 6) + 3)  # the patch below the trunk
    standing, falling = np.array(seen).T
    assert [standing[step] for step in (400, 900, 1400, 1790)] == [0, 1, 2, 2]
    assert set(falling) == {0}


def test_options_of_the_training() -> None:
    """Resets draw robots that differ; kp is the same in both arrays."""
    envs = mjenv.make_vec(ID, 8, **OPTIONS)
    obs, _ = envs.reset(seed=1)
    envs.step(np.zeros((8, 12)))
    obs, *_ = envs.step(np.zeros((8, 12)))
    newest = obs["critic"][:, -1]
    assert obs["policy"].shape == (8, 3, 50)
    assert len(np.unique(newest[:, MASS])) == 8
    assert len(np.unique(newest[:, FRICTION])) == 8
    np.testing.assert_array_equal(newest[:, KP], envs.model.actuator_gainprm[:, 0, 0])
    np.testing.assert_array_equal(envs.model.actuator_biasprm[:, :, 1], -envs.model.actuator_gainprm[:, :, 0])


def test_the_ground_is_drawn_by_its_script() -> None:
    assert (HERE / "terrain.png").read_bytes() == terrain.picture()
