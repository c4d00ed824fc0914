"""mjenv.make as a gymnasium.Env."""

import functools
import inspect
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv
from gymnasium.wrappers import RecordEpisodeStatistics

import mjenv


@pytest.mark.parametrize("id", mjenv.ids())
def test_check_env(id: str) -> None:
    """Gymnasium's own checker, whose only words are about bounds that Gymnasium's environments have, too."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r".*A Box observation space (minimum|maximum) value is")
        warnings.filterwarnings("ignore", r".*For Box action spaces, we recommend")
        check_env(mjenv.make(id), skip_render_check=True)


@pytest.mark.parametrize("id", mjenv.ids())
def test_gymnasium_makes_a_spec(id: str) -> None:
    """gymnasium.make on our spec wraps the same environment; the time limit is then Gymnasium's."""
    ours = mjenv.make(id, max_episode_steps=3)
    wrapped = gymnasium.make(mjenv.spec(id), max_episode_steps=3)
    assert isinstance(wrapped.unwrapped, mjenv.Environment)
    assert wrapped.reset(seed=5)[0].tobytes() == ours.reset(seed=5)[0].tobytes()
    action = np.zeros(ours.action_space.shape)
    for truncated in (False, False, True):
        a, b = ours.step(action), wrapped.step(action)
        assert a[0].tobytes() == b[0].tobytes()
        assert a[3] is truncated is b[3]


def test_make_takes_a_spec() -> None:
    env = mjenv.make("Hopper-v5", max_episode_steps=7, healthy_reward=2.0)
    again = mjenv.make(env.spec, frame_skip=2)
    assert again.spec.kwargs == {"healthy_reward": 2.0, "frame_skip": 2}
    assert again.spec.max_episode_steps == 7
    assert again.frame_skip == 2
    assert mjenv.make(gymnasium.spec("Hopper-v5")).spec == mjenv.make("Hopper-v5").spec


@pytest.mark.parametrize(("given", "limit"), [(None, 50), (4, 4), (-1, None), (np.int64(4), 4)])
def test_max_episode_steps(given: int | None, limit: int | None) -> None:
    env = mjenv.make("Reacher-v5", max_episode_steps=given)
    assert env.spec.max_episode_steps == limit
    env.reset(seed=0)
    flags = [env.step(np.zeros(2))[3] for _ in range(limit or 60)]
    assert flags == [False] * (len(flags) - 1) + [limit is not None]


@pytest.mark.parametrize(("given", "in_spec"), [(None, False), (False, False), (True, True)])
def test_disable_env_checker(given: bool | None, in_spec: bool) -> None:
    assert mjenv.make("Ant-v5", disable_env_checker=given).spec.disable_env_checker is in_spec


def test_keywords_for_rendering() -> None:
    keywords = {
        "render_mode": None,
        "width": 64,
        "height": 32,
        "camera_id": 0,
        "max_geom": 9,
        "visual_options": {0: True},
    }
    env = mjenv.make("Ant-v5", default_camera_config={"distance": 4.0}, **keywords)
    assert env.spec.kwargs == {"default_camera_config": {"distance": 4.0}, **keywords}
    assert (env.render_mode, env.width, env.height) == (None, 64, 32)
    with pytest.raises(AttributeError, match="render_mode None"):
        env.render()


def test_outputs_are_fresh(env: mjenv.Environment) -> None:
    action = np.full(8, 0.5)
    first = env.step(action)
    kept = first[0].copy(), dict(first[4])
    second = env.step(action)
    assert first[0].tobytes() == kept[0].tobytes() != second[0].tobytes()
    assert first[4] == kept[1] != second[4]
    assert first[0].flags.writeable
    assert first[0].base is None


def test_types(env: mjenv.Environment) -> None:
    obs, reward, terminated, truncated, info = env.step(np.zeros(8, np.float32))
    assert (obs.dtype, obs.shape) == (np.float64, (105,))
    assert type(reward) is np.float64
    assert type(terminated) is bool
    assert type(truncated) is bool
    assert type(info["reward_ctrl"]) is np.float32
    assert type(info["x_position"]) is np.float64
    assert type(env.step(np.zeros(8))[4]["reward_ctrl"]) is np.float64


@pytest.mark.parametrize("healthy_reward", [2, 2.0])
def test_an_option_given_as_int_shows(healthy_reward: float) -> None:
    env = mjenv.make("InvertedDoublePendulum-v5", healthy_reward=healthy_reward)
    env.reset(seed=0)
    value = env.step(np.zeros(1))[4]["reward_survive"]
    assert type(value) is type(healthy_reward)
    assert value == 2


