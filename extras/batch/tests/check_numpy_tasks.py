"""Tasks written in NumPy. tests/run gives these tests a process of their own, because a task stays registered."""

import copy
import pickle
import sys
from collections.abc import Callable
from contextlib import closing
from types import CodeType
from typing import Any

import gymnasium
import mjenv_batch
import numpy as np
import pytest
from mjenv_batch import Random, Sim
from mjenv_batch.rows import NumpyRows

import mjenv
from interrupts import interrupted_before
from mjenv.task import Setting
from tasks_of_python import NumpyHopper, check_steps, flat, pair
from test_misuse import INTERPRETERS, run

PENDULUM = """<mujoco><worldbody><body name="pole"><joint name="hinge" type="hinge" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.05"/></body></worldbody>
<actuator><motor joint="hinge" ctrllimited="true" ctrlrange="-1 1"/></actuator></mujoco>"""

mjenv.register("NumpyHopper-v5", NumpyHopper)


@pytest.mark.parametrize(
    ("threads", "mode", "dtype"),
    [(1, "next_step", np.float32), (2, "same_step", np.float64), (5, "next_step", np.float64)],
)
def test_hopper_equals_the_built_in_one(threads: int, mode: str, dtype: Any) -> None:
    assert check_steps(pair(num_threads=threads, autoreset_mode=mode), 1000, dtype) > 1000


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_options_and_time_limit(mode: str) -> None:
    options = {"healthy_z_range": (0.2, 9.0), "exclude_current_positions_from_observation": False, "frame_skip": 3}
    envs = pair(5, autoreset_mode=mode, max_episode_steps=10, ctrl_cost_weight=0.25, dtype=np.float32, **options)
    assert check_steps(envs, 45) > 15


def test_the_wrapper_has_the_types_of_what_methods_get() -> None:
    assert (mjenv.task.Random, mjenv.task.Sim, mjenv.task.Start) == (Random, Sim, mjenv_batch.Start)


def test_reset_by_mask() -> None:
    envs = pair(4, autoreset_mode="disabled")
    mask = np.array([True, False, True, False])
    check_steps(envs, 5)
    assert flat(envs[0].reset(options={"reset_mask": mask})) == flat(envs[1].reset(options={"reset_mask": mask}))
    check_steps(envs, 5)
    while not envs[1].step(np.ones((4, 3)))[2].any():
        pass
    with pytest.raises(mjenv.ResetNeeded, match="its episode has ended"):
        envs[1].step(np.ones((4, 3)))


def test_states_and_images() -> None:
    envs = pair(6, autoreset_mode="next_step")
    check_steps(envs, 7)
    images = [env.snapshot() for env in envs]
    rows = [env.snapshot(2) for env in envs]
    check_steps(envs, 30, seed=1)
    for env, image, row in zip(envs, images, rows, strict=True):
        env.restore(image)
        env.restore(row, 4)
        env.copy_row(0, np.arange(6) == 5)
        env.envs[1].set_state(env.envs[1].data.qpos + 0.01, env.envs[1].data.qvel)
        env.envs[3].do_simulation([0.1, 0.2, 0.3], 2)
    assert flat(envs[0].observe()) == flat(envs[1].observe())
    check_steps(envs, 30, seed=2)
    for again in (copy.deepcopy(envs), pickle.loads(pickle.dumps(envs))):
        check_steps(again, 30, seed=3)
    damaged = bytearray(images[1])
    damaged[-9] ^= 1
    with pytest.raises(mjenv.SnapshotError):
        envs[1].restore(bytes(damaged))
    with pytest.raises(mjenv.SnapshotError):
        envs[1].restore(images[0])
    with pytest.raises(mjenv.SnapshotError):
        envs[1].restore(b"")


def test_single_environment() -> None:
    envs = [gymnasium.make(f"mjenv/{id}", disable_env_checker=True) for id in ("Hopper-v5", "NumpyHopper-v5")]
    specs = [mjenv.spec(id) for id in ("Hopper-v5", "NumpyHopper-v5")]
    assert specs[1].max_episode_steps == specs[0].max_episode_steps
    assert specs[1].reward_threshold == specs[0].reward_threshold
    assert envs[1].action_space == envs[0].action_space
    assert envs[1].observation_space == envs[0].observation_space
    action = np.array([0.1, -0.2, 0.3], np.float32)
    for seed in range(3):
        assert flat(envs[0].reset(seed=seed)) == flat(envs[1].reset(seed=seed))
        ended = False
        while not ended:
            built_in, own = (env.step(action) for env in envs)
            assert flat(built_in) == flat(own)
            ended = bool(built_in[2])
    assert flat(envs[0].reset()) == flat(envs[1].reset())


def test_gymnasium_makes_vectors() -> None:
    env = gymnasium.make_vec("mjenv/NumpyHopper-v5", 3)
    other = mjenv.make_vec("Hopper-v5", 3)
    assert flat(env.reset(seed=1)) == flat(other.reset(seed=1))


def test_steps_of_some_rows_are_refused() -> None:
    env = mjenv.make_vec("NumpyHopper-v5", 2)
    env.reset(seed=0)
    with pytest.raises(mjenv.TaskError, match="send works only with tasks in machine code"):
        env.send(np.zeros((2, 3)))


@pytest.mark.parametrize("mode", ["disabled", "next_step", "same_step"])
def test_rollouts(mode: str) -> None:
    envs = pair(5, autoreset_mode=mode, history=2)
    check_steps(envs, 4)
    actions = np.random.default_rng(3).uniform(-1, 1, (5, 60, 3))
    built_in, own = (env.rollout(actions, observations=True) for env in envs)
    assert flat(built_in) == flat(own)
    assert built_in[1].any()
    assert not built_in[1].all()
    assert flat(envs[0].observe()) == flat(envs[1].observe())
    assert flat(envs[0].reset()) == flat(envs[1].reset())
    assert flat(envs[0].rollout(actions[:, :3])) == flat(envs[1].rollout(actions[:, :3]))
    actions[2, 9, 1] = np.nan
    image = envs[1].snapshot()
    for env in envs:
        with pytest.raises(mjenv.InvalidValueError, match=r"row 2: action\[\d+\] is nan, but must be finite"):
            env.rollout(actions)
    assert envs[1].snapshot() == image


