"""A task that numba compiles. tests/run gives this test a process of its own, because a task stays registered."""

import os
import pydoc
from pathlib import Path
from typing import Any

import mjenv_numba as jit
import numpy as np
import pytest

import mjenv
import mjenv.task
from tasks_of_numba import NumbaHopper
from tasks_of_python import check_steps, flat, pair

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


REPOSITORY = Path(__file__).parents[3]
LIBRARY = Path(os.environ.get("MJENV_LIBRARY", REPOSITORY / "build" / "libmjenv.so")).parent
mjenv.load_tasks(LIBRARY / "tests" / "tasks" / "libfollow.so")


class NumbaFollow(mjenv.Task):
    """tests/tasks/follow.cpp written again."""

    model = REPOSITORY / "tests" / "tasks" / "follow.xml"
    frame_skip = 4
    time_limit = 50
    options = {"kp": 30.0, "kd": 1.0, "limit": 40.0}  # noqa: RUF012
    action_bounds = ((-1, 1), (-1, 1))
    own = ("xfrc_applied", "geom_pos")
    current = True
    needs = ("geom_xpos",)
    state = {"target": (2,), "torque": (2,)}  # noqa: RUF012
    observation_fields = {"all": 9 + 8 + 2 + 2 + 3 + 6 + 6}  # noqa: RUF012
    info_fields = {"speed": ()}  # noqa: RUF012

    def build(self, model: Any) -> Any:
        arrays = [model.array_index(name) for name in ("key_qpos", "xfrc_applied", "geom_pos")]
        return [self.kp, self.kd, self.limit, *arrays]  # type: ignore[attr-defined]

    @jit.reset
    def reset(self: Any, start: Any) -> Any:  # type: ignore[override]
        qpos = jit.array(start.qpos, start.nq)
        home = np.array([0, 0, 0.7, 1, 0, 0, 0, 0.5, -0.9])
        for i in range(9):
            qpos[i] = home[i] + jit.uniform(start.random, -0.05, 0.05)

    @jit.before_step
    def before_step(self: Any, sim: Any, control: Any) -> Any:  # type: ignore[override]
        action, state = jit.array(sim.action, sim.action_count), jit.array(control.carried, 4)
        for i in range(2):
            wanted = (0.5, -0.9)[i] + 0.5 * min(max(action[i], -0.8), 0.8)
            state[i] += 0.4 * (wanted - state[i])
        jit.own(control, 0, 6 * sim.nbody)[6] = jit.uniform(control.random, -20, 20)

    @jit.before_substep
    def before_substep(self: Any, sim: Any, control: Any) -> Any:
        qpos, qvel = jit.array(sim.qpos, sim.nq), jit.array(sim.qvel, sim.nv)
        ctrl, state = jit.array(control.ctrl, sim.nu), jit.array(control.carried, 4)
        if control.substep == 3 and qpos[2] > self[2]:
            return jit.fail(sim, "the trunk flies")
        jit.own(control, 0, 6 * sim.nbody)[8] = control.substep
        for i in range(2):
            ctrl[i] = state[2 + i]
            state[2 + i] = self[0] * (state[i] - qpos[7 + i]) - self[1] * qvel[6 + i]
        return 0

    @jit.observe
    def observe(self: Any, sim: Any, observation: Any) -> Any:  # type: ignore[override]
        arrays = (
            (jit.array(sim.qpos, sim.nq), 0, 9),
            (jit.array(sim.qvel, sim.nv), 0, 8),
            (jit.array(sim.ctrl, sim.nu), 0, 2),
            (jit.array(sim.carried, 4), 0, 2),
            (jit.array(sim.xpos, 3 * sim.nbody), 3, 3),
            (jit.shared(sim, int(self[4]), 6 * sim.nbody), 6, 6),
            (jit.shared(sim, int(self[5]), 3 * sim.ngeom), 3, 3),
            (jit.array(sim.geom_xpos, 3 * sim.ngeom), 3, 3),
        )
        at = 0
        for values, first, count in arrays:
            for i in range(count):
                observation[at] = values[first + i]
                at += 1

    @jit.step
    def step(self: Any, sim: Any, outcome: Any) -> Any:  # type: ignore[override]
        action = jit.array(sim.action, 2)
        outcome.reward = action[0] + action[1]
        jit.array(outcome.info, 1)[0] = jit.array(sim.qvel, 1)[0]
        jit.own(outcome, 1, 3 * sim.ngeom)[3] += 0.25
        jit.array(outcome.qvel, sim.nv)[1] += 0.1 * action[0]


