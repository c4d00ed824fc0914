"""mjenv against the installed Gymnasium, side by side, every bit.

Needs gymnasium 1.4.0, numpy 2, and mujoco 2.2.2, or 4.0.0 for the library of MuJoCo 4.0. A failure names the id, the
options, the seed, the step, the output and both values. The drawing is seeded: --draw N gives other options, --long
more of everything.
"""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest

import mjenv
from conftest import IDS
from mjenv import verify
from mjenv.verify import DifferenceError, Run, check_same, play

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
CUSTOM = ROOT / "tests" / "golden" / "custom"
# The size in mjModel that counts each kind of object.
COUNTS = {
    "body": "nbody",
    "joint": "njnt",
    "geom": "ngeom",
    "site": "nsite",
    "camera": "ncam",
    "light": "nlight",
    "actuator": "nu",
    "tendon": "ntendon",
    "sensor": "nsensor",
}
# Views that MuJoCo 2.2.2 takes from a wrong address; those of 4.0 that belong to a limit, or that are dense matrices.
WRONG_IN_MUJOCO = ("solref", "solimp", "cdof", "cdof_dot") if mujoco.__version__ == "2.2.2" else ()
# What mjenv does not list of a contact: MuJoCo computes it for some contacts only, or version 4.0 added it.
UNLISTED = ("mu", "H", "adhesion", "elem", "flex", "solreffriction", "surfacevel", "vert")
# Gymnasium has no Pusher-v4 from MuJoCo 3 on.
PUSHER = "Pusher-v4" if mujoco.__version__ == "2.2.2" else "Pusher-v5"
TAKES_XML = [id for id in IDS if "xml_file" in mjenv.options(id)]


def both(id: str, **options: Any) -> tuple[mjenv.Environment, Any]:
    """The environment of that id from mjenv and from Gymnasium."""
    return mjenv.make(id, **options), gymnasium.make(id, **options)


def test_versions() -> None:
    """The installed versions are those whose bits mjenv reproduces."""
    assert gymnasium.__version__ == "1.4.0"
    assert mujoco.__version__ in ("2.2.2", "4.0.0")
    assert f"(MuJoCo {mujoco.__version__})" in mjenv.version()
    assert np.__version__.startswith("2.")


# ---- the comparison itself ----


@pytest.mark.parametrize("id", IDS)
def test_random_options(id: str, request: pytest.FixtureRequest) -> None:
    option_sets, seeds, steps, draw = (
        request.config.getoption(name) for name in ("--option-sets", "--seeds", "--steps", "--draw")
    )
    if request.config.getoption("--long"):
        option_sets, seeds, steps = 20, 2, 1000
    runs = list(verify.draw_runs(id, option_sets, seeds, steps, draw))
    assert len(runs) == option_sets * seeds
    assert sum(play(run) for run in runs) >= len(runs)


def test_the_drawing_reaches_everything() -> None:
    """Every common option of every id, both dtypes, every kind of action; main_body by number and by name."""
    for id in IDS:
        runs = list(verify.draw_runs(id, option_sets=60, seeds=1, steps=0))
        drawn = {name for run in runs for name in run.options}
        assert drawn == set(verify.common_options(id)) | {"max_episode_steps"}
        assert {run.dtype for run in runs} == {"float32", "float64"}
        assert {run.actions for run in runs} == set(verify.SCALES)
        for name, kinds in (("main_body", {int, str}), ("healthy_reward", {int, float})):
            if name in drawn:
                assert {type(run.options[name]) for run in runs if name in run.options} == kinds