@pytest.mark.parametrize(
    "options",
    [
        {"history": 3},
        {"history": 2, "time_aware": True, "history_padding": "zero"},
        {"clip_actions": True, "rescale_actions": (-0.5, 0.5)},
        {"noise": {"action": 0.1, "observation": 0.01}, "delay": {"action": (0, 2), "observation": 1}, "history": 2},
        {
            "randomize": {"geom_friction": mjenv.Scale(0.5, 2.0)},
            "push": mjenv.Push(1, force=((-20, 20),) * 3, every=(2, 5)),
        },
    ],
    ids=str,
)
@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_options_that_the_library_computes(options: dict[str, Any], mode: str) -> None:
    envs = pair(7, autoreset_mode=mode, max_episode_steps=40, **options)
    assert check_steps(envs, 60) > 7
    images = [env.snapshot() for env in envs]
    check_steps(envs, 20, seed=1)
    for env, image in zip(envs, images, strict=True):
        env.restore(image)
    assert flat(envs[0].observe()) == flat(envs[1].observe())
    check_steps(envs, 60, seed=2)


class NumpyLive(mjenv.Task):
    """Shows its live parameters, and the number of steps, which resets keep."""

    model = "hopper.xml"
    frame_skip = 4
    time_limit = 5
    options = {  # noqa: RUF012
        "speed": Setting(0.5, "the commanded speed, m/s", -2, 2, live=True),
        "gains": Setting((1.0, 2.0), live=True),
    }
    state = {"level": (1,), "steps": ()}  # noqa: RUF012
    kept = ("level",)

    def reset(self, rng: Random, rows: int) -> Any:
        return np.tile(self.qpos0, (rows, 1)), np.zeros((rows, self.nv)), {"steps": np.zeros(rows)}

    def observe(self, sim: Sim) -> Any:
        live = sim.parameters
        return np.column_stack([live["speed"], live["gains"], sim.level, sim.steps])

    def step(self, sim: Sim, action: Any) -> Any:
        sim.level[...] += 1
        sim.steps[...] += 1
        return sim.parameters["speed"] * sim.parameters["gains"][:, 1], np.zeros(len(action), bool), {}


mjenv.register("NumpyLive-v0", NumpyLive)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_live_parameters_and_kept_numbers(mode: str) -> None:
    envs = mjenv.make_vec("NumpyLive-v0", 3, autoreset_mode=mode)
    action = np.zeros((3, 3))
    assert list(envs.parameters) == ["speed", "gains"]
    assert envs.parameters["gains"].tolist() == [[1, 2]] * 3
    assert flat(envs.reset(seed=0)[0]) == flat(np.tile([0.5, 1, 2, 0, 0], (3, 1)))
    envs.parameters["speed"][1:] = -1, 1.5
    envs.parameters["gains"] = np.arange(6).reshape(3, 2)
    speeds, gains = np.array([0.5, -1, 1.5]), np.arange(6.0).reshape(3, 2)
    assert flat(envs.observe()[:, :3]) == flat(np.column_stack([speeds, gains]))
    steps = level = 0
    for _ in range(14):
        obs, rewards, _, truncated, _ = envs.step(action)
        if mode == "SameStep" or steps < 5:
            steps, level = steps + 1, level + 1
            assert flat(rewards) == flat(speeds * gains[:, 1])
            assert truncated.tolist() == [steps == 5] * 3
            steps = 0 if mode == "SameStep" and steps == 5 else steps
        else:
            steps = 0
        want = np.column_stack([speeds, gains, np.full(3, level), np.full(3, steps)])
        assert flat(obs) == flat(want)
    copied = pickle.loads(pickle.dumps(envs))
    image = envs.snapshot()
    want = envs.step(action)
    assert flat(copied.step(action)) == flat(want)
    envs.parameters["speed"] = 2
    envs.restore(image)
    assert envs.parameters["speed"].tolist() == speeds.tolist()
    assert flat(envs.step(action)) == flat(want)
    envs.copy_row(2, np.array([True, False, False]))
    assert envs.parameters["speed"].tolist() == [1.5, -1, 1.5]
    assert flat(envs.observe()[0]) == flat(envs.observe()[2])
    envs.parameters["speed"][2] = 3
    with pytest.raises(mjenv.InvalidValueError, match=r"row 2: parameters.speed\[0\] is 3, but must lie in \[-2, 2\]"):
        envs.step(action)
    with pytest.raises(mjenv.UnknownNameError, match="no live parameter 'sped'; this task has speed, gains"):
        envs.parameters["sped"] = 1
    assert envs.parameters["speed"].tolist() == [1.5, -1, 1.5]


def test_live_parameters_of_one_environment() -> None:
    env: Any = mjenv.make("NumpyLive-v0", speed=1.0)
    env.reset(seed=0)
    assert env.parameters["speed"] == 1.0
    assert list(env.parameters) == ["speed", "gains"]
    env.parameters["speed"] = -0.25
    env.parameters["gains"][1] = 8
    assert env.step(np.zeros(3))[1] == -2
    assert env.reset()[0].tolist() == [-0.25, 1, 8, 1, 0]
    assert len(mjenv.make("Hopper-v5").unwrapped.parameters) == 0


def test_kept_numbers_are_those_of_a_state() -> None:
    with pytest.raises(mjenv.OptionError, match="kept has 'height', which is not in state"):
        mjenv.register("Kept-v0", type("Kept", (NumpyLive,), {"kept": ("height",)}))
    with pytest.raises(mjenv.OptionError, match="a live parameter is real numbers"):
        mjenv.register("Kept-v1", type("Kept", (NumpyLive,), {"options": {"speed": Setting(1, live=True)}}))


