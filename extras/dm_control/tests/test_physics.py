"""env.physics in the place of dm_control's: values, names, writes, errors, and dm_control's wrappers on it."""

from __future__ import annotations

import copy
import inspect
import pickle
import sys
from collections.abc import Callable
from typing import Any

import dm_env
import mujoco
import numpy as np
import pytest
from dm_control import suite as theirs
from dm_control.mujoco.index import RaggedNamedAxis, RegularNamedAxis
from dm_control.rl.control import PhysicsError
from dm_control.suite.wrappers import action_noise, action_scale
from test_suite import assert_same_episodes, assert_same_step

import mjenv
from conftest import TASKS as ALL
from conftest import actions
from mjenv_dm_control import suite as ours

# Of each kind: free joints, tendons, mocap bodies, actuators with a state, sensors.
TASKS = [
    ("humanoid", "walk"),
    ("quadruped", "fetch"),
    ("manipulator", "bring_peg"),
    ("cartpole", "three_poles"),
    ("fish", "swim"),
]
# What the library and dm_control need not have in common: memory that MuJoCo has not written in the last step, and
# forces (cacc, cfrc_int, cfrc_ext), which the library computes when they are read, and dm_control for some sensors.
UNCOMPARED = (
    "cacc",
    "cfrc_",
    "efc_",
    "qLD",
    "qM",
    "qH",
    "qDeriv",
    "D_",
    "B_",
    "moment",
    "iefc",
    "wrap_",
    "ten_J",
    "contact",
    "actuator_moment",
)


def pair(task: tuple[str, str], seed: int = 3, steps: int = 5) -> tuple[Any, Any]:
    """The environments of the library and of dm_control after some steps."""
    envs = ours.load(*task, {"random": seed}), theirs.load(*task, {"random": seed})
    assert_same_episodes(*envs, seed, steps)
    return envs


def keys(axis: Any) -> list[Any]:
    """Indices of an axis of dm_control's: each name, and a list of them."""
    names = [name for name in axis.names if name] if isinstance(axis, (RegularNamedAxis, RaggedNamedAxis)) else []
    return [*names, names[::-1], slice(None), 0] if names else [slice(None), 0]


@pytest.mark.parametrize("task", TASKS, ids="-".join)
def test_named(task: tuple[str, str]) -> None:
    envs = pair(task)  # dm_control's named arrays do not keep their simulation
    got, want = (env.physics.named for env in envs)
    compared = 0
    for part in ("model", "data"):
        for name, field in getattr(want, part)._asdict().items():
            if name.startswith(UNCOMPARED) or field.size == 0 or not hasattr(getattr(got, part)._arrays, name):
                continue
            mine = getattr(getattr(got, part), name)
            assert mine.shape == field.shape, name
            for key in keys(field.axes.row):
                np.testing.assert_array_equal(mine[key], field[key], f"{name}[{key!r}]")
                compared += 1
                if field.ndim > 1 and not isinstance(key, list):
                    for column in keys(field.axes.col):
                        np.testing.assert_array_equal(
                            mine[key, column], field[key, column], f"{name}[{key!r}, {column!r}]"
                        )
    assert compared > 300


def test_names_of_objects() -> None:
    envs = pair(("quadruped", "fetch"), steps=0)
    got, want = (env.physics.model for env in envs)
    assert got.name == want.name == "quadruped"
    assert got.name2id("torso", mujoco.mjtObj.mjOBJ_BODY) == want.name2id("torso", mujoco.mjtObj.mjOBJ_BODY)
    assert got.name2id("self", mujoco.mjtObj.mjOBJ_MATERIAL) == want.name2id("self", mujoco.mjtObj.mjOBJ_MATERIAL)
    with pytest.raises(KeyError, match="no objects of type 77"):
        got.name2id("torso", 77)
    for kind in ("body", "joint", "geom", "site", "camera", "material", "tendon", "actuator", "sensor"):
        for index in range({"body": want.nbody, "camera": want.ncam}.get(kind, 3)):
            name = want.id2name(index, kind)
            assert got.id2name(index, kind) == name
            assert not name or got.name2id(name, kind) == want.name2id(name, kind) == index