mjenv.register("tests/NumbaFollow-v0", NumbaFollow)


def test_maps_of_actions_and_own_arrays_equal_those_in_cpp() -> None:
    envs = [
        mjenv.make_vec("tests/NumbaFollow-v0", 5),
        mjenv.make_vec("tests/Follow-v0", 5, current=True),
    ]
    assert envs[0].action_space == envs[1].action_space
    assert flat(envs[0].reset(seed=3)[0]) == flat(envs[1].reset(seed=3)[0])
    rng = np.random.default_rng(1)
    for _ in range(60):
        action = rng.uniform(-1, 1, (5, 2))
        assert flat(envs[0].step(action)) == flat(envs[1].step(action))
    failing = mjenv.make("tests/NumbaFollow-v0", limit=0.0)
    failing.reset(seed=1)
    with pytest.raises(mjenv.TaskError, match="before_substep: the trunk flies"):
        failing.step(np.zeros(2))


FALLING = """
    <mujoco>
      <option timestep="0.01"/>
      <worldbody>
        <geom name="floor" type="plane" size="5 5 0.1"/>
        <geom name="marker" pos="0 0 2" size="0.1" contype="0" conaffinity="0"/>
        <body name="ball" pos="0 0 1"><joint name="z" type="slide" axis="0 0 1"/><geom size="0.1"/></body>
      </worldbody>
    </mujoco>"""


class NumbaFalling(mjenv.Task):
    """Its reset lets the ball fall until it touches the floor, begins again 5 cm above, and moves a marker."""

    model = FALLING
    current = True
    random_state = True
    own = ("geom_pos",)
    options = {"most": 100}  # noqa: RUF012
    state = {"touched": ()}  # noqa: RUF012
    observation_fields = {"marker": 3, "ball": 3, "touched": 1}  # noqa: RUF012

    def build(self, model: Any) -> Any:
        return [self.most, model.array_index("geom_pos")]  # type: ignore[attr-defined]

    @jit.reset
    def reset(self: Any, start: Any) -> Any:  # type: ignore[override]
        place, qpos = jit.own(start, 0, 6), jit.array(start.qpos, 1)
        place[3] = jit.state_uniform(start.random, 0, 1)
        place[4] += 1  # counts the resets
        jit.forward(start)
        for _ in range(int(self[0])):
            if jit.contact_count(start) > 0:
                break
            jit.advance(start, 1)
        if jit.contact_count(start) == 0:
            return jit.fail(start, "the ball never touches the floor")
        touched = 1 + qpos[0]
        jit.restart(start)
        qpos[0] = touched - 1 + 0.05
        jit.array(start.time, 1)[0] = 0.5
        jit.array(start.carried, 1)[0] = touched
        return 0

    @jit.observe
    def observe(self: Any, sim: Any, observation: Any) -> Any:  # type: ignore[override]
        place = jit.shared(sim, int(self[1]), 6)
        for i in range(3):
            observation[i] = place[3 + i]
        observation[3] = jit.array(sim.qpos, 1)[0]
        observation[4] = jit.array(sim.xpos, 6)[5]
        observation[5] = jit.array(sim.time, 1)[0]
        observation[6] = jit.array(sim.carried, 1)[0]

    @jit.step
    def step(self: Any, sim: Any, outcome: Any) -> Any:  # type: ignore[override]
        outcome.reward = 0