@pytest.mark.parametrize(
    ("ours", "theirs", "names"),
    [
        (np.float64(1), np.nextafter(1.0, 2), "what: .*0x1.0000000000000p.*0x1.0000000000001p"),
        (0.0, -0.0, "what"),
        (1.0, np.float64(1), "what: .*float.*float64"),
        ({"a": 1, "b": 2}, {"b": 2, "a": 1}, "keys"),
        ({"a": np.zeros(2)}, {"a": np.array([0.0, 1.0])}, r"what\['a'\]\[1\]"),
        (np.zeros(2, np.float32), np.zeros(2), "float32.*float64"),
        (np.zeros(2), np.zeros((2, 1)), "shape"),
        (True, np.True_, "bool"),
    ],
)
def test_the_comparison_finds(ours: Any, theirs: Any, names: str) -> None:
    with pytest.raises(DifferenceError, match=names):
        check_same("what", ours, theirs)


def test_a_difference_names_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    make = mjenv.make
    monkeypatch.setattr(mjenv, "make", lambda id, **options: make(id, **{**options, "reward_dist_weight": 1.5}))
    with pytest.raises(DifferenceError, match=r"Reacher-v5 \{'frame_skip': 3\} seed 9, float32 actions inside: at"):
        play(Run("Reacher-v5", {"frame_skip": 3}, 9, 5))


# ---- models ----


def changed_model(id: str, folder: Path) -> Path:
    """The model of the id, changed so that it gives other bits."""
    text = (ROOT / "assets" / mjenv.options(id)["xml_file"].default).read_text()
    model = folder / f"{id}.xml"
    model.write_text(text.replace("</mujoco>", '  <option gravity="0 0 -5.5" viscosity="0.01"/>\n</mujoco>'))
    return model