class Grouped(mjenv.Task):
    """Shows what a policy sees, and what only a critic sees."""

    model = PENDULUM
    needs = ("qpos", "qvel", "time")
    time_limit = 3
    fault = ""

    def reset(self, rng: Random, rows: int) -> tuple[Any, ...]:
        return rng.normal(0.0, 0.1, (rows, self.nq)), rng.normal(0.0, 0.1, (rows, self.nv))

    def observe(self, sim: Sim) -> Any:
        policy = np.concatenate([sim.qpos, sim.qpos**2], axis=1)
        if self.fault == "name":
            return {"actor": policy, "critic": sim.qvel}
        if self.fault == "shape":
            return {"policy": policy, "critic": sim.qvel[:, 0]}
        return {"policy": policy, "critic": sim.qvel}

    def step(self, sim: Sim, action: Any) -> tuple[Any, ...]:
        return sim.qpos[:, 0], sim.time > 1, {}


class NamedGroups(Grouped):
    observation_fields = {"policy": {"angle": 1, "square": 1}, "critic": {"speed": 1}}  # noqa: RUF012


class FlatGroups(NamedGroups):
    def observe(self, sim: Sim) -> Any:
        return np.concatenate([*super().observe(sim).values(), sim.time[:, None]], axis=1)

    observation_fields = {**NamedGroups.observation_fields, "clock": 1}  # noqa: RUF012


for number, kind in enumerate((Grouped, NamedGroups, FlatGroups)):
    mjenv.register(f"Grouped{number}-v0", kind)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("number", range(3))
def test_groups(number: int, mode: str) -> None:
    id, rows = f"Grouped{number}-v0", 4
    envs = mjenv.make_vec(id, rows, autoreset_mode=mode)
    keys = {"policy": 2, "critic": 1} | ({"clock": 1} if number == 2 else {})
    assert {name: space.shape for name, space in envs.single_observation_space.spaces.items()} == {
        name: (count,) for name, count in keys.items()
    }
    terms = [field.name for field in mjenv.make(id).fields("observation")]
    assert terms == [["policy", "critic"], ["angle", "square", "speed"], ["angle", "square", "speed", "clock"]][number]
    theirs = gymnasium.vector.SyncVectorEnv(
        [lambda: gymnasium.make(f"mjenv/{id}", max_episode_steps=3)] * rows, autoreset_mode=envs.autoreset_mode
    )
    assert envs.observation_space == theirs.observation_space
    assert flat(envs.reset(seed=1)) == flat(theirs.reset(seed=1))
    flattened = mjenv.make_vec(id, rows, autoreset_mode=mode, observation="flat")
    assert flattened.single_observation_space.shape == (sum(keys.values()),)
    flattened.reset(seed=1)
    for action in np.random.default_rng(0).uniform(-1, 1, (9, rows, 1)):
        step, all_in_one = envs.step(action), flattened.step(action)
        assert flat(step) == flat(theirs.step(action))
        assert np.array_equal(np.concatenate(list(step[0].values()), axis=1), all_in_one[0])
        assert np.array_equal(step[0]["policy"][:, 0], envs.data.qpos[:, 0])
    other = pickle.loads(pickle.dumps(envs))
    assert flat(envs.step(action)) == flat(other.step(action))


def test_groups_that_change(monkeypatch: pytest.MonkeyPatch) -> None:
    env = mjenv.make("Grouped0-v0")
    env.reset(seed=0)
    for fault, message in (("name", "the groups {'actor': 2, 'critic': 1}"), ("shape", "group 'critic' is float64")):
        monkeypatch.setattr(Grouped, "fault", fault)
        with pytest.raises(mjenv.TaskError, match=f"Grouped0-v0: observe: .*{message}"):
            env.reset()
    wrong = {"policy": {"angle": 1}, "critic": {"speed": 2}}
    monkeypatch.setattr(Grouped, "fault", "")
    monkeypatch.setattr(NamedGroups, "observation_fields", wrong)
    message = r"observe returned .*'policy': 2.*observation_fields has .*'policy': 1"
    with pytest.raises(mjenv.InvalidValueError, match=message):
        mjenv.make("Grouped1-v0")


class Reach(mjenv.Task):
    """A goal's task: the pole has to reach an angle."""

    model = PENDULUM
    state = {"goal": (1,)}  # noqa: RUF012
    time_limit = 5

    def reset(self, rng: Random, rows: int) -> tuple[Any, ...]:
        return rng.normal(0, 0.1, (rows, 1)), np.zeros((rows, 1)), {"goal": rng.uniform(-1, 1, (rows, 1))}

    def observe(self, sim: Sim) -> Any:
        return {"observation": sim.qvel, "achieved_goal": sim.qpos, "desired_goal": sim.goal}

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        return -np.linalg.norm(achieved_goal - desired_goal, axis=-1)

    def step(self, sim: Sim, action: Any) -> tuple[Any, ...]:
        return self.compute_reward(sim.qpos, sim.goal, {}), sim.qpos[:, 0] > 9, {}


mjenv.register("Reach-v0", Reach)


def test_rewards_of_goals() -> None:
    envs, env = mjenv.make_vec("Reach-v0", 4), mjenv.make("Reach-v0")
    envs.reset(seed=1), env.reset(seed=1)
    history = []
    for action in np.random.default_rng(0).uniform(-1, 1, (4, 4, 1)):
        obs, rewards = envs.step(action)[:2]
        assert np.array_equal(envs.compute_reward(obs["achieved_goal"], obs["desired_goal"], {}), rewards)
        one, reward = env.step(action[0])[:2]
        assert env.compute_reward(one["achieved_goal"], one["desired_goal"], {}) == reward == rewards[0]
        assert envs.envs[1].compute_reward(obs["achieved_goal"][1], obs["desired_goal"][1], {}) == rewards[1]
        history.append((obs, rewards))
    achieved = np.stack([obs["achieved_goal"] for obs, _ in history], axis=1)  # (rows, steps, 1)
    later = np.broadcast_to(achieved[:, -1:], achieved.shape)
    assert np.array_equal(envs.compute_reward(achieved, later, {}), -np.abs(achieved - later)[..., 0])
    with pytest.raises(
        mjenv.InvalidValueError, match=r"Reach-v0: compute_reward: the goals have the shapes \(4, 1\) and \(3"
    ):
        envs.compute_reward(achieved[:, 0], achieved[:3, 0], {})