class NumpyFalling(mjenv.Task):
    """The same with NumPy, which tests/live compares with MuJoCo's own calls."""

    model = FALLING
    current = True
    random_state = True
    own = ("geom_pos",)
    needs = ("qpos", "xpos", "time")
    state = {"touched": ()}  # noqa: RUF012

    def reset_row(self, start: Any) -> dict[str, Any]:
        start.own["geom_pos"][1, 0] = start.random_state.uniform(0, 1)
        start.own["geom_pos"][1, 1] += 1
        start.forward()
        for _ in range(100):
            if start.contact_count:
                break
            start.advance(1)
        touched = 1 + start.qpos[0]
        start.restart()
        start.qpos[0], start.time = touched - 1 + 0.05, 0.5
        return {"touched": touched}

    def observe(self, sim: Any) -> Any:
        ball = np.stack([sim.qpos[:, 0], sim.xpos[:, 1, 2], sim.time.reshape(-1)], axis=1)
        return np.concatenate([sim.own["geom_pos"][:, 1], ball, sim.touched[:, None]], axis=1)

    def step(self, sim: Any, action: Any) -> Any:
        return np.zeros(len(action)), np.zeros(len(action), bool), {}


class NumbaTerrain(mjenv.Task):
    """tests/tasks/terrain.cpp written again."""

    model = REPOSITORY / "tests" / "tasks" / "terrain.xml"
    frame_skip = 4
    time_limit = 25
    current = True
    random_state = True
    own = ("hfield_data", "geom_rgba")
    needs = ("contacts",)
    state = {"touched": (), "air": ()}  # noqa: RUF012
    observation_fields = {  # noqa: RUF012
        "qpos": 3,
        "qvel": 3,
        "field": 30,
        "rgba": 8,
        "touched": 1,
        "touching": 1,
        "air": 1,
        "below": 1,
        "around": 3,
    }
    info_fields = {"height": (), "flight": ()}  # noqa: RUF012

    def build(self, model: Any) -> Any:
        return [model.array_index("hfield_data"), model.array_index("geom_rgba"), *jit.terrain(model, "ground")]

    @jit.reset
    def reset(self: Any, start: Any) -> Any:  # type: ignore[override]
        heights, colours = jit.own(start, 0, 30), jit.own(start, 1, 8)
        order = np.empty(30, np.int64)
        jit.state_permutation(start.random, order)
        for i in range(30):
            heights[i] = order[i] / 30
        jit.state_shuffle(start.random, heights[:7])
        colours[0] = jit.state_choice(start.random, 5) / 10
        colours[4] += 0.01
        jit.array(start.qpos, 3)[0] = jit.state_uniform(start.random, -1, 1)
        jit.forward(start)
        for _ in range(200):
            if jit.contact_count(start) > 0:
                break
            jit.advance(start, 1)
        at = jit.array(jit.sim_of(start).xpos, 6)
        jit.array(start.carried, 2)[0] = at[5] - jit.height(self, 2, start, at[3], at[4])
        jit.array(start.time, 1)[0] = 0

    @jit.observe
    def observe(self: Any, sim: Any, observation: Any) -> Any:  # type: ignore[override]
        for i in range(3):
            observation[i] = jit.array(sim.qpos, 3)[i]
            observation[3 + i] = jit.array(sim.qvel, 3)[i]
        for i in range(30):
            observation[6 + i] = jit.shared_float32(sim, int(self[0]), 30)[i]
        for i in range(8):
            observation[36 + i] = jit.shared_float32(sim, int(self[1]), 8)[i]
        observation[44] = jit.array(sim.carried, 2)[0]
        observation[45] = 1 if jit.touching(sim, 1, 0) else 0
        observation[46] = jit.array(sim.carried, 2)[1]
        observation[47] = jit.height(self, 2, sim, jit.array(sim.xpos, 6)[3], jit.array(sim.xpos, 6)[4])
        observation[48] = jit.height_around(self, 2, sim, 1, 0.3, 0.1)
        observation[49] = jit.height_around(self, 2, sim, 1, -0.2, 0.4)
        observation[50] = jit.height_around(self, 2, sim, 1, 9.0, -7.0)

    @jit.step
    def step(self: Any, sim: Any, outcome: Any) -> Any:  # type: ignore[override]
        at = jit.integers(outcome.random, 0, 30)
        jit.own(outcome, 0, 30)[at] = jit.random(outcome.random)
        info = jit.array(outcome.info, 2)
        info[0] = jit.array(sim.qpos, 3)[2]
        info[1] = jit.air_time(jit.array(outcome.carried, 2), 1, jit.touching(sim, 1, 0), sim.dt)
        outcome.reward = jit.array(sim.qpos, 3)[0]


