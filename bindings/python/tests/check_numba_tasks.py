"""A task that numba compiles. tests/run gives this test a process of its own, because a task stays registered."""

from typing import Any

import numpy as np
import pytest

import mjenv
import mjenv.task
from check_python_tasks import check_steps, flat, pair
from mjenv import jit
from tasks_of_numba import NumbaHopper

mjenv.register("NumbaHopper-v5", NumbaHopper)


class NumbaLive(mjenv.Task):
    """Shows a live parameter, and the number of steps, which resets keep."""

    model = "hopper.xml"
    options = {"gains": mjenv.task.Setting((1.0, 2.0), live=True)}  # noqa: RUF012
    state = {"steps": (), "level": ()}  # noqa: RUF012
    kept = ("level",)
    observation_fields = {"gains": 2, "row": {"steps": 1, "level": 1}}  # noqa: RUF012

    def build(self, model: Any) -> Any:
        return [model.parameter_index("gains")]

    @jit.reset
    def reset(self: Any, start: Any) -> None:  # type: ignore[override]
        jit.array(start.qvel, start.nv)[0] = jit.array(start.parameters, 2)[int(self[0])]

    @jit.observe
    def observe(self: Any, sim: Any, observation: Any) -> None:  # type: ignore[override]
        gains, state = jit.array(sim.parameters, 2), jit.array(sim.carried, 2)
        for i in range(2):
            observation[i], observation[2 + i] = gains[int(self[0]) + i], state[i]

    @jit.step
    def step(self: Any, sim: Any, outcome: Any) -> None:  # type: ignore[override]
        state = jit.array(outcome.carried, 2)
        state[0] += 1
        state[1] += 1
        outcome.reward = jit.array(sim.parameters, 2)[1]


mjenv.register("NumbaLive-v0", NumbaLive)


def test_live_parameters_and_kept_numbers() -> None:
    grouped = mjenv.make_vec("NumbaLive-v0", 3)
    assert {name: part.tolist() for name, part in grouped.reset(seed=0)[0].items()} == {
        "gains": [[1, 2]] * 3,
        "row": [[0, 0]] * 3,
    }
    envs = mjenv.make_vec("NumbaLive-v0", 3, observation="flat")
    envs.reset(seed=0)
    envs.parameters["gains"][1] = 5, 7
    for steps in (1, 2, 3):
        obs, rewards = envs.step(np.zeros((3, 3)))[:2]
        assert obs.tolist() == [[1, 2, steps, steps], [5, 7, steps, steps], [1, 2, steps, steps]]
        assert rewards.tolist() == [2, 7, 2]
    assert envs.reset()[0].tolist() == [[1, 2, 0, 3], [5, 7, 0, 3], [1, 2, 0, 3]]
    assert envs.data.qvel[:, 0].tolist() == [1, 5, 1]


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