@pytest.mark.parametrize("task", TASKS, ids="-".join)
def test_values(task: tuple[str, str]) -> None:
    envs = pair(task)
    got, want = (env.physics for env in envs)
    for name in ("timestep", "time", "control", "activation", "position", "velocity", "state", "get_state"):
        mine, wanted = getattr(got, name)(), getattr(want, name)()
        np.testing.assert_array_equal(mine, wanted, name)
    assert got.model.opt.timestep == want.model.opt.timestep
    assert got.model.opt.gravity.tolist() == want.model.opt.gravity.tolist()
    assert got.model.ncam == want.model.ncam


@pytest.mark.parametrize(
    "task", [("cheetah", "run"), ("cartpole", "swingup"), ("humanoid", "stand"), ("quadruped", "walk")], ids="-".join
)
def test_writes(task: tuple[str, str]) -> None:
    """A state that is written in reset_context, controls, and steps of the simulation."""
    envs = pair(task)
    for physics in (env.physics for env in envs):
        random = np.random.RandomState(7)
        with physics.reset_context():
            physics.named.data.qpos[:] = physics.named.data.qpos + random.uniform(0, 0.1, physics.model.nq)
            physics.data.qvel[:] = random.uniform(-1, 1, physics.model.nv)
    np.testing.assert_array_equal(envs[0].physics.data.xpos, envs[1].physics.data.xpos)
    for _ in range(20):
        control = random.uniform(-1, 1, envs[0].physics.model.nu)
        for env in envs:
            env.physics.set_control(control)
            env.physics.step(2)
        np.testing.assert_array_equal(envs[0].physics.state(), envs[1].physics.state())
    draw = actions(envs[1], 1)
    for _ in range(10):
        action = draw()
        assert_same_step(envs[0].step(action), envs[1].step(action))


def test_writes_of_the_model() -> None:
    envs = pair(("cheetah", "run"))
    for physics in (env.physics for env in envs):
        physics.named.model.dof_damping["bthigh"] = 30
        physics.named.model.geom_friction["ffoot", 0] = 2
        physics.model.opt.timestep = 0.005
        physics.named.model.body_mass[["torso", "ffoot"]] *= 1.5
    assert envs[0].physics.timestep() == 0.005
    assert_same_episodes(*envs, 4, 30)


def test_state_is_written() -> None:
    """set_state and forward, as programs that plan use them."""
    envs = pair(("cheetah", "run"))
    states = [env.physics.get_state() for env in envs]
    for env in envs:
        env.step(np.ones(6))
    for env, state in zip(envs, states, strict=True):
        env.physics.set_state(state)
        with pytest.raises(ValueError, match="Input physics state has shape"):
            env.physics.set_state(state[1:])
    np.testing.assert_array_equal(envs[0].physics.state(), envs[1].physics.state())


@pytest.mark.parametrize("task", [("cheetah", "run"), ("lqr", "lqr_2_1")], ids="-".join)
def test_random_state(task: tuple[str, str]) -> None:
    """A RandomState of the caller is drawn from as dm_control does, and numbers that others draw move it."""
    randoms = [np.random.RandomState(11) for _ in range(2)]
    envs = [suite.load(*task, {"random": random}) for suite, random in zip((ours, theirs), randoms, strict=True)]
    assert all(env.task.random is random for env, random in zip(envs, randoms, strict=True))
    for _ in range(3):
        assert_same_step(envs[0].reset(), envs[1].reset())
        assert randoms[0].randn() == randoms[1].randn()


@pytest.mark.parametrize(
    "copied", [lambda physics: physics.copy(), copy.deepcopy, lambda p: pickle.loads(pickle.dumps(p))]
)
def test_copies(copied: Callable[[Any], Any]) -> None:
    """A copy of the physics goes on by itself, and has the model's written values."""
    envs = pair(("cheetah", "run"))
    copies = []
    for env in envs:
        env.physics.named.model.dof_damping["bthigh"] = 30
        env.physics.after_reset()
        copies.append(copied(env.physics))
        for _ in range(3):
            copies[-1].set_control(np.ones(6))
            copies[-1].step(2)
        assert copies[-1].time() > env.physics.time()
    np.testing.assert_array_equal(copies[0].state(), copies[1].state())
    assert_same_step(*(env.step(np.zeros(6)) for env in envs))


