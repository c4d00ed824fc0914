"""Tests of QuadrupedVelocity-v0."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from numpy.typing import NDArray

import mjenv
from mjenv_learn.policy import Policy

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE))

from evaluate import FORWARD, ID, evaluate, evaluate_all_commands  # noqa: E402


@pytest.fixture(scope="module")
def policy() -> Policy:
    return Policy.load(HERE / "policy.txt")


def test_gymnasium_accepts_it() -> None:
    check_env(gymnasium.make(f"mjenv/{ID}").unwrapped, skip_render_check=True)


def test_it_walks_as_commanded(policy: Policy) -> None:
    """What docs/tasks/quadruped.md states about the committed policy: 20 episodes, the mean over all of their steps."""
    result = evaluate(policy)
    assert result.falls == 0
    assert result.error < 0.05
    assert result.error_after_start < 0.05
    # The errors of the velocity at each moment do not hide a wrong mean.
    assert abs(result.mean_speed - 0.5) < 0.05


def test_it_follows_all_commands(policy: Policy) -> None:
    """The return of the policy is at least that of the one that train_cleanrl.py trained, 1,014."""
    played = evaluate_all_commands(policy)
    assert (played.lengths == 500).all()
    assert played.mean_return > 1014


def test_it_does_not_walk_without_the_policy() -> None:
    envs = mjenv.make_vec(ID, 20, **FORWARD)
    envs.reset(seed=1000)
    for _ in range(100):
        *_, infos = envs.step(np.zeros((20, 12)))
    assert infos["error"].mean() > 0.4


def rotation(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_observation_and_reward() -> None:
    env = mjenv.make(ID)
    env.reset(seed=3)
    stream, last = np.random.default_rng(0), np.zeros(12)
    for step in range(1, 21):
        action = stream.uniform(-1, 1, 12)
        obs, reward, _, _, info = env.step(action)
        qpos, qvel = env.data.qpos, env.data.qvel
        to_trunk = rotation(qpos[3:7] / np.linalg.norm(qpos[3:7])).T
        up, velocity, command = to_trunk[:, 2], to_trunk @ qvel[:3], obs[45:48]
        phase = 2 * np.pi * 0.02 * step / 0.5
        expected = [up, velocity, qvel[3:6], qpos[7:], qvel[6:], action, command, [np.cos(phase), np.sin(phase)]]
        np.testing.assert_allclose(obs, np.concatenate(expected), rtol=0, atol=1e-12)

        off = velocity[:2] - command[:2]
        feet = [env.data.site(f"{leg}_foot").xpos[2] - 0.022 for leg in ("fl", "fr", "rl", "rr")]
        swing = np.maximum(0, np.sin(phase + np.array([0, np.pi, np.pi, 0])))
        torque = env.data.qfrc_actuator[6:]
        terms = {
            "velocity": np.exp(-off @ off / 0.3**2),
            "turn": 0.5 * np.exp(-((qvel[5] - command[2]) ** 2) / 0.5**2),
            "gait": 0.5 * np.exp(-np.sum((feet - 0.06 * swing) ** 2) / 0.06**2),
            "bounce": -(velocity[2] ** 2),
            "tilt": -(up[:2] @ up[:2] + 0.05 * qvel[3:5] @ qvel[3:5]),
            "jerk": -0.02 * np.sum((action - last) ** 2),
            "torque": -0.0002 * torque @ torque,
        }
        for name, value in terms.items():
            assert info[f"reward_{name}"] == pytest.approx(value, rel=1e-9, abs=1e-12)
        assert reward == pytest.approx(0.2 + sum(terms.values()), rel=1e-9)
        assert info["error"] == pytest.approx(abs(off[0]), rel=1e-9, abs=1e-12)
        last = action


def test_the_command_is_drawn_from_the_ranges() -> None:
    """The ranges are the curriculum."""
    envs = mjenv.make_vec(ID, 200, command_forward=(0.2, 0.4), command_left=(-0.1, 0), command_turn=(0.5, 0.5))
    command = envs.reset(seed=1)[0][:, 45:48]
    for column, (low, high) in enumerate([(0.2, 0.4), (-0.1, 0)]):
        assert low <= command[:, column].min() < low + 0.1 * (high - low)
        assert high - 0.1 * (high - low) < command[:, column].max() <= high
    assert (command[:, 2] == 0.5).all()


@pytest.mark.parametrize(("height", "angle", "fallen"), [(0.3, 0, False), (0.15, 0, True), (0.3, 1.2, True)])
def test_it_ends_when_the_robot_has_fallen(height: float, angle: float, fallen: bool) -> None:
    env = mjenv.make(ID)
    env.reset(seed=1)
    qpos = env.data.qpos.copy()
    qpos[2:7] = height, np.cos(angle / 2), np.sin(angle / 2), 0, 0
    env.set_state(qpos, np.zeros(18))
    assert env.step(np.zeros(12))[2] == fallen


NUMBERS = ("forward", "error", "reward_velocity", "reward_gait", "reward_jerk", "reward_torque")


def play(envs: mjenv.VectorEnv, policy: Policy, obs: NDArray[Any], steps: int) -> list[bytes]:
    played = []
    for _ in range(steps):
        obs, rewards, terminated, truncated, infos = envs.step(policy.act(obs) + 0.4)  # with which some fall
        found = (infos, infos.get("final_info", {}))  # of rows that went on, and of those whose episode ended
        numbers = [of_rows[name] for of_rows in found for name in NUMBERS if name in of_rows]
        assert len(numbers) in (len(NUMBERS), 2 * len(NUMBERS))
        arrays = [obs, rewards, terminated, truncated, *numbers]
        played.append(b"".join(np.asarray(array).tobytes() for array in arrays))
    return played


def test_threads_and_snapshots_change_no_bit(policy: Policy) -> None:
    options: dict[str, Any] = {"max_episode_steps": 30, "autoreset_mode": "same_step"}
    one, two = (mjenv.make_vec(ID, 6, num_threads=threads, **options) for threads in (1, 2))
    (first, _), (second, _) = one.reset(seed=1), two.reset(seed=1)
    assert first.tobytes() == second.tobytes()
    assert play(one, policy, first, 40) == play(two, policy, second, 40)
    image, obs = one.snapshot(), one.observe()
    expected = play(one, policy, obs, 40)
    two.restore(image)
    assert play(two, policy, obs, 40) == expected
    one.restore(image)
    assert play(one, policy, obs, 40) == expected
