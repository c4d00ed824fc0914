"""Pickles and copies keep the episode, the random stream and the spaces' generators."""

import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mjenv

Copier = Callable[[mjenv.Environment], mjenv.Environment]
COPIERS = [copy.copy, copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))]
NAMES = ["copy", "deepcopy", "pickle"]


def play(env: mjenv.Environment, steps: int) -> list[bytes]:
    outputs = []
    for _ in range(steps):
        obs, reward, terminated, truncated, info = env.step(env.action_space.sample())
        outputs += [obs.tobytes(), np.float64(reward).tobytes(), repr(info).encode()]
        if terminated or truncated:
            obs, info = env.reset()
            outputs += [obs.tobytes(), repr(info).encode()]
    return outputs


@pytest.mark.parametrize("duplicate", COPIERS, ids=NAMES)
@pytest.mark.parametrize("id", mjenv.ids())
def test_the_episode_goes_on(id: str, duplicate: Copier) -> None:
    env = mjenv.make(id, max_episode_steps=30)
    env.action_space.seed(4)
    env.reset(seed=7)
    play(env, 20)
    other = duplicate(env)
    assert other.spec == env.spec
    assert other.np_random_seed == env.np_random_seed
    assert other.data.xpos.tobytes() == env.data.xpos.tobytes()
    assert play(env, 50) == play(other, 50)
    assert other.np_random.random() == env.np_random.random()


@pytest.mark.parametrize("duplicate", COPIERS, ids=NAMES)
def test_before_the_first_reset(duplicate: Copier) -> None:
    env = mjenv.make("Hopper-v5")
    other = duplicate(env)
    with pytest.raises(mjenv.ResetNeeded):
        other.step(np.zeros(3))
    assert other.reset(seed=1)[0].tobytes() == env.reset(seed=1)[0].tobytes()


@pytest.mark.parametrize("duplicate", COPIERS, ids=NAMES)
def test_a_generator_that_was_handed_out(duplicate: Copier) -> None:
    env = mjenv.make("Hopper-v5")
    env.reset(seed=1)
    env.np_random.random(5)
    env.np_random.integers(9, dtype=np.uint32)  # leaves half a number in the generator
    other = duplicate(env)
    assert other.np_random is not env.np_random
    assert other.np_random.bit_generator.state == env.np_random.bit_generator.state
    assert other.reset()[0].tobytes() == env.reset()[0].tobytes()


def test_the_copy_is_independent() -> None:
    env = mjenv.make("Hopper-v5")
    env.reset(seed=1)
    other = copy.deepcopy(env)
    before = other.state_vector()
    env.step(np.ones(3))
    env.close()
    assert other.state_vector().tobytes() == before.tobytes()


@pytest.mark.parametrize("duplicate", COPIERS, ids=NAMES)
def test_what_shows_a_simulation_is_not_copied(duplicate: Callable[[Any], Any]) -> None:
    env = mjenv.make("Hopper-v5")
    for shown in (env.unwrapped.data, env.unwrapped.model, env.unwrapped.data.body("torso")):
        with pytest.raises(TypeError, match="copy the environment"):
            duplicate(shown)


def test_another_process_goes_on() -> None:
    env = mjenv.make("Walker2d-v5", healthy_reward=2)
    env.reset(seed=5)
    env.step(np.full(6, 0.2))
    script = """
import pickle, sys
import numpy as np
env = pickle.load(sys.stdin.buffer)
sys.stdout.buffer.write(env.step(np.full(6, 0.2))[0].tobytes() + env.reset()[0].tobytes())
"""
    run = subprocess.run([sys.executable, "-c", script], input=pickle.dumps(env), capture_output=True, check=True)
    assert run.stdout == env.step(np.full(6, 0.2))[0].tobytes() + env.reset()[0].tobytes()


def test_a_damaged_pickle_is_refused() -> None:
    env = mjenv.make("Hopper-v5")
    env.reset(seed=1)
    image = env._rows.snapshot(0)
    for bad in (
        b"",
        image[:-1],
        image[:100] + bytes([image[100] ^ 1]) + image[101:],
        mjenv.make("Ant-v5")._rows.snapshot(0),
    ):
        with pytest.raises(mjenv.SnapshotError):
            env._rows.restore(0, bad)
    env.step(np.zeros(3))
