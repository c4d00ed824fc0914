"""The tasks of mjenv's suite and those of dm_control, side by side from equal seeds: all bits of all observations,
rewards and ends are equal, through resets.

Runs on the Python of tools/setup dm_control. By default few steps, with --long full episodes.
"""

from __future__ import annotations

import numpy as np
import pytest
from dm_control import suite

import mjenv
from conftest import TASKS, actions, flat


@pytest.mark.parametrize("task", TASKS, ids="-".join)
def test_episodes(task: tuple[str, str], seeds: int, steps: int) -> None:
    env = mjenv.make(f"dm_control/{'-'.join(task)}-v0")
    rewarded = 0
    for seed in range(1, seeds + 1):
        original = suite.load(*task, task_kwargs={"random": seed})
        draw = actions(original, seed)
        for episode in range(2):
            want = original.reset()
            got, _ = env.reset(seed=seed if episode == 0 else None)
            np.testing.assert_array_equal(got, flat(want.observation), f"seed {seed}, episode {episode}, reset")
            for step in range(steps):
                action = draw()
                want = original.step(action)
                got, reward, terminated, truncated, _ = env.step(action)
                where = f"seed {seed}, episode {episode}, step {step}"
                np.testing.assert_array_equal(got, flat(want.observation), where)
                assert float(reward) == float(want.reward), where
                assert want.last() == (terminated or truncated), where
                rewarded += want.reward != 0
                if want.last():
                    assert terminated == (want.discount == 0), where
                    break
    env.close()
