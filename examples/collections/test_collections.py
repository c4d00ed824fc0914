"""The adapters equal the packages that they stand for."""

import importlib
import sys
import types
from importlib.util import find_spec
from pathlib import Path

import mo_gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium_robotics import mamujoco_v1
from multi_agent import MultiAgentRows, parallel_env
from multi_objective import ROBOTS, MultiObjective, rewards
from safe_velocity import LIMITS, SafeVelocity, cost

import mjenv
from mjenv.capi.engine import name_of

ENGINE = name_of(mujoco.__version__)
SAFETY, OGBENCH = (Path(find_spec(name).origin).parent for name in ("safety_gymnasium", "ogbench"))
AGENTS = {
    "Ant": "2x4", "HalfCheetah": "6x1", "Hopper": "3x1", "Humanoid": "9|8", "HumanoidStandup": "9|8", "Swimmer": "2x1",
    "Walker2d": "2x3", "Reacher": "2x1", "Pusher": "3p",
}  # fmt: skip
OF_ROWS = list(AGENTS)[:6]  # Walker2d's agents see velocities that its observation clips; the last two have no mapping


def same(ours, theirs, steps=300):
    """Plays an episode in both and compares all numbers that steps and resets return."""
    np.testing.assert_equal(ours.reset(seed=5)[0], theirs.reset(seed=5)[0])
    rng = np.random.default_rng(0)
    for _ in range(steps):
        action = rng.uniform(-1, 1, ours.action_space.shape).astype(np.float32)
        mine, other = ours.step(action)[:-1], theirs.step(action)[:-1]
        np.testing.assert_equal(mine, other)
        if any(other[-2:]):
            break


@pytest.mark.parametrize("name", [*ROBOTS, "hopper-2obj", "ant-2obj"])
def test_multi_objective(name):
    ours, theirs = MultiObjective(f"mo-{name}-v5", engine=ENGINE), mo_gymnasium.make(f"mo-{name}-v5")
    for names in ("reward_dim", "reward_space"):
        assert getattr(ours.unwrapped, names) == getattr(theirs.unwrapped, names)
    same(ours, theirs)


def original(robot):
    """Safety-Gymnasium's own class. Its package needs Gymnasium 0.28.1; these modules of it do not."""
    for name in ("safety_gymnasium", "safety_gymnasium.tasks", "safety_gymnasium.utils"):
        sys.modules.setdefault(name, types.ModuleType(name)).__path__ = [str(SAFETY.joinpath(*name.split(".")[1:]))]
    name = {"HalfCheetah": "half_cheetah"}.get(robot, robot.lower())
    module = importlib.import_module(f"safety_gymnasium.tasks.safe_velocity.safety_{name}_velocity_v1")
    return getattr(module, f"Safety{robot}VelocityEnv")()


@pytest.mark.parametrize("robot", LIMITS)
def test_safe_velocity(robot):
    ours, theirs = SafeVelocity(robot, engine=ENGINE), original(robot)
    theirs._velocity_threshold, saved = 0.3, theirs._velocity_threshold
    assert saved == LIMITS[robot]
    LIMITS[robot] = 0.3  # which random actions exceed
    try:
        same(ours, theirs)
    finally:
        LIMITS[robot] = saved


@pytest.mark.parametrize(("robot", "agents"), AGENTS.items())
def test_multi_agent(robot, agents):
    ours, theirs = parallel_env(robot, agents, engine=ENGINE), mamujoco_v1.parallel_env(robot, agents, agent_obsk=1)
    theirs.k_dicts = ours.k_dicts  # MaMuJoCo orders three joints of the Pusher by chance
    rng, other = np.random.default_rng(0), theirs.reset(seed=3)[0]
    np.testing.assert_equal(ours.reset(seed=3)[0], other)
    rows = MultiAgentRows(robot, agents, 2, engine=ENGINE) if robot in OF_ROWS else None
    if rows:
        np.testing.assert_equal({agent: obs[0] for agent, obs in rows.reset(seed=3)[0].items()}, other)
    for _ in range(100):
        actions = {a: rng.uniform(-1, 1, theirs.action_space(a).shape).astype(np.float32) for a in theirs.agents}
        other = theirs.step(actions)[:4]
        np.testing.assert_equal(ours.step(actions)[:4], other)
        if rows:
            obs, *results = rows.step({agent: np.stack([action, action]) for agent, action in actions.items()})
            np.testing.assert_equal({agent: of_rows[0] for agent, of_rows in obs.items()}, other[0])
            np.testing.assert_equal([values[0] for values in results[:3]], [values["agent_0"] for values in other[1:]])
        if not theirs.agents:
            break


@pytest.mark.parametrize(
    ("id", "single", "of_rows", "result"),
    [
        ("Hopper-v5", lambda: MultiObjective("mo-hopper-v5", engine=ENGINE), lambda i: rewards("Hopper", i, 1e-3), 1),
        ("Ant-v4", lambda: SafeVelocity("Ant", engine=ENGINE), lambda info: cost("Ant", info), 2),
    ],
)
def test_rows(id, single, of_rows, result):
    """All rows of a vector have the reward vectors and the costs of single environments."""
    envs, singles = mjenv.make_vec(id, 3, engine=ENGINE), [single() for _ in range(3)]
    envs.reset(seed=1)
    for row, env in enumerate(singles):
        env.reset(seed=1 + row)
    for _ in range(8):
        actions = envs.action_space.sample()
        values = of_rows(envs.step(actions)[-1])
        np.testing.assert_array_equal(values, [env.step(actions[row])[result] for row, env in enumerate(singles)])


@pytest.mark.skipif(ENGINE != "4.0", reason="OGBench needs MuJoCo 3.1.6")
@pytest.mark.parametrize("size", ["medium", "large", "giant", "teleport"])
@pytest.mark.parametrize("robot", ["point", "ant"])
def test_ogbench(robot, size):
    sys.modules.setdefault("ogbench", types.ModuleType("ogbench")).__path__ = [str(OGBENCH)]  # without dm_control
    original, ours = (importlib.import_module(name) for name in ("ogbench.locomaze.maze", "ogbench_mazes"))
    found = []
    for module in (ours, original):
        env = module.make_maze_env(robot, "maze", maze_type=size, terminate_at_goal=False)
        assert isinstance(env, mjenv.MujocoEnv) == (module is ours)
        np.random.seed(0), env.action_space.seed(0)
        found.append([env.reset(seed=seed) for seed in (0, None)])
        if size == "teleport":
            env.set_xy(np.array(env._teleport_info["teleport_in_xys"][0]))
        found[-1] += [env.step(env.action_space.sample()) for _ in range(100)]
    np.testing.assert_equal(*found)