@pytest.mark.parametrize("id", ["Ant-v5", "Hopper-v4", "Model-v0", "NumpyHopper-v5"])
def test_only_tasks_with_goals_have_compute_reward(id: str) -> None:
    """Stable-Baselines3, for one, takes an environment with compute_reward for one with goals."""
    options = {"xml_string": PENDULUM} if id == "Model-v0" else {}
    envs = mjenv.make_vec(id, **options)
    for env in (mjenv.make(id, **options), envs, envs.envs[0]):
        assert not hasattr(env, "compute_reward")
    with pytest.raises(AttributeError, match=f"{id} has no compute_reward"):
        envs.call("compute_reward")


class Flags(Reach):
    """Its infos are bools."""

    def reset_info(self, sim: Sim) -> dict[str, Any]:
        return {"still": sim.qvel[:, 0] == 0}

    def step(self, sim: Sim, action: Any) -> tuple[Any, ...]:
        return sim.qpos[:, 0], sim.qpos[:, 0] > 9, {"is_success": sim.qpos[:, 0] > 0, "signs": sim.qpos > [[0, -9]]}


mjenv.register("Flags-v0", Flags)


def test_bools_in_infos() -> None:
    """Python's bools in single environments, of which Gymnasium's vectors make arrays of bools."""
    envs, env = mjenv.make_vec("Flags-v0", 8, autoreset_mode="same_step"), mjenv.make("Flags-v0")
    ones = gymnasium.vector.SyncVectorEnv([lambda: mjenv.make("Flags-v0")] * 8, autoreset_mode="SameStep")
    results = [(each.reset(seed=1), *(each.step(np.ones((8, 1))) for _ in range(6))) for each in (envs, ones)]
    assert flat(results[0][0][1]) == flat(results[1][0][1])
    assert results[0][0][1]["still"].dtype == np.bool_
    for ours, theirs in zip(results[0][1:], results[1][1:], strict=True):
        assert flat(ours[4]) == flat(theirs[4])
    info = results[0][1][4]
    assert info["is_success"].dtype == info["signs"].dtype == np.bool_
    assert 0 < info["is_success"].sum() < 8
    assert env.reset(seed=1)[1]["still"] is True
    info = env.step(np.ones(1))[4]
    assert isinstance(info["is_success"], bool)
    assert info["signs"].dtype == np.bool_


class Pendulum(mjenv.Task):
    model = PENDULUM
    needs = ("qpos", "qvel", "xpos", "time")
    state = {"goal": (2,), "count": ()}  # noqa: RUF012
    options = {"reach": Setting(0.5, "how far", low=0, high=1), "label": "a"}  # noqa: RUF012
    fault = ""
    reach: float

    def reset(self, rng: Random, rows: int) -> tuple[Any, ...]:
        qpos = rng.normal(0.0, 0.1, (rows, self.nq))
        goal = {"goal": rng.uniform(0, self.reach, (rows, 2)), "count": rng.integers(0, 5, rows)}
        return qpos, np.zeros((rows, self.nv)), goal

    def observe(self, sim: Sim) -> Any:
        return np.concatenate([sim.qpos, sim.qvel, sim.goal, sim.count[:, None]], 1)

    def step(self, sim: Sim, action: Any) -> tuple[Any, ...]:
        sim.count[...] += 1
        return sim.time, sim.time > 1, {"place": sim.xpos[:, 1]}


mjenv.register("Pendulum-v0", Pendulum)


def test_state_belongs_to_the_row() -> None:
    envs = mjenv.make_vec("Pendulum-v0", 3, reach=0.25)
    first, _ = envs.reset(seed=[5, 6, 7])
    assert (first[:, 2:4] < 0.25).all()
    for row, seed in enumerate((5, 6, 7)):
        stream = np.random.default_rng(seed)
        drawn = [*stream.normal(0.0, 0.1, 1), 0, *stream.uniform(0, 0.25, 2), stream.integers(0, 5)]
        np.testing.assert_array_equal(first[row], drawn)
    obs, *_ = envs.step(np.zeros((3, 1)))
    np.testing.assert_array_equal(obs[:, 2:4], first[:, 2:4])
    np.testing.assert_array_equal(obs[:, 4], first[:, 4] + 1)
    envs.copy_row(0, np.array([False, True, False]))
    np.testing.assert_array_equal(envs.observe()[1], obs[0])


class Weighed(Pendulum):
    """Sees masses of its rows, and draws in its steps."""

    needs = ("qpos", "qvel", "xpos", "time", "model.body_mass")

    def observe(self, sim: Sim) -> Any:
        return np.concatenate([sim.goal, sim.model.body_mass], 1)

    def step(self, sim: Sim, action: Any) -> tuple[Any, ...]:
        rows = len(action)
        sim.goal[...] = sim.rng.uniform(0, 2, (rows, 2))
        sim.count[...] = sim.rng.integers(-3, 9, rows) + sim.rng.normal(1.0, 0.5, rows)
        sim.goal[:, 1] = sim.rng.uniform(sim.goal[:, 0].min(), [3.0, 4.0], (rows, 2))[:, 1]  # by NumPy's Generators
        if self.fault == "drawn":
            raise ZeroDivisionError("after draws")
        return sim.count, sim.time < 0, {}


mjenv.register("Weighed-v0", Weighed)


