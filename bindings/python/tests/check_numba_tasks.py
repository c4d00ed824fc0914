"""A task that numba compiles. tests/run gives this test a process of its own, because a task stays registered."""

from typing import Any

import numpy as np
import pytest

import mjenv
from check_python_tasks import check_steps, flat, pair
from tasks_of_numba import NumbaHopper

mjenv.register("NumbaHopper-v5", NumbaHopper)


@pytest.mark.parametrize(
    ("threads", "mode", "dtype"),
    [(1, "next_step", np.float32), (2, "same_step", np.float64), (5, "next_step", np.float64)],
)
def test_hopper_equals_the_built_in_one(threads: int, mode: str, dtype: Any) -> None:
    assert check_steps(pair(own="NumbaHopper-v5", num_threads=threads, autoreset_mode=mode), 1000, dtype) > 1000


def test_rollouts_and_single_rows() -> None:
    envs = pair(4, own="NumbaHopper-v5", num_threads=2)
    action = np.random.default_rng(0).uniform(-1, 1, (4, 9, 3))
    assert flat(envs[0].rollout(action, observations=True)) == flat(envs[1].rollout(action, observations=True))
    envs = pair(4, own="NumbaHopper-v5", num_threads=2)
    for env in envs:
        env.send(action[1:3, 0], [2, 0])
    assert flat(envs[0].recv()) == flat(envs[1].recv())