@pytest.mark.parametrize("domain", sorted({domain for domain, _ in ALL}))
def test_methods_of_the_domain(domain: str) -> None:
    """What dm_control adds to the physics of a domain: torso_upright() of walker, for example."""
    task = next(task for name, task in ALL if name == domain)
    envs = pair((domain, task))
    called = 0
    for name, method in vars(type(envs[1].physics)).items():
        if name.startswith("_") or len(inspect.signature(method).parameters) > 1:
            continue
        try:
            want = method(envs[1].physics)
        except (KeyError, IndexError):  # of an object that only other tasks of the domain have
            continue
        np.testing.assert_array_equal(getattr(envs[0].physics, name)(), want, name)
        called += 1
    assert called > 0 or domain in ("stacker", "manipulator")


def test_absent_methods(monkeypatch: pytest.MonkeyPatch) -> None:
    physics = ours.load("cheetah", "run").physics
    for name in ("contexts", "reload_from_xml_string", "jump"):
        with pytest.raises(AttributeError, match=f"physics has no '{name}'; docs/from-dm_control.md lists"):
            getattr(physics, name)
    monkeypatch.setitem(sys.modules, "dm_control.suite.cheetah", None)
    with pytest.raises(AttributeError, match=r"physics has no 'speed'.*pip install dm_control"):
        physics.speed()


def test_random_of_the_task() -> None:
    envs = pair(("cartpole", "balance"))
    for _ in range(3):
        assert envs[0].task.random.uniform() == envs[1].task.random.uniform()
        assert_same_step(envs[0].reset(), envs[1].reset())


@pytest.mark.parametrize(
    "wrap", [lambda env: action_scale.Wrapper(env, -0.5, 2.0), lambda env: action_noise.Wrapper(env, 0.1)]
)
def test_wrappers(wrap: Any) -> None:
    got, want = (wrap(suite.load("walker", "walk", {"random": 5})) for suite in (ours, theirs))
    assert got.action_spec() == want.action_spec()
    for _ in range(2):
        assert_same_episodes(got, want, 5, 10)


def test_order() -> None:
    """A step before the first reset, and one after the last step of an episode, begin an episode."""
    got, want = (suite.load("cartpole", "swingup", {"random": 1, "time_limit": 0.03}) for suite in (ours, theirs))
    types = []
    for _ in range(9):
        steps = [env.step([0.5]) for env in (got, want)]
        assert_same_step(*steps)
        types.append(steps[0].step_type)
    assert types == 2 * [dm_env.StepType.FIRST, *2 * [dm_env.StepType.MID], dm_env.StepType.LAST] + [
        dm_env.StepType.FIRST
    ]


def test_physics_errors() -> None:
    for suite in (ours, theirs):
        env = suite.load("cheetah", "run", {"random": 1})
        env.reset()
        with pytest.raises(PhysicsError, match="BADCTRL"):
            env.step(np.full(6, np.nan))
        env.reset()
        env.physics.data.qvel[:] = 1e11
        with pytest.raises(PhysicsError, match="Physics state is invalid"):
            env.step(np.zeros(6))
        env.reset()
        assert np.isfinite(env.step(np.zeros(6)).reward)