def test_draws_of_steps_are_those_of_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    envs = mjenv.make_vec("Weighed-v0", 3)
    envs.reset(seed=[5, 6, 7])
    with monkeypatch.context() as patch:
        patch.setattr(Weighed, "fault", "drawn")
        with pytest.raises(ZeroDivisionError, match="after draws"):
            envs.step(np.zeros((3, 1)))  # the next step draws the same again
    obs, rewards, *_ = envs.step(np.zeros((3, 1)))
    streams = [np.random.default_rng(seed) for seed in (5, 6, 7)]
    for stream in streams:
        stream.normal(0.0, 0.1, 1), stream.uniform(0, 0.5, 2), stream.integers(0, 5)
    goals = [stream.uniform(0, 2, 2) for stream in streams]
    np.testing.assert_array_equal(rewards, [s.integers(-3, 9) + s.normal(1.0, 0.5) for s in streams])
    least = min(goal[0] for goal in goals)
    last = [stream.uniform(least, [3.0, 4.0], 2)[1] for stream in streams]
    np.testing.assert_array_equal(obs[:, :2], [[goal[0], end] for goal, end in zip(goals, last, strict=True)])


def test_tasks_see_the_rows_own_values_of_the_model() -> None:
    envs = mjenv.make_vec("Weighed-v0", 3, randomize={"body_mass": mjenv.Scale(0.5, 2)})
    first, _ = envs.reset(seed=1)
    np.testing.assert_array_equal(first[:, 2:], np.tile(first[0, 2:], (3, 1)))  # of the model, as of other tasks
    for _ in range(2):
        obs, *_ = envs.step(np.zeros((3, 1)))
        np.testing.assert_array_equal(obs[:, 2:], envs.model.body_mass)
    assert len(np.unique(obs[:, 3])) == 3
    image = envs.snapshot()
    envs.model.body_mass[1] = 0.0, 7.0
    assert envs.observe()[1, 3] == 7
    envs.copy_row(1, np.array([True, False, False]))
    assert envs.observe()[0, 3] == 7
    envs.envs[2].model.body_mass[1] = 3.0
    assert envs.observe()[2, 3] == 3
    env = mjenv.make("Weighed-v0")
    env.reset(seed=1)
    env.unwrapped.model.body_mass[1] = 7.0
    assert env.step(np.zeros(1))[0][3] == 7
    envs.restore(image)
    np.testing.assert_array_equal(envs.observe()[:, 2:], obs[:, 2:])


class Faulty(mjenv.Task):
    """Its methods return what `spoil` makes of their results."""

    model = PENDULUM
    needs = ("qpos", "qvel")
    state = {"count": ()}  # noqa: RUF012
    state_bounds = {"count": (0, 9)}  # noqa: RUF012
    own = ("body_mass",)
    current = True
    action_bounds = ((-1.0, 1.0),)
    spoil: Any = staticmethod(lambda method, found: tuple(found) if isinstance(found, list) else found)

    def reset(self, rng: Random, rows: int) -> tuple[Any, ...]:
        return self.spoil("reset", [rng.uniform(0, 1, (rows, 1)), np.zeros((rows, 1)), {"count": np.zeros(rows)}])

    def observe(self, sim: Sim) -> Any:
        return self.spoil("observe", np.concatenate([sim.qpos, sim.count[:, None]], 1))

    def before_step(self, sim: Sim, action: Any) -> Any:
        return self.spoil("before_step", action.astype(float))

    def step(self, sim: Sim, action: Any) -> tuple[Any, ...]:
        sim.count[...] += 1
        self.spoil("sim", sim)
        return self.spoil("step", [sim.qpos[:, 0].copy(), sim.qpos[:, 0] > 9, {"count": sim.count.copy()}])

    def carry(self, sim: Sim) -> None:
        self.spoil("carry", sim)

    def reset_info(self, sim: Sim) -> Any:
        return self.spoil("reset_info", {"count": sim.count.copy()})


class FaultyRow(Faulty):
    reset = mjenv.Task.reset

    def reset_row(self, start: Any) -> Any:
        return self.spoil("reset_row", {"count": 0.0})


mjenv.register("Faulty-v0", Faulty)
mjenv.register("Faulty-v1", FaultyRow)


def put(part: Any, index: Any, value: Any) -> Callable[[Any], Any]:
    """Writes a value into a part of what a method returns, or of sim."""

    def spoil(found: Any) -> Any:
        where = found if part is None else getattr(found, part) if isinstance(part, str) else found[part]
        where[index] = value
        return found

    return spoil


def fail(found: Any) -> Any:
    raise ZeroDivisionError("in a method")