@pytest.mark.parametrize(
    "action",
    [
        [0, 1, 0, -1, 0, 0, 0, 1],
        np.array([0, 1, 0, -1, 0, 0, 0, 1]),
        np.array([0, 1, 0, -1, 0, 0, 0, 1], ">f8"),
        np.array([0, 0, 1, 0, 0, 0, -1, 0, 0, 0, 0, 0, 0, 0, 1, 0], np.float64)[::2],
        np.asfortranarray(np.array([0, 1, 0, -1, 0, 0, 0, 1], np.int8)),
    ],
    ids=["list", "int64", "big endian", "strided", "int8"],
)
def test_other_actions_count_as_float64(env: mjenv.Environment, action: object) -> None:
    other = mjenv.make("Ant-v5")
    other.reset(seed=3)
    plain = np.array([0.0, 1, 0, -1, 0, 0, 0, 1])
    obs, reward, _, _, info = env.step(action)
    expected = other.step(plain)
    assert obs.tobytes() == expected[0].tobytes()
    assert reward == expected[1]
    assert type(info["reward_ctrl"]) is np.float64


def test_a_big_endian_float32_counts_as_float32(env: mjenv.Environment) -> None:
    assert type(env.step(np.zeros(8, ">f4"))[4]["reward_ctrl"]) is np.float32


def test_the_action_is_left_alone(env: mjenv.Environment) -> None:
    action = np.full(8, 3.0)
    action.flags.writeable = False
    env.step(action)
    assert action.tolist() == [3.0] * 8


# ---- seeds ----


@pytest.mark.parametrize("seed", [0, 1, 2**32, 2**64 - 1, 2**64, 2**200 + 5, True])
def test_seeds_of_any_size(seed: int) -> None:
    """HalfCheetah draws uniform(-0.1, 0.1, 9) around zero, then 0.1 * standard_normal(9), from default_rng(seed)."""
    env = mjenv.make("HalfCheetah-v5", exclude_current_positions_from_observation=False)
    obs, _ = env.reset(seed=seed)
    rng = np.random.default_rng(seed)
    expected = np.concatenate([rng.uniform(-0.1, 0.1, 9), 0.1 * rng.standard_normal(9)])
    assert obs.tobytes() == expected.tobytes()
    assert env.np_random_seed == seed
    assert env.np_random.bit_generator.state == rng.bit_generator.state


def test_without_a_seed_the_stream_goes_on() -> None:
    env = mjenv.make("HalfCheetah-v5", exclude_current_positions_from_observation=False)
    rng = np.random.default_rng(8)
    for seed in (8, None, None):
        obs, _ = env.reset(seed=seed)
        assert obs[:9].tobytes() == rng.uniform(-0.1, 0.1, 9).tobytes()
        rng.standard_normal(9)


def test_never_seeded_environments_differ_and_tell_their_seed() -> None:
    envs = [mjenv.make("Reacher-v5") for _ in range(2)]
    first = [env.reset()[0] for env in envs]
    assert first[0].tobytes() != first[1].tobytes()
    assert envs[0].np_random_seed != envs[1].np_random_seed
    again = mjenv.make("Reacher-v5").reset(seed=envs[0].np_random_seed)[0]
    assert again.tobytes() == first[0].tobytes()


def test_np_random_is_the_stream_that_resets_draw_from() -> None:
    env = mjenv.make("HalfCheetah-v5", exclude_current_positions_from_observation=False)
    env.reset(seed=8)
    rng = np.random.default_rng(8)
    rng.uniform(size=9), rng.standard_normal(9)
    handed_out = env.np_random
    assert handed_out.random() == rng.random()
    obs, _ = env.reset()
    assert obs[:9].tobytes() == rng.uniform(-0.1, 0.1, 9).tobytes()
    rng.standard_normal(9)
    assert env.np_random is handed_out
    assert handed_out.random() == rng.random()
    env.reset(seed=9)
    assert env.np_random is not handed_out


def test_np_random_can_be_assigned() -> None:
    env = mjenv.make("HalfCheetah-v5", exclude_current_positions_from_observation=False)
    mine = np.random.default_rng(123)
    env.np_random = mine
    assert env.np_random_seed == -1
    obs, _ = env.reset()
    assert obs[:9].tobytes() == np.random.default_rng(123).uniform(-0.1, 0.1, 9).tobytes()
    assert env.np_random is mine
    with pytest.raises(TypeError, match="PCG64"):
        env.np_random = np.random.Generator(np.random.MT19937(1))


# ---- signatures, wrappers, closing ----


