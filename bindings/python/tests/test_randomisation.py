"""Randomisation, noise, delays and pushes in Python: the keywords, their checks, specs, pickles and the command line.

tests/live compares the draws with Gymnasium's.
"""

from __future__ import annotations

import copy
import json
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

import mjenv
from mjenv import Delay, Noise, Offset, Push, Same, Scale, Value

SETTINGS: dict[str, Any] = {
    "randomize": {
        "geom_friction": Scale(0.5, 1.5, columns=0),
        "body_mass": [Scale(0.8, 1.2, "log_uniform", shared=True), Offset(-0.5, 0.5, body="torso", set_constants=True)],
        "opt.gravity": Value(choices=(-9.0, -10.0), elements=[2]),
        "actuator_gear": Scale(0.9, 1.1, columns=0),
        "dof_armature": [Same(elements=[3, 4, 5]), Same(factor=0.5, elements=[0, 1, 2])],
    },
    "noise": Noise(0.1, 0.01),
    "delay": Delay(1, (1, 2)),
    "push": Push("torso", ((-20.0, 20.0), (-20.0, 20.0), (0.0, 0.0)), every=(2, 5)),
}


def played(env: Any, seed: int | None = 1, steps: int = 12) -> list[Any]:
    """The observations and rewards of a few steps."""
    shape = env.action_space.shape
    found: list[Any] = [env.reset(seed=seed)[0]]
    for t in range(steps):
        obs, reward, *_ = env.step(np.full(shape, 0.1 * np.sin(t), np.float32))
        found += [obs, np.asarray(reward)]
    return found


def assert_same(a: list[Any], b: list[Any]) -> None:
    assert len(a) == len(b)
    for x, y in zip(a, b, strict=True):
        np.testing.assert_array_equal(x, y)


def test_what_is_drawn() -> None:
    env = mjenv.make("Hopper-v5", randomize=SETTINGS["randomize"])
    own = {name: np.array(getattr(env.model, name)) for name in ("geom_friction", "body_mass")}
    env.reset(seed=5)
    friction, mass = np.array(env.model.geom_friction), np.array(env.model.body_mass)
    factor = friction[:, 0] / own["geom_friction"][:, 0]
    assert ((factor >= 0.5) & (factor <= 1.5)).all()
    assert len(set(factor)) == len(factor)
    np.testing.assert_array_equal(friction[:, 1:], own["geom_friction"][:, 1:])
    assert len(set((mass[2:] / own["body_mass"][2:]).round(12))) == 1
    assert abs(mass[1] - own["body_mass"][1]) <= 0.5
    assert env.model.opt.gravity[2] in (-9.0, -10.0)
    assert env.model.body_subtreemass[1] == pytest.approx(mass[1:].sum())
    other = mjenv.make("Hopper-v5")
    assert_same([other.reset(seed=5)[0]], [env.reset(seed=5)[0]])


@pytest.mark.parametrize("row", range(3))
def test_a_row_is_an_environment(row: int) -> None:
    envs, env = mjenv.make_vec("Hopper-v5", 3, num_threads=2, **SETTINGS), mjenv.make("Hopper-v5", **SETTINGS)
    many, one = played(envs, 4), played(env, 4 + row)
    assert_same([x[row] for x in many], one)


def test_specs_pickles_and_copies_keep_the_settings() -> None:
    env = mjenv.make("Hopper-v5", **SETTINGS)
    expected = played(env)
    assert env.spec is not None
    assert_same(played(mjenv.make(env.spec)), expected)
    assert_same(played(gymnasium.make(env.spec, disable_env_checker=True)), expected)
    assert_same(played(gymnasium.make("mjenv/Hopper-v5", disable_env_checker=True, **SETTINGS)), expected)
    text = env.spec.to_json()
    json.loads(text)
    assert_same(played(mjenv.make(EnvSpec.from_json(text))), expected)
    assert_same(played(mjenv.make("Hopper-v5", **json.loads(json.dumps(env.randomization)))), expected)
    twins = pickle.loads(pickle.dumps(env)), copy.deepcopy(env)
    later = played(env, None)
    for twin in twins:
        assert_same(played(twin, None), later)
    envs = mjenv.make_vec("Hopper-v5", 2, **SETTINGS)
    assert envs.randomization == env.randomization
    together = played(envs)
    assert envs.spec is not None
    assert_same(played(gymnasium.make_vec(envs.spec)), together)
    other = pickle.loads(pickle.dumps(envs))
    assert_same(played(other), played(envs))