@pytest.mark.parametrize(
    ("method", "spoil", "error", "message"),
    [
        *[(method, fail, ZeroDivisionError, "in a method") for method in ("reset", "observe", "before_step", "step")],
        *[(method, fail, ZeroDivisionError, "in a method") for method in ("carry", "reset_info", "reset_row")],
        (
            "reset",
            lambda found: found[:2],
            mjenv.TaskError,
            "returned 2 values, not qpos, qvel and a dict of the state",
        ),
        ("reset", put(2, "goal", 0), mjenv.TaskError, r"the state is \['count', 'goal'\], not a dict of \['count'\]"),
        (
            "reset",
            lambda found: [np.ones((3, 2)), *found[1:]],
            mjenv.TaskError,
            r"qpos is float64 of the shape \(3, 2\)",
        ),
        ("reset", put(0, (2, 0), np.nan), mjenv.TaskError, "row 2: .*: qpos has a number that is not finite"),
        (
            "reset",
            lambda found: [*found[:2], {"count": np.array([0, 10, 0])}],
            mjenv.TaskError,
            "row 1: .* 10.0, not 0",
        ),
        ("reset_row", lambda found: None, mjenv.TaskError, r"row 0: .*: the state is \[\], not a dict of \['count'\]"),
        ("reset_row", put(None, "count", [1.0]), mjenv.TaskError, r"row 0: .*: count is float64 of the shape \(1,\)"),
        ("reset_row", put(None, "count", np.nan), mjenv.TaskError, "row 0: .*: the state 'count' has nan, not 0 to 9"),
        ("observe", lambda found: found[:1], mjenv.TaskError, r"float64 of the shape \(1, 2\), not .* \(3, n\)"),
        ("observe", lambda found: found[:, :1], mjenv.TaskError, "returned 1 numbers a row, not 2"),
        ("observe", lambda found: {"a": found}, mjenv.TaskError, r"returned the groups \{'a': 2\}, but at first \{\}"),
        ("observe", put(None, (2, 1), np.nan), mjenv.TaskError, r"row 2: .*: observation\[1\] is NaN"),
        ("before_step", lambda found: found[:1], mjenv.TaskError, r"ctrl is float64 of the shape \(1, 1\)"),
        ("before_step", put(None, (2, 0), np.nan), mjenv.TaskError, r"row 2: .*: ctrl\[0\] is nan"),
        ("step", lambda found: found[0], mjenv.TaskError, r"returned float64 .*, not a reward, terminated and an info"),
        ("step", put(0, 2, np.nan), mjenv.TaskError, "row 2: .*: the reward is NaN"),
        ("step", lambda found: [found[0], found[0], {}], mjenv.TaskError, r"terminated is float64 .*, not bool"),
        ("step", put(2, "new", np.ones(3)), mjenv.TaskError, r"the infos have the shapes .*'new': \(3,\)"),
        (
            "sim",
            put("count", 1, 12),
            mjenv.TaskError,
            "row 1: .*: step or carry: the state 'count' has 12.0, not 0 to 9",
        ),
        ("sim", put("kick", (1, 0), np.nan), mjenv.InvalidValueError, r"row 1: qvel\[0\] is nan, but must be finite"),
        ("sim", lambda sim: put(None, (1, 1), -1)(sim.own["body_mass"]), mjenv.InvalidValueError, "row 1: body_mass"),
        ("sim", put("qpos", 0, 1), ValueError, "read-only"),
        ("carry", put("count", 2, np.nan), mjenv.TaskError, "row 2: .*: step or carry: the state 'count' has nan"),
        ("reset_info", lambda found: {}, mjenv.TaskError, r"the infos have the shapes \{\}, not \{'count': \(3,\)\}"),
    ],
)
def test_methods_that_fail(
    method: str, spoil: Any, error: type[Exception], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The error names the method, the cause and, if it is one row's, the row. The environment can be used again."""
    resets, id = method.startswith("reset"), f"Faulty-v{int(method == 'reset_row')}"
    envs, other = mjenv.make_vec(id, 3), mjenv.make_vec(id, 3)
    obs, _ = envs.reset(seed=0)
    other.reset(seed=0)
    with monkeypatch.context() as patch:

        def spoiled(now: str, found: Any) -> Any:
            found = spoil(found) if now == method else found
            return tuple(found) if isinstance(found, list) else found

        patch.setattr(Faulty, "spoil", staticmethod(spoiled))
        with pytest.raises(error, match=message) as raised:
            envs.reset() if resets else envs.step(np.zeros((3, 1)))
        named = {"sim": "step or carry", "carry": "step or carry"}.get(method, method)
        assert error is not mjenv.TaskError or f"{id}: {named}: " in str(raised.value)
    if method in ("sim", "carry"):
        np.testing.assert_array_equal(envs.observe()[:, 1], obs[:, 1])  # the state is as it was
    if method in ("reset", "reset_row"):
        assert flat(envs.reset()) == flat(other.reset())
    envs.step(np.zeros((3, 1)))


def changed(**attributes: Any) -> type[mjenv.Task]:
    return type("Changed", (Pendulum,), attributes)


@pytest.mark.parametrize(
    ("id", "task", "error", "message"),
    [
        ("Pendulum-v0", Pendulum, mjenv.InvalidValueError, "already registered"),
        ("Ant-v5", Pendulum, mjenv.InvalidValueError, "built-in"),
        ("bad id", Pendulum, mjenv.InvalidValueError, "is malformed"),
        ("New-v0", Pendulum(), mjenv.OptionError, "a class derived from mjenv.Task"),
        ("New-v0", mjenv.Task, mjenv.OptionError, "does not define reset"),
        ("New-v0", changed(state={"qpos": (1,)}), mjenv.InvalidValueError, "both in state and in needs"),
        ("New-v0", changed(options={"step": 1}), mjenv.InvalidValueError, "a name that mjenv.Task uses"),
        ("New-v0", changed(options={"x": None}), mjenv.OptionError, "not None"),
        ("New-v0", changed(frame_skip=0), mjenv.InvalidValueError, "frame_skip is 0"),
        ("New-v0", changed(observe=12345), mjenv.OptionError, "observe is machine code, so reset must be, too"),
        (
            "New-v0",
            changed(observe=lambda self, sim, rng: sim.qpos),
            TypeError,
            r"observe takes \(self, sim\), not \(self, sim, rng\); it cannot draw: draw in step",
        ),
        (
            "New-v0",
            changed(step=lambda self, sim: None),
            TypeError,
            r"step takes \(self, sim, action\), not \(self, sim\)",
        ),
        (
            "New-v0",
            changed(reset=lambda self, rng: None),
            TypeError,
            r"reset takes \(self, rng, rows\), not \(self, rng\)",
        ),
        ("New-v0", changed(carry=lambda self: None), TypeError, r"carry takes \(self, sim\), not \(self\)"),
        ("New-v0", changed(build=lambda self, model, x: None), TypeError, r"build takes \(self, model\), not"),
    ],
)
def test_bad_tasks(id: str, task: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        mjenv.register(id, task)
    assert "New-v0" not in mjenv.ids()


def test_missing_needs() -> None:
    mjenv.register("Lacking-v0", changed(needs=("qpos", "qvel", "nonsense")))
    with pytest.raises(mjenv.Error, match="nonsense"):
        mjenv.make_vec("Lacking-v0", 2)
    mjenv.register("Unlisted-v0", changed(needs=("qpos", "qvel", "time")))
    with pytest.raises(AttributeError, match="sim has no 'xpos'"):
        mjenv.make_vec("Unlisted-v0", 2)


BALL = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body><joint name="height" type="slide" axis="0 0 1"/><geom name="ball" size="0.125"/></body>
  </worldbody>
  <actuator><motor joint="height" ctrllimited="true" ctrlrange="-1 1"/></actuator>
</mujoco>
"""


class Ball(mjenv.Task):
    """A ball whose first row touches the floor, and whose second one is above it."""

    model = BALL
    needs = ("qpos", "contacts")

    def reset(self, rng: Random, rows: int) -> tuple[Any, ...]:
        return np.array([[0.0625], [0.5]])[:rows], np.zeros((rows, 1))

    def observe(self, sim: Sim) -> Any:
        return np.stack([sim.ncon, sim.contact.dist[:, 0], sim.contact.geom2[:, 0]], 1)

    def step(self, sim: Sim, action: Any) -> tuple[Any, ...]:
        normals, forces = sim.contact.frame[:, 0, :3], sim.contact.force[:, 0]
        return sim.contact.geom1[:, 0], sim.ncon > 9, {"normals": normals, "forces": forces}


@pytest.mark.parametrize(
    ("id", "needs"),
    [
        ("Ball-v0", ("qpos", "contacts")),
        ("Ball-v1", ("qpos", "contact")),
        ("Ball-v2", ("ncon", "contact.dist", "contact.geom1", "contact.geom2", "contact.frame", "contact.force")),
    ],
)
def test_contacts(id: str, needs: tuple[str, ...]) -> None:
    mjenv.register(id, type("Ball", (Ball,), {"needs": needs}))
    envs = mjenv.make_vec(id, 2)
    obs, _ = envs.reset(seed=1)
    assert obs.tolist() == [[1, 0.0625 - 0.125, 1], [0, 0, 0]]
    info = envs.step(np.zeros((2, 1)))[4]
    assert info["normals"].tolist() == [[0, 0, 1], [0, 0, 0]]
    pushes = [row.data.qfrc_constraint[0] for row in envs.envs]  # up the slide, as the contact's normal
    assert pushes[0] > 1
    assert info["forces"].ravel() == pytest.approx([pushes[0], *[0.0] * 11])


def test_bad_needs() -> None:
    with pytest.raises(mjenv.OptionError, match="needs is a sequence of names, not 'qpos'"):
        mjenv.register("Text-v0", changed(needs="qpos"))
    with pytest.raises(mjenv.UnknownNameError, match=r"'contact\.torque'.*contacts, contact\.dist"):
        mjenv.register("Force-v0", changed(needs=("contact.torque",)))
    with pytest.raises(mjenv.InvalidValueError, match="'contact' is both in state and in needs"):
        mjenv.register("Taken-v0", changed(needs=("contact.dist",), state={"contact": ()}))


def test_bounds_of_the_state() -> None:
    class Bounded(Pendulum):
        greatest = 4.0

        def build(self, model: Any) -> None:
            self.state_bounds = {"count": (0, self.greatest)}

    mjenv.register("Bounded-v0", Bounded)
    wide = mjenv.make_vec("Bounded-v0", 8)
    wide.reset(seed=1)
    image, row = wide.snapshot(), wide.snapshot(0)
    wide.restore(image)
    Bounded.greatest = 0.0
    narrow = mjenv.make_vec("Bounded-v0", 8)
    fresh = narrow.snapshot()
    with pytest.raises(mjenv.SnapshotError, match=r"carried\[2\] is .*, not 0 to 0"):
        narrow.restore(image)
    with pytest.raises(mjenv.SnapshotError, match=r"carried\[2\] is .*, not 0 to 0"):
        narrow.restore(row, 1)
    assert narrow.snapshot() == fresh
    with pytest.raises(mjenv.TaskError, match="reset: the state 'count' has"):
        narrow.reset(seed=1)
    for bounds, error, message in (
        ({"counts": (0, 1)}, mjenv.OptionError, "'counts', which is not in state"),
        ({"count": (1, 2)}, mjenv.InvalidValueError, "must contain 0"),
        ({"count": (0, np.nan)}, mjenv.InvalidValueError, "must contain 0"),
    ):
        Bounded.build = lambda self, model, bounds=bounds: setattr(self, "state_bounds", bounds)  # type: ignore[assignment, misc]
        with pytest.raises(error, match=message):
            mjenv.make_vec("Bounded-v0", 1)


# ---- Interrupts ----


def is_numpy_rows(code: CodeType) -> bool:
    return code.co_filename == mjenv_batch.rows.__file__


@pytest.mark.parametrize("mode", ["disabled", "next_step"])
def test_an_interrupted_reset_keeps_the_random_streams(mode: str) -> None:
    """A row's stream is where it was before the reset or where the reset has left it."""
    with closing(mjenv.make_vec("NumpyHopper-v5", 2, autoreset_mode=mode)) as envs:

        def streams() -> list[Any]:
            return [envs._pool.rows.stream(row) for row in range(2)]

        envs.reset(seed=1)
        before = streams()
        first = flat(envs.reset())
        after = streams()
        assert all(a != b for a, b in zip(before, after, strict=True))
        instruction = 0
        while True:
            envs.reset(seed=1)
            if not interrupted_before(envs.reset, instruction, is_numpy_rows):
                break
            for row, stream in enumerate(streams()):
                assert stream in (before[row], after[row]), instruction
            envs.step(np.zeros((2, 3))) if mode == "next_step" else envs.reset()
            envs.reset(seed=1)
            assert flat(envs.reset()) == first
            instruction += 1
        assert instruction > 200


def builds_a_task(code: CodeType) -> bool:
    names = ("create", "_build_environment", "prepare", "describe", "_describe_methods", "open")
    files = mjenv.task.registered.__file__, mjenv_batch.registered.__file__
    return code.co_name in names and code.co_filename in files


def test_an_interrupt_of_a_build_is_a_keyboard_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "unraisablehook", lambda _: None)  # ctypes reports what leaves a callback
    instruction = 0
    while interrupted_before(lambda: mjenv.make_vec("NumpyHopper-v5", 2), instruction, builds_a_task):
        instruction += 1
    assert instruction > 200
    with closing(mjenv.make_vec("NumpyHopper-v5", 2)) as envs:
        envs.reset(seed=1)


class OptionalMap(Reach):
    """before_step and compute_reward under options."""

    options = {"maps": False, "pushes": False}  # noqa: RUF012

    def build(self, model: Any) -> None:
        if self.maps:
            self.action_bounds = ((-1.0, 1.0),) * 2
            self.before_step = lambda sim, action: action.sum(axis=1, keepdims=True)
            self.compute_reward = lambda achieved, desired, info: achieved[..., 0] + desired[..., 0]
        if self.pushes:
            self.before_substep = self.before_step


mjenv.register("OptionalMap-v0", OptionalMap)


def test_methods_under_options() -> None:
    plain, mapped = mjenv.make("OptionalMap-v0"), mjenv.make("OptionalMap-v0", maps=True)
    plain.reset(seed=1), mapped.reset(seed=1)
    one, two = plain.step(np.array([0.75]))[0], mapped.step(np.array([0.25, 0.5]))[0]
    assert np.array_equal(one["observation"], two["observation"])
    goal = np.array([2.0])
    assert plain.compute_reward(goal, goal, {}) == 0
    assert mapped.compute_reward(goal, goal, {}) == 4
    with pytest.raises(mjenv.OptionError, match="OptionalMap: before_substep must be machine code"):
        mjenv.make("OptionalMap-v0", pushes=True)


class Stripped(Reach):
    """Methods that build takes away."""

    options = {"plain": False}  # noqa: RUF012

    def build(self, model: Any) -> None:
        for name in ("before_step", "carry", "reset_info") if self.plain else ():
            setattr(self, name, None)

    def before_step(self, sim: Any, action: Any) -> Any:
        return action / 2

    def carry(self, sim: Any) -> None:
        raise RuntimeError("carry was called")

    def reset_info(self, sim: Any) -> dict[str, Any]:
        return {"fresh": np.ones(len(sim.qpos))}


mjenv.register("Stripped-v0", Stripped)


def test_methods_that_build_takes_away() -> None:
    with pytest.raises(RuntimeError, match="carry was called"):
        mjenv.make("Stripped-v0")
    env, as_long = mjenv.make("Stripped-v0", plain=True), mjenv.make("OptionalMap-v0")
    assert env.reset(seed=1)[1] == {}
    as_long.reset(seed=1)
    action = np.array([0.75])
    assert flat(env.step(action)[0]) == flat(as_long.step(action)[0])


def test_observing_and_resetting_one_row_sees_that_row_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    envs, alone = mjenv.make_vec("NumpyHopper-v5", 50), mjenv.make("Hopper-v5")
    envs.reset(seed=1)
    alone.reset(seed=4)
    rows, observe = [], NumpyHopper.observe
    monkeypatch.setattr(NumpyHopper, "observe", lambda task, sim: [rows.append(len(sim.qpos)), observe(task, sim)][1])
    state = np.array([0, 1.2, 0.1, 0, 0, 0]), np.array([0, 1.0, 0, 2, 0, 0])
    for row in envs.envs[2:4]:
        row.set_state(*state)
    alone.set_state(*state)
    assert flat(envs.envs[3].observe()) == flat(alone.observe())
    assert flat(envs.envs[3].reset(seed=8)[0]) == flat(alone.reset(seed=8)[0])
    assert rows == [1, 1]
    # A reset of some rows still returns the others' observations as they are.
    seen = envs.reset(options={"reset_mask": np.arange(50) == 7})[0]
    alone.set_state(*state)
    assert flat(seen[2]) == flat(alone.observe())


def test_restoring_one_row_reads_that_row_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    envs = mjenv.make_vec("NumpyHopper-v5", 50)
    envs.reset(seed=1)
    image, rows = envs.snapshot(3), []
    for name in ("_numbers", "_read_row"):
        read = getattr(NumpyRows, name)
        seen = lambda self, row, *rest, read=read: (rows.append(row), read(self, row, *rest))[1]  # noqa: E731
        monkeypatch.setattr(NumpyRows, name, seen)
    envs.restore(image, 7)
    assert set(rows) == {7}
    assert envs.snapshot(7) == image


@pytest.mark.skipif(not INTERPRETERS, reason="this Python has no subinterpreters")
def test_after_subinterpreters() -> None:
    """In Python 3.10 and 3.11, each of them gives ctypes.POINTER other types in this interpreter."""
    said = run(
        f"""
import {INTERPRETERS} as interpreters
import numpy as np

class Slider(mjenv.Task):
    model = {PENDULUM!r}
    current = True
    own = ("body_mass",)

    def reset_row(self, start):
        start.qpos[0] = start.rng.uniform(-1, 1)
        start.own["body_mass"][1] = start.sim.xpos[1, 2] + 1

    def observe(self, sim):
        return np.concatenate([sim.qpos, sim.own["body_mass"]], axis=1)

    def step(self, sim, action):
        return sim.qpos[:, 0], sim.qpos[:, 0] > 9, {{}}

for version in range(3):
    mjenv.register("Slider-v%d" % version, Slider)
    env = mjenv.make("Slider-v%d" % version)
    print(*(part.tobytes() for part in (env.reset(seed=3)[0], env.step(np.ones(1))[0])))
    inner = interpreters.create()
    interpreters.run_string(inner, "import ctypes")
    interpreters.destroy(inner)"""
    )
    first, *others = said.splitlines()
    assert others == [first, first]