def test_signatures_are_gymnasiums() -> None:
    ours, theirs = (list(inspect.signature(module.make).parameters) for module in (mjenv, gymnasium))
    assert ours[:3] == theirs[:3]
    for name in ("step", "reset", "render", "close"):
        kinds = mjenv.Environment, gymnasium.Env
        ours, theirs = (list(inspect.signature(getattr(kind, name)).parameters) for kind in kinds)
        assert ours == theirs


def test_wrappers() -> None:
    env = RecordEpisodeStatistics(mjenv.make("Reacher-v5", max_episode_steps=2))
    env.reset(seed=0)
    rewards = [env.step(np.zeros(2))[1] for _ in range(1)]
    info = env.step(np.zeros(2))[4]
    assert info["episode"]["l"] == 2
    assert info["episode"]["r"] < rewards[0]
    assert env.spec.id == "Reacher-v5"


@pytest.mark.parametrize("kind", [SyncVectorEnv, AsyncVectorEnv])
def test_gymnasiums_vector_environments(kind: Callable[..., Any]) -> None:
    vector = kind([functools.partial(mjenv.make, "Reacher-v5") for _ in range(2)])
    singles = [mjenv.make("Reacher-v5") for _ in range(2)]
    obs, _ = vector.reset(seed=5)
    assert obs.tobytes() == b"".join(env.reset(seed=5 + i)[0].tobytes() for i, env in enumerate(singles))
    actions = np.array([[0.1, 0.2], [0.3, -0.4]], np.float32)
    obs, rewards, *_ = vector.step(actions)
    expected = [env.step(action) for env, action in zip(singles, actions, strict=True)]
    assert obs.tobytes() == b"".join(step[0].tobytes() for step in expected)
    assert rewards.tolist() == [step[1] for step in expected]
    vector.close()


def test_context_manager_closes_and_closing_twice_is_fine() -> None:
    with mjenv.make("Reacher-v5") as env:
        env.reset(seed=0)
    env.close()
    with pytest.raises(mjenv.ClosedError):
        env.reset()


def test_options_say_the_defaults_of_both_makers() -> None:
    parameters = inspect.signature(mjenv.make_vec).parameters
    for name, option in mjenv.options("Ant-v5").items():
        if name == "autoreset_mode":
            assert mjenv.AutoresetMode[option.vector_default.upper()] == parameters[name].default
        elif name in parameters and name != "max_episode_steps":  # whose None stands for the id's own
            assert option.vector_default == parameters[name].default
        else:
            assert option.vector_default == option.default


def test_str() -> None:
    assert str(mjenv.make("Ant-v4")) == "<Environment<Ant-v4>>"
    assert mjenv.make("Ant-v4").unwrapped.spec.id == "Ant-v4"
    assert "MuJoCo 2.2.2" in mjenv.version()


# ---- python -m mjenv verify; tests/live runs it against Gymnasium ----


def test_fields() -> None:
    """They lie one behind the other in the spaces, and name the keys of the infos."""
    for id in ("Ant-v5", "Reacher-v5"):
        env = mjenv.make(id)
        _, reset_info = env.reset(seed=1)
        *_, info = env.step(env.action_space.sample())
        for kind, space in (("observation", env.observation_space), ("action", env.action_space)):
            fields = env.fields(kind)
            assert [field.offset for field in fields] == [sum(f.count for f in fields[:i]) for i in range(len(fields))]
            assert sum(field.count for field in fields) == space.shape[0]
        assert {field.name for field in env.fields("info")} == set(info)
        assert {field.name for field in env.fields("reset_info")} == set(reset_info)
        shapes = {field.name: field.shape for field in env.fields("model")}
        assert shapes["body_mass"] == env.model.body_mass.shape
        assert {field.name for field in env.fields("data")} > {"qpos", "qvel", "xpos"}
    ours = mjenv.make("Ant-v5")
    with pytest.raises(mjenv.UnknownNameError, match="'rewards', but of observation, action"):
        ours.fields("rewards")
    assert mjenv.make_vec("Ant-v5", 2).envs[1].fields("info") == mjenv.make("Ant-v5").fields("info")


def test_engine() -> None:
    found = mjenv.engine()
    assert (found.name, found.version) == ("2.2.2", mjenv.version())
    assert Path(found.file).exists()
    assert found == mjenv.engine("2.2.2")
    assert found.name in mjenv.engines()
    assert set(mjenv.engines()) <= set(mjenv.engines(usable=False))
    with pytest.raises(mjenv.EngineError, match="there is no engine"):
        mjenv.engine("5.0")