def test_snapshots_need_the_same_settings() -> None:
    env, plain = mjenv.make("Hopper-v5", **SETTINGS), mjenv.make("Hopper-v5")
    env.reset(seed=1)
    image = env.snapshot()
    with pytest.raises(mjenv.SnapshotError, match="randomisation"):
        plain.restore(image)
    later = played(env, None)
    plain.randomize(SETTINGS["randomize"])
    plain.perturb(SETTINGS["noise"], SETTINGS["delay"], SETTINGS["push"])
    plain.restore(image)
    assert_same(played(plain, None), later)
    plain.randomize(None)
    plain.perturb()
    assert_same(played(plain, 3)[:1], played(mjenv.make("Hopper-v5"), 3)[:1])


KICKS: dict[str, Any] = {
    "push": [
        Push("torso", ((-9.0, 9.0),) * 3, every=(1, 4), duration=(2, 5)),
        Push("torso", velocity=((-0.5, 0.5), (-0.5, 0.5), (0.0, 0.0)), every=(2, 6)),
    ]
}


@pytest.mark.parametrize("lanes", [0, "auto"])
def test_images_in_the_middle_of_a_push(lanes: int | str) -> None:
    """A row goes on from an image, in another row and environment, as it would have gone on; with threads and lanes."""
    envs = mjenv.make_vec("Ant-v5", 6, num_threads=2, lanes=lanes, **KICKS)
    one = mjenv.make_vec("Ant-v5", 1, **KICKS)
    action = np.full((6, 8), 0.2, np.float32)
    envs.reset(seed=3)
    for _ in range(40):
        lasting = envs.data.xfrc_applied.any(axis=(1, 2))
        images = [envs.snapshot(row) for row in range(6)]
        obs, rewards, *_ = envs.step(action)
        row = int(np.argmax(lasting))  # one that is pushed, if there is any
        one.restore(images[row], 0)
        alone, reward, *_ = one.step(action[:1])
        assert_same([alone[0], reward[0]], [obs[row], rewards[row]])
        np.testing.assert_array_equal(one.data.qvel[0], envs.data.qvel[row])
    other = mjenv.make_vec("Ant-v5", 6, lanes=0, **KICKS)
    other.restore(envs.snapshot())
    for _ in range(10):
        assert_same([*envs.step(action)[:2]], [*other.step(action)[:2]])


def test_a_lasting_force_ends_when_its_settings_do() -> None:
    env = mjenv.make("Ant-v5", push=Push("torso", ((9.0, 9.0),) * 3, every=(1, 1), duration=50))
    env.reset(seed=1)
    for _ in range(3):
        env.step(np.zeros(8))
    assert env.data.xfrc_applied[1].tolist() == [9, 9, 9, 0, 0, 0]
    env.perturb()
    assert not env.data.xfrc_applied.any()