mjenv.register("tests/NumbaTerrain-v0", NumbaTerrain)
mjenv.load_tasks(LIBRARY / "tests" / "tasks" / "libterrain.so")
mjenv.load_tasks(LIBRARY / "tests" / "tasks" / "libgroups.so")


class NumbaGoal(mjenv.Task):
    """The task tests/Goal-v0 in tests/tasks/groups.cpp written again."""

    model = mjenv.model_xml("tests/Goal-v0")
    time_limit = 9
    state = {"target": (2,)}  # noqa: RUF012
    observation_fields = {"achieved_goal": 2, "desired_goal": 2, "observation": 2}  # noqa: RUF012

    @jit.reset
    def reset(self: Any, start: Any) -> Any:  # type: ignore[override]
        for i in range(2):
            jit.array(start.qvel, 2)[i] = jit.uniform(start.random, -1, 1)
        for i in range(2):
            jit.array(start.carried, 2)[i] = jit.uniform(start.random, -1, 1)

    @jit.observe
    def observe(self: Any, sim: Any, observation: Any) -> Any:  # type: ignore[override]
        for i in range(2):
            observation[i] = jit.array(sim.qpos, 2)[i]
            observation[2 + i] = jit.array(sim.carried, 2)[i]
            observation[4 + i] = jit.array(sim.qvel, 2)[i]

    @jit.compute_reward
    def compute_reward(self: Any, achieved: Any, desired: Any) -> Any:  # type: ignore[override]
        return -abs(achieved[0] - desired[0]) - 2 * abs(achieved[1] - desired[1])

    @jit.step
    def step(self: Any, sim: Any, outcome: Any) -> Any:  # type: ignore[override]
        at, to = jit.array(sim.qpos, 2), jit.array(sim.carried, 2)
        outcome.reward = -abs(at[0] - to[0]) - 2 * abs(at[1] - to[1])


mjenv.register("tests/NumbaGoal-v0", NumbaGoal)


def test_rewards_of_goals_equal_those_in_cpp() -> None:
    for id in ("tests/Goal-v0", "tests/NumbaGoal-v0"):
        envs = mjenv.make_vec(id, 3, observation="dict")
        envs.reset(seed=1)
        obs, reward, *_ = envs.step(np.zeros((3, 0)))
        goals = obs["achieved_goal"], obs["desired_goal"]
        assert np.array_equal(envs.compute_reward(*goals, {}), reward)
        away = np.abs(goals[0] - goals[1])
        assert np.array_equal(reward, -away[:, 0] - 2 * away[:, 1])
        many = [np.broadcast_to(goal, (4, 3, 2)) for goal in goals]
        assert np.array_equal(envs.compute_reward(*many, {}), np.broadcast_to(reward, (4, 3)))
        with pytest.raises(mjenv.InvalidValueError, match="the count of the goals is 9, not 3 times 2"):
            envs.compute_reward(np.zeros((3, 3)), np.zeros((3, 3)), {})


def test_wrong_parameters() -> None:
    with pytest.raises(
        TypeError, match=r"observe takes \(self, sim, observation\), not .*; it cannot draw: draw in step"
    ):
        jit.observe(lambda self, sim, observation, rng: None)
    with pytest.raises(TypeError, match=r"step takes \(self, sim, outcome\), not \(self, sim\)"):
        jit.step(lambda self, sim: None)
    with pytest.raises(TypeError, match=r"reset takes \(self, start\), not \(self, start, rng\)"):
        jit.reset(lambda self, start, rng: None)


