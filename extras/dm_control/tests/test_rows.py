"""Many rows, threads, copies and images of the suite's tasks: each row still is dm_control's own environment."""

from __future__ import annotations

import numpy as np
import pytest
from dm_control import suite

import mjenv
from conftest import actions, flat
from mjenv_dm_control.streams import random_state, set_random_state

# Of each kind: a reset that simulates, begins again or draws until nothing touches; written arrays; a terrain of the
# row's own; free joints; RK4.
TASKS = [
    "cartpole-swingup",
    "cheetah-run",
    "finger-turn_hard",
    "humanoid-walk",
    "lqr-lqr_6_2",
    "point_mass-hard",
    "quadruped-walk",
    "quadruped-escape",
]
SEEDS = [1, 2, 3]


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("task", TASKS)
def test_rows(task: str, threads: int) -> None:
    originals = [suite.load(*task.split("-"), task_kwargs={"random": seed}) for seed in SEEDS]
    draws = [actions(original, seed) for original, seed in zip(originals, SEEDS, strict=True)]
    envs = mjenv.make_vec(f"dm_control/{task}-v0", len(SEEDS), num_threads=threads, autoreset_mode="disabled")
    for episode in range(2):
        got, _ = envs.reset(seed=SEEDS if episode == 0 else None)
        np.testing.assert_array_equal(got, [flat(original.reset().observation) for original in originals])
        for _ in range(20):
            chosen = [draw() for draw in draws]
            want = [original.step(action) for original, action in zip(originals, chosen, strict=True)]
            got, rewards, *_ = envs.step(np.array(chosen))
            np.testing.assert_array_equal(got, [flat(step.observation) for step in want])
            np.testing.assert_array_equal(rewards, [float(step.reward) for step in want])
    envs.close()


@pytest.mark.parametrize("task", TASKS)
def test_images(task: str) -> None:
    """An image in the middle of an episode goes on as the original does, also in another environment and row."""
    original = suite.load(*task.split("-"), task_kwargs={"random": 1})
    draw = actions(original, 1)
    envs = mjenv.make_vec(f"dm_control/{task}-v0", 2, autoreset_mode="disabled")
    envs.reset(seed=[1, 7])
    original.reset()
    for _ in range(7):
        action = draw()
        original.step(action)
        envs.step(np.array([action, action]))
    other = mjenv.make_vec(f"dm_control/{task}-v0", 3, autoreset_mode="disabled")
    other.reset(seed=[4, 5, 6])
    other.restore(envs.snapshot(0), 2)
    envs.copy_row(0, np.array([False, True]))
    for episode in range(2):
        for _ in range(10):
            action = draw()
            want = original.step(action)
            for rows in (envs, other):
                got, rewards, *_ = rows.step(np.array([action] * rows.num_envs))
                np.testing.assert_array_equal(got[-1], flat(want.observation))
                assert rewards[-1] == float(want.reward)
        if episode == 0:
            want = original.reset()
            for rows in (envs, other):
                got, _ = rows.reset()
                np.testing.assert_array_equal(got[-1], flat(want.observation))
    envs.close()
    other.close()


@pytest.mark.parametrize("seed", [0, 2**32 - 1, 2**32, 2**64 + 5, 3 << 100])
def test_seeds(seed: int) -> None:
    """NumPy seeds RandomState with 32 bits. A larger seed is the list of its words, which NumPy takes, too."""
    words = [seed >> 32 * i & 0xFFFFFFFF for i in range(max(1, (seed.bit_length() + 31) // 32))]
    random = np.random.RandomState(seed if len(words) == 1 else words)
    env = mjenv.make("dm_control/pendulum-swingup-v0")
    env.reset(seed=seed)
    assert env.data.qpos[0] == random.uniform(-np.pi, np.pi)
    env.close()


def test_without_seed() -> None:
    env = mjenv.make("dm_control/pendulum-swingup-v0")
    assert env.reset()[0].tolist() != env.reset()[0].tolist()
    env.close()


def test_streams() -> None:
    """The stream that mjenv_get_stream reads is RandomState's own state, also in the middle of its numbers."""
    env = mjenv.make("dm_control/cartpole-balance-v0")
    random = np.random.RandomState(5)
    env.reset(seed=5)
    random.uniform(size=2)
    random.randn(2)
    (_, key, *rest), is_new = random_state(env.handle)
    _, wanted, *others = random.get_state()
    np.testing.assert_array_equal(key, wanted)
    assert rest == others
    assert not is_new
    other = mjenv.make("dm_control/cartpole-balance-v0")
    set_random_state(other.handle, random.get_state(), False)
    other._seed = 0
    assert other.reset()[0].tolist() == env.reset()[0].tolist()
    bad = ("MT19937", key, 625, 0, 0.0)
    with pytest.raises(ValueError, match="no state of RandomState"):
        set_random_state(env.handle, bad, False)
    with pytest.raises(ValueError, match="count is 627, not 4 or 6"):
        set_random_state(mjenv.make("Hopper-v5").handle, random.get_state(), False)


def test_bounds_of_actions() -> None:
    """Those of dm_control's action_spec, also where motors have none."""
    for task in ("lqr-lqr_6_2", "walker-walk"):
        spec = suite.load(*task.split("-")).action_spec()
        space = mjenv.make_vec(f"dm_control/{task}-v0", 2).single_action_space
        np.testing.assert_array_equal(space.low, spec.minimum.astype(np.float32))
        np.testing.assert_array_equal(space.high, spec.maximum.astype(np.float32))