def test_the_stream_is_one() -> None:
    """Numbers that the user draws, and those that steps draw, come from one stream."""
    env = mjenv.make("Hopper-v5", noise=Noise(action=0.1))
    env.reset(seed=1)
    rng = np.random.default_rng(1)
    rng.uniform(size=env.model.nq + env.model.nv)
    assert env.np_random.random() == rng.random()
    env.step(np.zeros(3))
    rng.normal(0, 0.1, 3)
    assert env.np_random.random() == rng.random()
    env.np_random.integers(5)  # leaves a buffered half
    env.step(np.zeros(3))
    rng.integers(5)
    rng.normal(0, 0.1, 3)
    assert env.np_random.bit_generator.state == rng.bit_generator.state


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"randomize": []}, mjenv.OptionError, "names of arrays"),
        ({"randomize": {"body_mass": 2}}, mjenv.OptionError, "randomize.body_mass: an object"),
        ({"randomize": {"body_mass": {"kind": "other"}}}, mjenv.InvalidValueError, "body_mass.kind"),
        ({"randomize": {"body_mass": {"kind": "scale", "lowest": 1}}}, mjenv.UnknownNameError, "lowest"),
        ({"randomize": {"bodymass": Scale(1, 2)}}, mjenv.Error, "bodymass"),
        ({"randomize": {"body_mass": Scale(2, 1)}}, mjenv.InvalidValueError, "above high"),
        ({"randomize": {"body_mass": Scale(1)}}, mjenv.OptionError, "low, high"),
        ({"randomize": {"body_mass": Scale(1, 2, "normal")}}, mjenv.OptionError, "mean, std"),
        ({"randomize": {"body_mass": Scale(1, 2, "beta")}}, mjenv.InvalidValueError, "distribution: there is no"),  # type: ignore
        ({"randomize": {"body_mass": Scale(1, 2, geom=1)}}, mjenv.OptionError, "not selected by geom"),
        ({"randomize": {"body_mass": Scale(1, 2, body="arm")}}, mjenv.Error, "arm"),
        ({"randomize": {"body_mass": Scale(1, 2, body=99)}}, mjenv.InvalidValueError, "belongs to this body"),
        ({"randomize": {"body_mass": Scale(1, 2, body=1, elements=[1])}}, mjenv.OptionError, "give one of"),
        ({"randomize": {"body_mass": Scale(1, 2, columns=0)}}, mjenv.InvalidValueError, "no columns"),
        ({"randomize": {"geom_friction": Scale(1, 2, columns=3)}}, mjenv.InvalidValueError, "3 columns"),
        ({"randomize": {"geom_friction": Scale(1, 2, elements=[-1])}}, mjenv.InvalidValueError, "element -1"),
        ({"randomize": {"xfrc_applied": Value(1, 2)}}, mjenv.Error, "mjModel"),
        ({"noise": 0.1}, mjenv.OptionError, "noise: an object"),
        ({"noise": Noise(-1.0)}, mjenv.InvalidValueError, r"noise.action\[0\]"),
        ({"noise": Noise([0.1, 0.2])}, mjenv.InvalidValueError, "noise.action: 2 numbers, 3 or 1 expected"),
        ({"noise": Noise([0.0, 0.0])}, mjenv.InvalidValueError, "noise.action: 2 numbers, 3 or 1 expected"),
        ({"noise": Noise([])}, mjenv.InvalidValueError, "noise.action: 0 numbers"),
        (
            {"noise": Noise(0.0, (0.0,) * 12)},
            mjenv.InvalidValueError,
            "noise.observation: 12 numbers, 11 or 1 expected",
        ),
        ({"noise": Noise({"thigh": 0.1})}, mjenv.UnknownNameError, 'noise.action: there is no "thigh"; .* thigh_joint'),
        ({"noise": Noise({"thigh_joint": -1})}, mjenv.InvalidValueError, r"noise.action.thigh_joint\[0\] is -1"),
        ({"noise": Noise(0.0, {"qpos": "a"})}, mjenv.OptionError, "noise.observation.qpos: a number"),  # type: ignore
        ({"noise": Noise(distribution="even")}, mjenv.InvalidValueError, "noise.distribution: there is no"),  # type: ignore
        ({"delay": Delay({"thigh_joint": 1})}, mjenv.OptionError, "delay.action: an integer"),  # type: ignore[arg-type]
        ({"delay": Delay(0, {"qvel": -1})}, mjenv.InvalidValueError, "delay.observation.qvel is -1"),
        ({"delay": Delay(1, first_action={"knee": 1})}, mjenv.UnknownNameError, "delay.first_action: there is no"),
        ({"delay": Delay(first_observation="own")}, mjenv.InvalidValueError, "delay.first_observation"),  # type: ignore
        ({"delay": Delay(-1)}, mjenv.InvalidValueError, "delay.action"),
        ({"delay": Delay(1, first_action=(0.1, 0.2))}, mjenv.InvalidValueError, "delay.first_action: 2 numbers"),
        ({"delay": Delay(1, first_action=float("inf"))}, mjenv.InvalidValueError, "not JSON compliant"),
        ({"delay": Delay(1.5)}, mjenv.OptionError, "an integer is expected"),  # type: ignore[arg-type]
        ({"delay": Delay((2, 1))}, mjenv.InvalidValueError, "wrong order"),
        ({"delay": Delay(1, (0, -1))}, mjenv.InvalidValueError, "wrong order"),
        ({"delay": Delay((0, 1, 2))}, mjenv.OptionError, "an integer, or a pair"),  # type: ignore[arg-type]
        ({"delay": Delay((0, 2), redraw="episode")}, mjenv.InvalidValueError, "reset, step"),  # type: ignore[arg-type]
        ({"randomize": {"body_mass": Same()}}, mjenv.InvalidValueError, "there is none"),
        ({"randomize": {"body_mass": [Scale(1, 2), Same(factor=0.0)]}}, mjenv.InvalidValueError, "must not be 0"),
        ({"randomize": {"body_mass": [Scale(1, 2), Same(body=1)]}}, mjenv.InvalidValueError, "1 elements, not 5"),
        ({"push": Push("arm")}, mjenv.Error, "arm"),
        ({"push": Push("torso", every=(0, 1))}, mjenv.InvalidValueError, r"every is \[0, 1\]"),
        ({"push": Push("torso", ((1, 0), (0, 0), (0, 0)))}, mjenv.InvalidValueError, "low"),
        ({"push": Push("torso", (0, 1))}, mjenv.OptionError, "three pairs"),  # type: ignore[arg-type]
        ({"push": [Push("torso"), Push("torso")]}, mjenv.InvalidValueError, "twice"),
        ({"push": Push("torso", velocity=((0, 1),) * 3)}, mjenv.InvalidValueError, "no free joint"),
        ({"push": Push("torso", velocity=((0, 1),))}, mjenv.OptionError, "three pairs"),
        ({"push": Push("torso", ((0, 1),) * 3, velocity=((0, 1),) * 3)}, mjenv.InvalidValueError, "give two pushes"),
        ({"push": Push("torso", duration=(3, 2))}, mjenv.InvalidValueError, "wrong order"),
        ({"push": Push("torso", duration=-1)}, mjenv.InvalidValueError, r"duration is \[-1, -1\]"),
        ({"push": Push("torso", duration=(1, 2, 3))}, mjenv.OptionError, "an integer, or a pair"),  # type: ignore[arg-type]
    ],
)
def test_refusals(settings: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        mjenv.make("Hopper-v5", **settings)


def test_ranges_of_rows() -> None:
    envs = mjenv.make_vec("Hopper-v5", 3, randomize={"body_mass": [Scale(0.9, 1.1), Offset(0.0, 0.1, body=1)]})
    envs.set_draw_range("body_mass", [0.2, 0.3], number=1, mask=np.array([False, True, False]))
    assert envs.draw_range("body_mass", 1).tolist() == [[0.0, 0.1], [0.2, 0.3], [0.0, 0.1]]
    envs.set_draw_range("body_mass", [[1, 2], [1, 3], [1, 4]])
    assert envs.draw_range("body_mass").tolist() == [[1, 2], [1, 3], [1, 4]]
    with pytest.raises(
        mjenv.InvalidValueError, match=r"row 2: draws\[0\] of \"body_mass\": low \(1\) is above high \(0\)"
    ):
        envs.set_draw_range("body_mass", [[1, 2], [1, 3], [1, 0]])
    with pytest.raises(mjenv.UnknownNameError, match="resets draw body_mass, but no item 2 of 'body_mass'"):
        envs.draw_range("body_mass", 2)
    with pytest.raises(mjenv.UnknownNameError, match="resets draw nothing"):
        mjenv.make("Hopper-v5").set_draw_range("body_mass", [1, 2])
    env = mjenv.make(
        "Hopper-v5", randomize={"body_mass": Scale(0.9, 1.1), "opt.timestep": Value(choices=(0.001, 0.002))}
    )
    env.set_draw_range("body_mass", (2, 2))
    own = np.array(env.model.body_mass)
    env.reset(seed=1)
    assert np.array_equal(env.model.body_mass, 2 * own)
    assert pickle.loads(pickle.dumps(env)).draw_range("body_mass").tolist() == [2, 2]
    with pytest.raises(mjenv.UnknownNameError, match="is a choice"):
        env.draw_range("opt.timestep")