@pytest.mark.parametrize("actions", ["inside", "wild"])
@pytest.mark.parametrize("id", TAKES_XML)
def test_a_changed_model(id: str, actions: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = changed_model(id, tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    for seed, path in enumerate((str(model), f"./{model.name}", f"~/{model.name}")):
        play(Run(id, {"xml_file": path}, seed, 60, actions=actions))
    ours, from_text = mjenv.make(id, xml_file=str(model)), mjenv.make(id, xml_string=model.read_text())
    built_in = mjenv.make(id)
    ours.reset(seed=1), from_text.reset(seed=1), built_in.reset(seed=1)
    action = ours.action_space.sample()
    obs = [env.step(action)[0].tobytes() for env in (ours, from_text, built_in)]
    assert obs[0] == obs[1] != obs[2]


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize(
    ("id", "model", "options"),
    [
        ("Ant-v5", HERE / "models/six_legged_ant.xml", {}),
        ("Ant-v5", HERE / "models/six_legged_ant.xml", {"main_body": "tail_light", "frame_skip": 2}),
        ("Ant-v5", HERE / "models/six_legged_ant.xml", {"include_cfrc_ext_in_observation": False}),
        ("Ant-v5", CUSTOM / "spider.xml", {"contact_force_range": (-0.5, 2), "healthy_z_range": (0.1, 2)}),
        ("HalfCheetah-v5", CUSTOM / "tailed_cheetah.xml", {}),
        ("HalfCheetah-v5", CUSTOM / "tailed_cheetah.xml", {"exclude_current_positions_from_observation": False}),
        ("HalfCheetah-v5", HERE / "models/cart.xml", {"ctrl_cost_weight": 2}),
        ("Hopper-v5", HERE / "models/cart.xml", {"healthy_angle_range": (-1, 1)}),
        ("Walker2d-v5", HERE / "models/cart.xml", {"healthy_z_range": (-5, 5)}),
        ("Swimmer-v5", CUSTOM / "chain.xml", {}),
        ("Swimmer-v5", CUSTOM / "chain.xml", {"exclude_current_positions_from_observation": False}),
        ("Humanoid-v5", CUSTOM / "stickman.xml", {}),
        ("Humanoid-v5", CUSTOM / "stickman.xml", {"include_cinert_in_observation": False}),
        ("HumanoidStandup-v5", CUSTOM / "stickman.xml", {}),
        ("Humanoid-v5", HERE / "models/six_legged_ant.xml", {"healthy_z_range": (0.1, 2)}),
        ("HumanoidStandup-v5", HERE / "models/six_legged_ant.xml", {}),
    ],
    ids=lambda value: value.stem if isinstance(value, Path) else None,
)
def test_another_model(id: str, model: Path, options: dict[str, Any], dtype: str) -> None:
    if model.stem == "chain" and mujoco.__version__ != "2.2.2":
        with pytest.raises(ValueError, match="collision"):  # MuJoCo 3 removed this option
            gymnasium.make(id, xml_file=str(model))
        with pytest.raises(mjenv.ModelError, match="collision"):
            mjenv.make(id, xml_file=str(model))
        return
    for seed, actions in enumerate(verify.SCALES):
        play(Run(id, {"xml_file": str(model), **options}, seed, 150, dtype, actions))


# ---- what does not go through reset and step ----


@pytest.mark.parametrize("id", IDS)
def test_state(id: str) -> None:
    """set_state and do_simulation in the middle of episodes, and every array of mjData after them."""
    ours, theirs = mjenv.make(id, strict=False), gymnasium.make(id)
    base = theirs.unwrapped
    rng = np.random.default_rng(11)
    ours.reset(seed=11), theirs.reset(seed=11)
    for turn in range(12):
        action = rng.uniform(-1, 1, ours.action_space.shape)
        check_same(f"step {turn}", ours.step(action), theirs.step(action))
        qpos, qvel = ours.data.qpos + rng.normal(0, 0.01, ours.model.nq), ours.data.qvel * 0.9
        if turn % 3 == 0:
            ours.set_state(qpos, qvel), base.set_state(qpos, qvel)
            for name in ("qpos", "qvel", "xpos", "xipos", "cinert", "cvel", "qacc", "qfrc_actuator", "time"):
                check_same(f"set_state {turn}: data.{name}", getattr(ours.data, name), getattr(base.data, name))
        elif turn % 3 == 1:
            ours.do_simulation(action, turn), base.do_simulation(action, turn)
            assert verify.compare_data(ours, theirs) > 40
        check_same("state_vector", ours.state_vector(), base.state_vector())
    check_same("reset", ours.reset(), theirs.reset())


@pytest.mark.parametrize("id", ["Ant-v5", "Humanoid-v5", "Reacher-v5", "InvertedDoublePendulum-v5"])
def test_objects(id: str) -> None:
    """data.body("torso").xpos and all other named access."""
    ours, theirs = both(id)
    base = theirs.unwrapped
    ours.reset(seed=1), theirs.reset(seed=1)
    action = ours.action_space.sample()
    ours.step(action), theirs.step(action)
    compared = 0
    for kind, count in COUNTS.items():
        for index in range(getattr(ours.model, count)):
            for place in ("model", "data"):
                mine, other = (getattr(getattr(env, place), kind)(index) for env in (ours, base))
                if mine.name:
                    named = getattr(getattr(base, place), kind)(mine.name)
                    check_same("by name", repr(named), repr(other))
                    assert getattr(getattr(ours, place), kind)(mine.name).id == mine.id == index
                for name in dir(mine):
                    if name.startswith("_") or name in ("id", "name", *WRONG_IN_MUJOCO) or not hasattr(other, name):
                        continue
                    check_same(f"{place}.{kind}({index}).{name}", getattr(mine, name), np.array(getattr(other, name)))
                    compared += 1
    assert compared > 100
    for name in ("nq", "nv", "nu", "na", "nbody", "njnt", "ngeom", "body_mass", "jnt_range", "actuator_gear", "qpos0"):
        check_same(name, getattr(ours.model, name), getattr(base.model, name))
    for name in ("timestep", "gravity", "integrator", "iterations", "tolerance"):
        check_same(f"opt.{name}", getattr(ours.model.opt, name), getattr(base.model.opt, name))
    if id == "Ant-v5":
        check_same("get_body_com", ours.get_body_com("torso"), base.get_body_com("torso").copy())


@pytest.mark.parametrize("id", ["Ant-v5", "Hopper-v5", "Humanoid-v5", "Pusher-v5"])
def test_contacts(id: str) -> None:
    """MuJoCo lists as many contacts as there is room for; behind the first ncon is what was there before."""
    ours, theirs = both(id)
    ours.reset(seed=1), theirs.reset(seed=1)
    ours.action_space.seed(1)
    compared = 0
    for _ in range(60):
        action = ours.action_space.sample()
        terminated = ours.step(action)[2]
        theirs.step(action)
        mine, other = ours.data.contact, theirs.unwrapped.data.contact
        assert len(mine) == theirs.unwrapped.data.ncon
        check_same("contact.geom", mine.geom, np.stack([other.geom1, other.geom2], axis=1)[: len(mine)])
        for name in dir(other):
            if name.startswith("_") or name in UNLISTED:
                continue
            expected = getattr(other, name)[: len(mine)]
            check_same(f"contact.{name}", getattr(mine, name), expected)
            # The arrays of MuJoCo's own single contacts are wrong.
            for contact, of_it in zip(mine, expected, strict=True):
                check_same(f"{contact}.{name}", getattr(contact, name), of_it if of_it.shape else of_it.item())
                compared += 1
        if terminated:
            ours.reset(seed=1), theirs.reset(seed=1)
    assert compared > 0


@pytest.mark.parametrize("seed", [0, 2**32, 2**64 - 1, 2**128 + 5, 2**300, True])
def test_seeds(seed: int) -> None:
    for id in ("Ant-v5", PUSHER, "Hopper-v5"):
        ours, theirs = both(id)
        for again in (seed, None, seed):
            check_same("reset", ours.reset(seed=again), theirs.reset(seed=again))
            check_same("np_random_seed", ours.np_random_seed, theirs.np_random_seed)


def test_np_random_is_shared_alike() -> None:
    ours, theirs = both("Humanoid-v5")
    for env in (ours, theirs):
        env.reset(seed=4)
        env.np_random.normal(size=3)
        env.np_random.integers(7, dtype=np.int32)
    check_same("reset", ours.reset(), theirs.reset())
    assert ours.np_random.bit_generator.state == theirs.np_random.bit_generator.state
    for env in (ours, theirs):
        env.unwrapped.np_random = np.random.default_rng(99)
    check_same("reset", ours.reset(), theirs.reset())
    check_same("np_random_seed", ours.np_random_seed, theirs.np_random_seed)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_as_gymnasium_does(duplicate: Callable[[mjenv.Environment], mjenv.Environment]) -> None:
    for id in ("Ant-v4", "Humanoid-v5", PUSHER, "Reacher-v4"):
        ours, theirs = both(id)
        ours.reset(seed=2), theirs.reset(seed=2)
        for _ in range(10):
            action = theirs.action_space.sample()
            check_same("step", ours.step(action), theirs.step(action))
            ours = duplicate(ours)
        check_same("reset", ours.reset(), theirs.reset())


def test_lists_and_integers() -> None:
    """Their costs are double; what Gymnasium then shows as np.int64, as in Reacher-v4, stays np.float64 here."""
    for id in ("Ant-v5", "HalfCheetah-v4", "Humanoid-v4", "Pusher-v5"):
        ours, theirs = both(id)
        ours.reset(seed=5), theirs.reset(seed=5)
        nu = ours.model.nu
        for action in ([0.25] * nu, list(range(-3, nu - 3)), np.arange(nu), np.ones(nu, np.int8), np.ones(nu, ">f4")):
            check_same(f"{id} {action!r}", ours.step(action), theirs.step(action))


# ---- refusals ----


@pytest.mark.skipif(mujoco.__version__ == "2.2.2", reason="Gymnasium makes Pusher-v4 on MuJoCo 2")
def test_no_pusher_v4() -> None:
    with pytest.raises(ImportError, match="only supported on `mujoco<3`"):
        gymnasium.make("Pusher-v4")
    with pytest.raises(mjenv.Error, match="only supported on mujoco<3"):
        mjenv.make("Pusher-v4")
    registered = {spec.id for spec in gymnasium.registry.values() if "envs.mujoco" in str(spec.entry_point)}
    assert set(IDS) == {id for id in registered if id.endswith(("-v4", "-v5"))} - {"Pusher-v4"}


@pytest.mark.parametrize(
    ("id", "options"),
    [
        ("Ant-v5", {"no_such_option": 1}),
        ("Ant-v4", {"frame_skip": 5}),
        ("Reacher-v4", {"xml_file": "reacher.xml"}),
        ("Ant-v4", {"default_camera_config": {}}),
        ("Ant-v5", {"xml_file": "nothing.xml"}),
        ("Ant-v5", {"xml_file": "./nothing.xml"}),
        ("Ant-v5", {"width": None}),
        ("Ant-v5", {"height": "480"}),
        ("Ant-v5", {"camera_name": 3}),
        ("Ant-v5", {"camera_id": 0, "camera_name": "track"}),
        ("Ant-v7", {}),
    ],
)
def test_both_refuse(id: str, options: dict[str, Any]) -> None:
    """Both raise the same kind of exception."""
    with pytest.raises(Exception) as theirs:  # noqa: PT011 any
        gymnasium.make(id, **options)
    kind = theirs.type
    if issubclass(kind, gymnasium.error.UnregisteredEnv):
        kind = gymnasium.error.UnregisteredEnv
    with pytest.raises(kind):
        mjenv.make(id, **options)


@pytest.mark.parametrize(
    ("id", "options"),
    [
        ("Swimmer-v4", {"default_camera_config": {"distance": 3.0}}),
        ("Ant-v5", {"default_camera_config": {"distance": 3.0}}),
        ("Ant-v5", {"width": -1, "height": True, "camera_id": 9, "max_geom": -3, "visual_options": {1: False}}),
        ("Ant-v5", {"camera_name": "nothing"}),
        ("Ant-v5", {"render_mode": None, "disable_env_checker": False}),
        ("Ant-v5", {"max_episode_steps": -1}),
    ],
)
def test_both_accept(id: str, options: dict[str, Any]) -> None:
    verify.compare_descriptions(*both(id, **options))


@pytest.mark.parametrize(
    "use",
    [
        lambda env: env.step(np.zeros(8)),
        lambda env: env.reset(seed=-1),
        lambda env: env.reset(seed=np.int64(1)),
        lambda env: (env.reset(seed=1), env.step(np.zeros(7))),
        lambda env: (env.reset(seed=1), env.step(np.zeros((8, 1)))),
        lambda env: (env.reset(seed=1), env.step(0.0)),
        lambda env: env.unwrapped.get_body_com("nothing"),
        lambda env: env.unwrapped.data.body(99),
        lambda env: env.unwrapped.do_simulation(np.zeros(7), 1),
    ],
)
def test_both_refuse_a_use(use: Callable[[Any], Any]) -> None:
    ours, theirs = both("Ant-v5", disable_env_checker=True)
    with pytest.raises(Exception) as refusal:  # noqa: PT011 any
        use(theirs)
    with pytest.raises(refusal.type):
        use(ours)


@pytest.mark.parametrize("env_id", IDS)
def test_the_default_camera_is_gymnasiums(env_id: str) -> None:
    theirs = gymnasium.make(env_id).unwrapped.mujoco_renderer.default_cam_config
    ours = mjenv.make(env_id).default_camera_config
    assert (ours is None) == (theirs is None)
    for key, value in (theirs or {}).items():
        assert np.array_equal(ours[key], value), key
    assert set(ours or {}) == set(theirs or {})