def test_full_contact_buffer() -> None:
    """A humanoid that is folded into itself has more contacts than MuJoCo 2.2.2 keeps."""
    raised: dict[Any, list[str]] = {ours: [], theirs: []}
    for suite, messages in raised.items():
        env = suite.load("humanoid_CMU", "run", {"random": 1})
        env.reset()
        random = np.random.RandomState(1)
        for fold in (0.1, 3):
            qpos = random.uniform(-fold, fold, len(env.physics.data.qpos))
            qpos[:3] = 0, 0, -1  # in the floor
            with env.physics.suppress_physics_errors(), env.physics.reset_context():
                env.physics.data.qpos[:] = qpos
                env.physics.model.opt.timestep = 1e-9  # so that it is still folded after a step
            for call in (env.physics.after_reset, env.physics.step, lambda env=env: env.step(np.zeros(56))):
                try:
                    call()
                    messages.append("")
                except PhysicsError as error:
                    messages.append(str(error))
    assert raised[ours] == raised[theirs]
    if mujoco.__version__.startswith("2."):  # 4.0 finds memory for all contacts
        full = "Physics state is invalid. Warning(s) raised: mjWARN_CONTACTFULL"
        assert raised[ours] == [*[""] * 3, *[full] * 3]


def message_of(call: Callable[[], Any]) -> str:
    """What PhysicsError says; "" if nothing is raised."""
    try:
        call()
    except PhysicsError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("task", [("humanoid_CMU", "stand"), ("cheetah", "run"), ("acrobot", "swingup")], ids="-".join)
def test_errors_in_the_middle_of_steps(task: tuple[str, str]) -> None:
    """States from which MuJoCo warns in some timesteps of a step, and then often no longer, because it has pushed
    bodies apart or has begun again: errors, and the states after them, are equal."""
    envs = [suite.load(*task, {"random": 1}) for suite in (ours, theirs)]
    most = int(envs[1].physics.model.nconmax)
    random = np.random.RandomState(1)
    early = set()
    for _ in range(40):
        qpos = random.uniform(-3, 3, envs[1].physics.model.nq)
        qvel = random.uniform(-1, 1, envs[1].physics.model.nv) * 10.0 ** random.uniform(0, 9)
        said = []
        for env in envs:
            env.reset()
            with env.physics.suppress_physics_errors(), env.physics.reset_context():
                env.physics.data.qpos[:] = qpos
                env.physics.data.qvel[:] = qvel
            said.append([message_of(lambda env=env: env.step(np.zeros(env.action_spec().shape))) for _ in range(2)])
        assert said[0] == said[1]
        np.testing.assert_array_equal(envs[0].physics.state(), envs[1].physics.state())
        if most < 0 or envs[1].physics.data.ncon < most:  # MuJoCo 4.0 has no such limit
            early |= {*said[1]}
    wanted = "CONTACTFULL" if task[0] == "humanoid_CMU" and most > 0 else "BADQ"
    assert any(wanted in message for message in early)


def test_suppressed_errors(caplog: pytest.LogCaptureFixture) -> None:
    """Inside suppress_physics_errors, an environment goes on as dm_control's does: with motors at rest, for example,
    if an action is not finite."""
    envs = pair(("cheetah", "run"))
    for env in envs:
        with env.physics.suppress_physics_errors():
            env.step(np.full(6, np.nan))
    assert "mjWARN_BADCTRL" in caplog.text
    np.testing.assert_array_equal(envs[0].physics.state(), envs[1].physics.state())
    assert_same_step(*(env.step(np.ones(6)) for env in envs))


def test_errors() -> None:
    physics = ours.load("cheetah", "run", {"random": 1}).physics
    with pytest.raises(KeyError, match="no name 'torsi' here; there are torso"):
        physics.named.data.xpos["torsi"]
    with pytest.raises(IndexError, match="1 dimension"):
        physics.named.data.qpos["bthigh", "z"]
    with pytest.raises(IndexError, match="no index"):
        physics.named.data.qpos[...]
    with pytest.raises(AttributeError, match="has no 'xposs'"):
        physics.named.data.xposs["torso"]
    with pytest.raises(mjenv.errors.UnknownNameError, match="no camera 'front', but side, back"):
        physics.render(camera_id="front")
    with pytest.raises(ValueError, match="the model has 2 cameras"):
        physics.render(camera_id=2)
    with pytest.raises(ValueError, match="cannot both be"):
        physics.render(depth=True, segmentation=True)
    with pytest.raises(KeyError, match="render_flag_overrides has 'wires'"):
        physics.render(render_flag_overrides={"wires": True})
    with pytest.raises(TypeError, match="overlays"):
        physics.render(overlays=["text"])