def test_own_arrays_of_float32_equal_those_in_cpp() -> None:
    envs = [mjenv.make_vec(f"tests/{name}Terrain-v0", 5) for name in ("Numba", "")]
    assert flat(envs[0].reset(seed=3)[0]) == flat(envs[1].reset(seed=3)[0])
    rng = np.random.default_rng(1)
    for _ in range(60):
        action = rng.uniform(-1, 1, (5, 2))
        assert flat(envs[0].step(action)) == flat(envs[1].step(action))


mjenv.register("NumbaFalling-v0", NumbaFalling)
mjenv.register("NumpyFalling-v0", NumpyFalling)


def test_resets_that_simulate() -> None:
    envs = [mjenv.make_vec(f"{name}Falling-v0", 3) for name in ("Numba", "Numpy")]
    assert flat(envs[0].reset(seed=[1, 2, 3])[0]) == flat(envs[1].reset(seed=[1, 2, 3])[0])
    for _ in range(20):
        action = np.zeros((3, 0))
        assert flat(envs[0].step(action)) == flat(envs[1].step(action))
    obs = envs[0].reset()[0]
    assert flat(obs) == flat(envs[1].reset()[0])
    assert obs[:, 1].tolist() == [2, 2, 2]
    with pytest.raises(mjenv.TaskError, match="the ball never touches the floor"):
        mjenv.make("NumbaFalling-v0", most=2).reset(seed=1)


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


@jit.before_step
def _three(self: Any, sim: Any, control: Any) -> None:
    jit.array(control.ctrl, 1)[0] = 3


class Optional(mjenv.Task):
    """Callbacks under options: one that build adds, and one that it takes away."""

    model = """<mujoco><worldbody><body><joint name="x" type="slide" axis="1 0 0"/><geom size=".1"/></body></worldbody>
    <actuator><motor joint="x" ctrllimited="true" ctrlrange="-9 9"/></actuator></mujoco>"""
    options = {"maps": False, "pushes": True, "python": False}  # noqa: RUF012
    observation_fields = {"x": 1}  # noqa: RUF012

    def build(self, model: Any) -> None:
        if self.maps:
            self.before_step = _three
        if not self.pushes:
            self.before_substep = None
        if self.python:
            self.carry = lambda sim: None

    @jit.reset
    def reset(self: Any, start: Any) -> None:  # type: ignore[override]
        pass

    @jit.observe
    def observe(self: Any, sim: Any, observation: Any) -> None:  # type: ignore[override]
        observation[0] = 0

    @jit.before_substep
    def before_substep(self: Any, sim: Any, control: Any) -> None:
        jit.array(control.ctrl, 1)[0] += 4

    @jit.step
    def step(self: Any, sim: Any, outcome: Any) -> None:  # type: ignore[override]
        outcome.reward = jit.array(sim.ctrl, 1)[0]


mjenv.register("Optional-v0", Optional)


@pytest.mark.parametrize("maps", [False, True])
@pytest.mark.parametrize("pushes", [False, True])
def test_callbacks_under_options(maps: bool, pushes: bool) -> None:
    env = mjenv.make("Optional-v0", maps=maps, pushes=pushes)
    env.reset(seed=0)
    assert env.step(np.array([1.0]))[1] == (3 if maps else 1) + (4 if pushes else 0)


def test_a_method_in_python_among_machine_code() -> None:
    with pytest.raises(mjenv.TaskError, match="reset is machine code, so carry must be, too"):
        mjenv.make("Optional-v0", python=True)


def test_help_names_and_describes_every_function() -> None:
    text = pydoc.render_doc(jit, renderer=pydoc.plaintext)
    assert "lambda" not in text
    for name, value in vars(jit).items():
        if type(value) is type(jit.fail) and not name.startswith("_"):
            assert f"    {name} = <intrinsic {name}>\n        {(value.__doc__ or '').splitlines()[0]}" in text
