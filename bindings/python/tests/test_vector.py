"""mjenv.make_vec against recordings, single environments and Gymnasium's SyncVectorEnv over them."""

import copy
import gc
import os
import pickle
import subprocess
import sys
import threading
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv
from gymnasium.wrappers import vector as wrappers

import golden
import mjenv
from mjenv import AutoresetMode, Status
from systems import needs_fork

TRAJECTORIES = golden.files("trajectories")
HAS_MODES = hasattr(gymnasium.vector, "AutoresetMode")
# Gymnasium 1.0 knows one mode.
MODES = list(AutoresetMode) if HAS_MODES else [AutoresetMode.NEXT_STEP]


def single_envs(id: str, num_envs: int, mode: AutoresetMode, **options: Any) -> SyncVectorEnv:
    """Gymnasium's own vector environment over single environments of mjenv."""
    kwargs = {"autoreset_mode": mode} if HAS_MODES else {}
    return SyncVectorEnv([lambda: mjenv.make(id, **options) for _ in range(num_envs)], **kwargs)


def check_equal(ours: Any, theirs: Any) -> None:
    """Types, dtypes, shapes, bits, and keys in order."""
    assert type(ours) is type(theirs)
    if isinstance(ours, dict):
        assert list(ours) == list(theirs)
        ours, theirs = tuple(ours.values()), tuple(theirs.values())
    if isinstance(ours, tuple):
        assert len(ours) == len(theirs)
        for a, b in zip(ours, theirs, strict=True):
            check_equal(a, b)
    elif isinstance(ours, np.ndarray):
        assert (ours.dtype, ours.shape) == (theirs.dtype, theirs.shape)
        if ours.dtype == object:
            check_equal(tuple(ours), tuple(theirs))
        else:
            assert ours.tobytes() == theirs.tobytes()
    else:
        assert ours == theirs


def bits(results: tuple[Any, ...]) -> list[bytes]:
    """Everything that step or reset returned."""
    *arrays, infos = results
    return [array.tobytes() for array in arrays] + [key.encode() + infos[key].tobytes() for key in infos]


def refused(kind: type[BaseException], status: Status, match: str) -> Any:
    """pytest.raises for a mjenv.Error of that kind and status."""
    found = pytest.raises(kind, match=match)

    class Refused:
        def __enter__(self) -> None:
            self.info = found.__enter__()

        def __exit__(self, *exception: Any) -> bool:
            caught = bool(found.__exit__(*exception))
            assert isinstance(self.info.value, mjenv.Error)
            assert self.info.value.status == status
            return caught

    return Refused()


@pytest.fixture
def envs() -> mjenv.VectorEnv:
    """Four Reachers that have been reset."""
    reachers = mjenv.make_vec("Reacher-v5", 4, num_threads=2)
    reachers.reset(seed=3)
    return reachers


# ---- Gymnasium's bits ----


@pytest.mark.parametrize("path", TRAJECTORIES, ids=lambda path: path.stem)
def test_trajectory(path: Path) -> None:
    """A recording of Gymnasium as the middle row of three, with resets by a mask."""
    expected = golden.load(path)
    dtype = expected["action"].dtype
    envs = mjenv.make_vec(
        expected.id, 3, num_threads=3, autoreset_mode="Disabled", **{"strict": 0, **expected.keywords}
    )
    episodes = expected["reset_at"].tolist()
    rng = np.random.default_rng(0)
    for step, action in enumerate(expected["action"]):
        if step in episodes:
            mask = np.array([True, True, True] if step == 0 else [rng.random() < 0.5, True, False])
            obs, info = envs.reset(seed=[1, expected.seed, 2] if step == 0 else None, options={"reset_mask": mask})
            episode = episodes.index(step)
            assert golden.same(obs[1], expected["reset_obs"][episode])
            check_info(info, expected.reset_info, expected["reset_info"][episode], dtype)
        actions = np.stack([rng.uniform(-1, 1, len(action)), action, action / 2]).astype(dtype)
        obs, rewards, terminations, truncations, infos = envs.step(actions)
        assert golden.same(obs[1], expected["obs"][step]), step
        assert rewards[1].tobytes() == expected["reward"][step].tobytes(), step
        assert (terminations[1], truncations[1]) == (expected["terminated"][step], expected["truncated"][step]), step
        check_info(infos, expected.info, expected["info"][step], dtype)


def check_info(infos: dict[str, Any], fields: list[tuple[str, int, str]], record: np.ndarray, dtype: np.dtype) -> None:
    """Row 1 of vector infos against one recorded info."""
    assert [key for key in infos if not key.startswith("_")] == [name for name, _, _ in fields]
    offset = 0
    for name, count, kind in fields:
        value = infos[name]
        # Gymnasium asks NumPy for int, which on Windows has 32 bits before NumPy 2.
        expected = {"action_dtype": dtype, "python_int": np.dtype(int), "numpy_int64": np.int64}.get(kind, np.float64)
        assert value.dtype == expected, name
        assert infos[f"_{name}"][1]
        assert value[1].astype(np.float64).tobytes() == record[offset : offset + count].tobytes(), name
        offset += count


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
@pytest.mark.parametrize(
    "id", ["Ant-v5", "HalfCheetah-v4", "Hopper-v5", "Humanoid-v5", "InvertedPendulum-v5", "Swimmer-v5"]
)
def test_sync_vector_env(id: str, mode: AutoresetMode) -> None:
    """Observations, rewards, flags, infos, their masks and dtypes."""
    ours = mjenv.make_vec(id, 3, num_threads=2, autoreset_mode=mode, max_episode_steps=13)
    theirs = single_envs(id, 3, mode, max_episode_steps=13)
    for seed in ([4, 1, 2**70], [None, 3, None], None, 4):
        check_equal(ours.reset(seed=seed), theirs.reset(seed=seed))
    ours.action_space.seed(1)
    for step in range(40):
        actions = ours.action_space.sample()
        if step % 2:
            actions = actions.astype(np.float64)
        mine, other = ours.step(actions), theirs.step(actions)
        check_equal(mine, other)
        if mode == AutoresetMode.DISABLED and (mine[2] | mine[3]).any():
            masks = [{"reset_mask": mine[2] | mine[3]} for _ in range(2)]
            check_equal(ours.reset(options=masks[0]), theirs.reset(options=masks[1]))


def test_an_infos_caller_may_change_everything(envs: mjenv.VectorEnv) -> None:
    other = mjenv.make_vec("Reacher-v5", 4)
    other.reset(seed=3)
    for _ in range(5):
        results = envs.step(np.ones((4, 2)))
        check_equal(results, other.step(np.ones((4, 2))))
        for array in (*results[:4], *results[4].values()):
            assert array.flags.writeable
            array[...] = 1


def test_lanes() -> None:
    """How many rows step together, and why rows do not."""
    envs = mjenv.make_vec("Hopper-v5", 6, lanes=2)
    assert (envs.lanes, envs.lanes_reason) == (2, "")
    envs.reset(seed=0)
    envs.envs[4].data.xfrc_applied[1, 0] = 3
    assert (envs.lanes, envs.lanes_reason) == (2, "")  # forces keep rows in lanes
    assert envs.envs[0].lanes == 2
    envs.model.actuator_gear[:] *= 1.01
    assert (envs.lanes, envs.lanes_reason) == (2, "")  # and so do values of their own
    assert mjenv.make_vec("Hopper-v5", 6, lanes=0).lanes_reason == 'the option "lanes" is 0'
    single = mjenv.make("Hopper-v5")
    assert (single.lanes, single.lanes_reason) == (0, "the environment has only one row")
    with pytest.raises(mjenv.InvalidValueError, match="only 1 row"):
        mjenv.make_vec("Hopper-v5", 1, lanes=2)
    envs.send(np.zeros((6, 3)), np.arange(6))
    assert envs.lanes == 2  # also while rows are under way
    envs.recv(6)
    envs.close()
    with pytest.raises(mjenv.ClosedError):
        _ = envs.lanes


def test_float32_observations() -> None:
    """Rounded to nearest; all else as with float64."""
    for mode in AutoresetMode:
        narrow, wide = (
            mjenv.make_vec("Hopper-v5", 3, dtype=dtype, autoreset_mode=mode, max_episode_steps=4, strict=False)
            for dtype in (np.float32, np.float64)
        )
        assert narrow.observation_space.dtype == narrow.single_observation_space.dtype == np.float32
        assert narrow.reset(seed=1)[0].tobytes() == wide.reset(seed=1)[0].astype(np.float32).tobytes()
        for _ in range(6):
            actions = wide.action_space.sample()
            mine, other = narrow.step(actions), wide.step(actions)
            assert mine[0].dtype == np.float32
            assert mine[0].tobytes() == other[0].astype(np.float32).tobytes()
            check_equal(mine[1:4], other[1:4])
            if "final_obs" in other[4]:
                expected = tuple(None if obs is None else obs.astype(np.float32) for obs in other[4].pop("final_obs"))
                check_equal(tuple(mine[4].pop("final_obs")), expected)
            check_equal(mine[4], other[4])


def test_views_or_copies() -> None:
    viewing, copying = (mjenv.make_vec("Reacher-v5", 2, copy=copy) for copy in (False, True))
    first = viewing.reset(seed=1)[0]
    second = viewing.step(np.ones((2, 2)))
    assert first is second[0]
    assert copying.reset(seed=1)[0].base is None
    check_equal(copying.step(np.ones((2, 2))), second)
    viewing.close()
    first[...] += 1  # the array outlives the environment


# ---- what there is ----


def test_modes_in_the_librarys_spelling() -> None:
    for name in mjenv.options("Ant-v5")["autoreset_mode"].choices:
        assert mjenv.make_vec("Ant-v5", 1, autoreset_mode=name).metadata["autoreset_mode"].name.lower() == name


def test_spaces_and_spec() -> None:
    envs = mjenv.make_vec("Ant-v5", 3, num_threads=2, autoreset_mode="SameStep", frame_skip=2, max_episode_steps=9)
    one = mjenv.make("Ant-v5", frame_skip=2)
    assert envs.single_action_space == one.action_space
    assert envs.single_observation_space == one.observation_space
    assert envs.action_space.shape == (3, 8)
    assert envs.observation_space.shape == (3, 105)
    assert envs.metadata == {**one.metadata, "autoreset_mode": AutoresetMode.SAME_STEP}
    assert envs.spec.id == "Ant-v5"
    assert repr(envs) == "VectorEnv(Ant-v5, num_envs=3)"
    again = mjenv.make_vec(envs.spec)
    assert again.spec == envs.spec
    assert (again.num_envs, again.autoreset_mode) == (3, AutoresetMode.SAME_STEP)
    again.reset(seed=1), envs.reset(seed=1)
    check_equal(again.step(np.ones((3, 8))), envs.step(np.ones((3, 8))))
    without_limit = mjenv.make_vec("Reacher-v5", max_episode_steps=-1)
    without_limit.reset(seed=1)
    assert not any(without_limit.step(np.zeros((1, 2)))[3] for _ in range(60))


def test_gymnasium_makes_vectors_of_our_spec() -> None:
    theirs = gymnasium.make_vec(mjenv.spec("Hopper-v5"), 2, vectorization_mode="sync", max_episode_steps=5)
    ours = mjenv.make_vec("Hopper-v5", 2, max_episode_steps=5)
    check_equal(ours.reset(seed=1), theirs.reset(seed=1))
    for _ in range(8):
        check_equal(ours.step(np.ones((2, 3))), theirs.step(np.ones((2, 3))))


@pytest.mark.parametrize(
    ("options", "read"),
    [
        ({}, lambda envs: envs._pool.rows.options),
        ({"autoreset_mode": "SameStep"}, lambda envs: envs.autoreset_mode),
        ({"autoreset_mode": AutoresetMode.DISABLED}, lambda envs: envs.autoreset_mode),
        ({"copy": False}, lambda envs: envs.copy),
        ({"dtype": np.float32}, lambda envs: envs.single_observation_space),
        ({"num_threads": 2, "arrays": "xpos"}, lambda envs: (envs._pool.rows.options, envs.arrays["xpos"].shape)),
        ({"width": 64, "render_mode": "rgb_array"}, lambda envs: (envs.render_mode, envs._pool.pictures.width)),
        ({"max_episode_steps": 3}, lambda envs: envs._pool.rows.options),
        ({"max_episode_steps": -1}, lambda envs: envs._pool.rows.options),
    ],
    ids=str,
)
def test_a_spec_builds_the_same_again(options: dict[str, Any], read: Callable[[Any], Any]) -> None:
    """Each maker of a vector takes the spec of the other."""
    options = {"reward_control_weight": 0.5, "strict": False, **options}
    ours = mjenv.make_vec("Reacher-v5", 2, **options)
    theirs = gymnasium.make_vec("mjenv/Reacher-v5", num_envs=2, **options)
    made = [make(envs.spec) for envs in (ours, theirs) for make in (mjenv.make_vec, gymnasium.make_vec)]
    made += [make(envs.spec) for envs in made for make in (mjenv.make_vec, gymnasium.make_vec)]
    ours.reset(seed=1)
    expected = [copy.deepcopy(ours.step(np.ones((2, 2)))) for _ in range(60)]
    for envs in made:
        assert type(envs) is mjenv.VectorEnv
        assert read(envs) == read(ours)
        envs.reset(seed=1)
        for results in expected:
            check_equal(envs.step(np.ones((2, 2))), results)


def test_keywords_go_before_those_of_a_spec() -> None:
    spec = mjenv.make_vec("Reacher-v5", autoreset_mode="SameStep", copy=False, max_episode_steps=3, frame_skip=3).spec
    envs = mjenv.make_vec(spec, autoreset_mode="Disabled", max_episode_steps=4, frame_skip=1)
    assert (envs.autoreset_mode, envs.copy, envs.frame_skip) == (AutoresetMode.DISABLED, False, 1)
    envs.reset(seed=1)
    assert [bool(envs.step(np.zeros((1, 2)))[3][0]) for _ in range(4)] == [False, False, False, True]
    without_limit = mjenv.make("Reacher-v5", max_episode_steps=-1).spec
    for make in (mjenv.make_vec, gymnasium.make_vec):
        envs = make(mjenv.make_vec(without_limit).spec)
        envs.reset(seed=1)
        assert not any(envs.step(np.zeros((1, 2)))[3] for _ in range(60))


@pytest.mark.parametrize("order", ["C", "F", "strided", "big endian", "unaligned", "lists", "integers"])
def test_actions_in_any_layout(envs: mjenv.VectorEnv, order: str) -> None:
    other = mjenv.make_vec("Reacher-v5", 4)
    other.reset(seed=3)
    plain = np.array([[1.0, -1.0], [0.0, 1.0], [-1.0, 0.0], [1.0, 1.0]])
    given: Any = {
        "C": plain,
        "F": np.asfortranarray(plain),
        "strided": np.repeat(plain, 2, axis=1)[:, ::2],
        "big endian": plain.astype(">f8"),
        "unaligned": np.frombuffer(b"-" + plain.tobytes(), np.float64, offset=1).reshape(4, 2),
        "lists": plain.tolist(),
        "integers": plain.astype(np.int8),
    }[order]
    check_equal(envs.step(given), other.step(plain))
    envs.send(given)
    check_equal(envs.recv()[1:], other.step(plain))
    assert envs._pool.actions(given, (4, 2)).flags.aligned


def test_wrappers() -> None:
    """Gymnasium's wrappers for vectors give the same around ours and around SyncVectorEnv."""

    def stack(envs: Any) -> Any:
        envs = wrappers.RecordEpisodeStatistics(envs)
        envs = wrappers.RescaleAction(envs, np.float32(-0.5), np.float32(0.5))
        envs = wrappers.NormalizeObservation(envs)
        envs = wrappers.ClipReward(wrappers.NormalizeReward(envs), -1, 1)
        return wrappers.TransformObservation(envs, lambda obs: obs * 2)

    ours = stack(mjenv.make_vec("Hopper-v5", 3, num_threads=2, max_episode_steps=12))
    theirs = stack(single_envs("Hopper-v5", 3, AutoresetMode.NEXT_STEP, max_episode_steps=12))
    episodes = 0
    check_equal(ours.reset(seed=2), theirs.reset(seed=2))
    theirs.action_space.seed(1)
    for _ in range(40):
        actions = theirs.action_space.sample()
        mine, other = ours.step(actions), theirs.step(actions)
        episodes += int(mine[4].get("_episode", np.zeros(1)).sum())
        for infos in (mine[4], other[4]):
            infos.get("episode", {}).pop("t", None)  # seconds
        check_equal(mine, other)
    assert episodes > 5
    assert ours.unwrapped.num_envs == 3


def test_infos_as_lists() -> None:
    ours = wrappers.DictInfoToList(mjenv.make_vec("Humanoid-v5", 2, max_episode_steps=3))
    ones = [mjenv.make("Humanoid-v5", max_episode_steps=3) for _ in range(2)]
    infos = ours.reset(seed=1)[1]
    for step in range(4):
        for row, one in enumerate(ones):
            info = one.step(np.zeros(17))[4] if 0 < step < 4 else one.reset(seed=1 + row)[1]
            assert repr(infos[row]) == repr(info)
        infos = ours.step(np.zeros((2, 17)))[4]


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
def test_statistics_in_every_mode(mode: AutoresetMode) -> None:
    ours = wrappers.RecordEpisodeStatistics(mjenv.make_vec("Hopper-v5", 3, autoreset_mode=mode, max_episode_steps=6))
    theirs = wrappers.RecordEpisodeStatistics(single_envs("Hopper-v5", 3, mode, max_episode_steps=6))
    ours.reset(seed=2), theirs.reset(seed=2)
    for _ in range(20):
        mine, other = ours.step(np.zeros((3, 3))), theirs.step(np.zeros((3, 3)))
        for infos in (mine[4], other[4]):
            infos.get("episode", {}).pop("t", None)
        check_equal(mine, other)
        if mode == AutoresetMode.DISABLED and (mine[2] | mine[3]).any():
            (
                ours.reset(options={"reset_mask": mine[2] | mine[3]}),
                theirs.reset(options={"reset_mask": mine[2] | mine[3]}),
            )


def test_single_rows() -> None:
    envs = mjenv.make_vec("Humanoid-v5", 3, num_threads=2)
    ones = [mjenv.make("Humanoid-v5") for _ in range(3)]
    envs.reset(seed=5)
    for row, one in enumerate(ones):
        one.reset(seed=5 + row)
    check_equal(envs.get_attr("np_random_seed"), (5, 6, 7))
    check_equal(envs.call("state_vector"), tuple(one.state_vector() for one in ones))
    check_equal(envs.call("get_body_com", "torso"), tuple(one.get_body_com("torso") for one in ones))
    for row, one in zip(envs.envs, ones, strict=True):
        assert row.unwrapped is row
        assert row.dt == one.dt
        assert row.observation_structure == one.observation_structure
        check_equal(row.data.body("torso").cinert, one.data.body("torso").cinert)
        check_equal(row.model.body_mass, one.model.body_mass)
        assert row.np_random.bit_generator.state == one.np_random.bit_generator.state
        row.set_state(one.data.qpos * 1.01, one.data.qvel), one.set_state(one.data.qpos * 1.01, one.data.qvel)
        row.do_simulation(np.full(17, 0.1), 2), one.do_simulation(np.full(17, 0.1), 2)
    with pytest.raises(AttributeError, match="nothing"):
        envs.get_attr("nothing")
    obs = envs.step(np.zeros((3, 17)))[0]
    assert obs.tobytes() == np.stack([one.step(np.zeros(17))[0] for one in ones]).tobytes()


@pytest.mark.parametrize("mask", [None, np.array([True, False, True])], ids=["all", "some"])
def test_set_state_of_many_rows(mask: Any) -> None:
    """The same as set_state of each row."""
    envs, single = (mjenv.make_vec("Hopper-v5", 3) for _ in range(2))
    for each in (envs, single):
        each.reset(seed=1)
        each.step(np.ones((3, 3)))
    rng = np.random.default_rng(0)
    qpos, qvel = rng.normal(size=(3, 6)), rng.normal(size=(3, 6)).astype(np.float32)
    envs.set_state(qpos, qvel, mask)
    for row in range(3):
        if mask is None or mask[row]:
            single.envs[row].set_state(qpos[row], qvel[row])
    check_equal(envs.observe(), single.observe())
    check_equal(envs.step(np.ones((3, 3))), single.step(np.ones((3, 3))))


@pytest.mark.parametrize(
    ("qpos", "qvel", "mask", "match"),
    [
        (np.zeros((3, 6)), np.zeros((3, 5)), None, r"qvel has the shape \(3, 5\), not \(3, 6\)"),
        (np.zeros(6), np.zeros((3, 6)), None, r"qpos has the shape \(6,\)"),
        (np.zeros((2, 6)), np.zeros((2, 6)), np.array([True, False, True]), r"qpos has the shape \(2, 6\)"),
        (np.zeros((3, 6)), np.diag([0, 0, np.nan, 0, 0, 0])[:3], None, r"row 2: qvel\[2\] is nan, not finite"),
        (np.diag([0, np.inf, 0, 0, 0, 0])[:3], np.zeros((3, 6)), np.array([False, True, True]), r"row 1: qpos\[1\]"),
        (np.zeros((3, 6)), np.zeros((3, 6)), np.array([1, 0, 1]), "mask"),
    ],
)
def test_set_state_of_many_rows_refuses(qpos: Any, qvel: Any, mask: Any, match: str) -> None:
    envs = mjenv.make_vec("Hopper-v5", 3)
    before, _ = envs.reset(seed=1)
    with pytest.raises((ValueError, TypeError), match=match):
        envs.set_state(qpos, qvel, mask)
    check_equal(envs.observe(), before)
    envs.send(np.zeros((3, 3)))
    with refused(gymnasium.error.AlreadyPendingCallError, Status.E_PENDING, "under way"):
        envs.set_state(np.zeros((3, 6)), np.zeros((3, 6)))


def test_exported_arrays() -> None:
    envs = mjenv.make_vec("Humanoid-v5", 3, num_threads=2, arrays="xpos cfrc_ext ten_length qpos")
    assert list(envs.arrays) == ["xpos", "cfrc_ext", "ten_length", "qpos"]
    views = dict(envs.arrays)

    def check() -> None:
        for name, values in envs.arrays.items():
            assert values is views[name]
            expected = np.stack([getattr(row.data, name) for row in envs.envs])
            check_equal(values.copy(), expected)

    envs.reset(seed=1)
    check()
    for _ in range(30):
        envs.step(envs.action_space.sample())
        check()
    envs.restore(envs.snapshot())
    envs.observe()
    check()
    assert mjenv.make_vec("Reacher-v5").arrays == {}


def test_seeds() -> None:
    """Never-seeded rows differ and tell their seeds; every kind of seed is remembered."""
    envs = mjenv.make_vec("Reacher-v5", 3)
    obs = envs.reset()[0]
    assert len({row.tobytes() for row in obs}) == 3
    seeds = envs.np_random_seed
    assert mjenv.make_vec("Reacher-v5", 3).reset(seed=list(seeds))[0].tobytes() == obs.tobytes()
    envs.reset(seed=[None, 2**64 - 1, 2**64])
    assert envs.np_random_seed == (seeds[0], 2**64 - 1, 2**64)
    envs.reset(seed=2**64 - 2)
    assert envs.np_random_seed == (2**64 - 2, 2**64 - 1, 2**64)
    one = mjenv.make("Reacher-v5")
    one.reset(seed=2**64)
    assert envs.np_random[2].bit_generator.state == one.np_random.bit_generator.state


# ---- send and recv ----


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_send_and_recv(threads: int) -> None:
    """Rows that go their own ways equal environments of their own."""
    envs = mjenv.make_vec("Hopper-v5", 6, num_threads=threads, max_episode_steps=9)
    ones = [single_envs("Hopper-v5", 1, AutoresetMode.NEXT_STEP, max_episode_steps=9) for _ in range(6)]
    envs.reset(seed=10)
    for row, one in enumerate(ones):
        one.reset(seed=10 + row)
    rng = np.random.default_rng(0)
    idle = np.arange(6)
    sent: dict[int, Any] = {}
    lengths = set()
    for turn in range(60):
        chosen = rng.permutation(idle)[: rng.integers(len(idle) + 1)] if sent else rng.permutation(idle)
        actions = rng.uniform(-1, 1, (len(chosen), 3))
        dtype = (np.float32, np.float64)[turn % 2]
        envs.send(actions.astype(dtype), chosen)
        sent.update(zip(chosen.tolist(), actions.astype(dtype), strict=True))
        least = None if turn % 7 == 0 else int(rng.integers(1, len(sent) + 1))
        rows, obs, rewards, terminations, truncations, infos = envs.recv(least)
        lengths.add(len(rows))
        assert len(rows) >= (len(sent) + 1 if least is None else least) - (least is None)
        assert rows.tolist() == sorted(rows)
        for i, row in enumerate(rows.tolist()):
            expected = ones[row].step(sent.pop(row)[None])
            check_equal(
                (obs[i : i + 1], rewards[i : i + 1], terminations[i : i + 1], truncations[i : i + 1]), expected[:4]
            )
            for key, values in expected[4].items():
                # where float32 and float64 actions meet, the first row decides
                assert infos[key][i] == values.astype(infos[key].dtype)[0], key
            assert {key for key in infos if key.startswith("_") and infos[key][i]} == {
                key for key in expected[4] if key.startswith("_")
            }
        idle = np.array(sorted(set(range(6)) - set(sent)))
    if threads == 1:
        assert len(lengths) > 2


def test_send_and_recv_of_all_rows_is_a_step() -> None:
    for mode in AutoresetMode:
        one, other = (
            mjenv.make_vec("Humanoid-v5", 5, num_threads=3, autoreset_mode=mode, max_episode_steps=4, strict=False)
            for _ in range(2)
        )
        one.reset(seed=1), other.reset(seed=1)
        for _ in range(10):
            actions = one.action_space.sample()
            one.send(actions)
            actions_before = actions.copy()
            actions[...] = 7  # the actions were taken over
            rows, *results = one.recv()
            assert rows.tolist() == [0, 1, 2, 3, 4]
            check_equal(tuple(results), other.step(actions_before))


def test_polling_on_one_thread() -> None:
    one = mjenv.make_vec("Reacher-v5", 4, num_threads=1)
    one.reset(seed=1)
    one.send(np.zeros((4, 2)))
    received: list[int] = []
    while len(received) < 4:  # no other thread steps rows, so each call steps one at least
        rows, obs, rewards, terminations, truncations, _ = one.recv(0)
        count = len(rows)
        assert count > 0
        assert (obs.shape, rewards.shape, terminations.shape, truncations.shape) == ((count, 10), *[(count,)] * 3)
        received += rows.tolist()
    assert sorted(received) == [0, 1, 2, 3]
    with refused(gymnasium.error.NoAsyncCallError, Status.E_NOT_PENDING, "send"):
        one.recv(0)


def test_send_and_recv_refuse(envs: mjenv.VectorEnv) -> None:
    with refused(gymnasium.error.NoAsyncCallError, Status.E_NOT_PENDING, "send"):
        envs.recv()
    for rows, kind, status, match in (
        ([4], ValueError, Status.E_VALUE, r"row 4 is outside 0\.\.3"),
        ([-1], ValueError, Status.E_VALUE, "row -1"),
        ([1, 1], gymnasium.error.AlreadyPendingCallError, Status.E_PENDING, "row 1"),
        ([[1]], ValueError, Status.E_SIZE, "shape"),
        ([True], TypeError, Status.E_TYPE, "ints"),
        ([0.0], TypeError, Status.E_TYPE, "ints"),
        (["a"], TypeError, Status.E_TYPE, "ints"),
    ):
        with refused(kind, status, match):
            envs.send(np.zeros((len(rows), 2)), rows)
    for actions, kind, match in (
        (np.zeros((3, 2)), ValueError, r"\(2, 2\)"),
        (np.zeros((2, 3)), ValueError, r"\(2, 2\)"),
        (np.zeros((2, 2), complex), TypeError, "float32 or float64"),
        (np.full((2, 2), np.nan), ValueError, r"row 0.*action\[0\]"),
    ):
        with pytest.raises(kind, match=match):
            envs.send(actions, [0, 1])
    envs.send(np.zeros((0, 2)), [])
    with refused(gymnasium.error.NoAsyncCallError, Status.E_NOT_PENDING, "send"):
        envs.recv()

    envs.send(np.zeros((2, 2)), [0, 2])
    for least in (3, 2**64, 2**64 + 1):
        with refused(ValueError, Status.E_SIZE, "2, the number of rows under way"):
            envs.recv(least)
    for use in (
        lambda: envs.send(np.zeros((1, 2)), [2]),
        lambda: envs.send(np.zeros((4, 2))),
        lambda: envs.step(np.zeros((4, 2))),
        lambda: envs.reset(),
        lambda: envs.reset(seed=1),
        lambda: envs.rollout(np.zeros((4, 1, 2))),
        lambda: envs.observe(),
        lambda: envs.snapshot(),
        lambda: envs.restore(b""),
        lambda: envs.copy_row(0, np.ones(4, np.bool_)),
        lambda: envs.call("set_state", np.zeros(4), np.zeros(4)),
        lambda: envs.call("do_simulation", np.zeros(2), 1),
        lambda: pickle.dumps(envs),
    ):
        with refused(gymnasium.error.AlreadyPendingCallError, Status.E_PENDING, "under way"):
            use()
    with refused(gymnasium.error.AlreadyPendingCallError, Status.E_PENDING, "under way"):
        envs.model.body_mass  # noqa: B018
    with refused(ValueError, Status.E_SIZE, "least is 3"):
        envs.recv(3)
    with refused(ValueError, Status.E_VALUE, "least"):
        envs.recv(-1)
    with pytest.raises(TypeError):
        envs.recv(1.5)  # type: ignore[arg-type]
    assert envs.recv()[0].tolist() == [0, 2]
    envs.model.body_mass[:, 1] = 2  # as it was refused before, nobody knew that it can be written
    envs.step(np.zeros((4, 2)))


def test_a_row_that_was_never_reset() -> None:
    envs = mjenv.make_vec("Reacher-v5", 3)
    for use in (lambda: envs.step(np.zeros((3, 2))), lambda: envs.send(np.zeros((3, 2)))):
        with refused(gymnasium.error.ResetNeeded, Status.E_NOT_RESET, "row 0.*reset"):
            use()
    obs, _ = envs.reset(seed=1, options={"reset_mask": np.array([True, False, True])})
    assert not obs[1].any()
    with refused(gymnasium.error.ResetNeeded, Status.E_NOT_RESET, "row 1.*reset"):
        envs.step(np.zeros((3, 2)))
    envs.send(np.zeros((2, 2)), [0, 2])
    assert envs.recv()[0].tolist() == [0, 2]


# ---- planning ----


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("id", ["Hopper-v5", "Pusher-v4"])
def test_rollout(id: str, dtype: Any) -> None:
    """As stepping single environments, which stay where they end."""
    envs = mjenv.make_vec(id, 4, num_threads=3, autoreset_mode="Disabled", max_episode_steps=25, dtype=dtype)
    nu = envs.single_action_space.shape[0]
    ones = [mjenv.make(id, max_episode_steps=25) for _ in range(4)]
    envs.reset(seed=1)
    actions = np.random.default_rng(2).uniform(-1, 1, (4, 40, nu)).astype(dtype)
    rewards, terminations, truncations, obs = envs.rollout(actions, observations=True)
    assert obs.dtype == dtype
    assert terminations.dtype == truncations.dtype == np.bool_
    for row, one in enumerate(ones):
        last = one.reset(seed=1 + row)[0]
        fell = cut = False
        for step in range(40):
            reward = 0.0
            if not (fell or cut):
                last, reward, fell, cut, _ = one.step(actions[row, step])
            assert rewards[row, step] == reward
            assert (terminations[row, step], truncations[row, step]) == (fell, cut)
            assert obs[row, step].tobytes() == last.astype(dtype).tobytes()
    assert envs.observe().tobytes() == obs[:, -1].tobytes()


def test_rollout_without_observations(envs: mjenv.VectorEnv) -> None:
    before = envs.snapshot()
    actions = np.random.default_rng(2).uniform(-1, 1, (4, 8, 2))
    rewards, terminations, truncations, obs = envs.rollout(actions, observations=True)
    envs.restore(before)
    check_equal(envs.rollout(actions), (rewards, terminations, truncations))
    mask = np.array([False, True, False, False])
    after = envs.reset(options={"reset_mask": mask})[0]
    assert after[~mask].tobytes() == obs[~mask, -1].tobytes()
    for actions, match in (
        (np.zeros((4, 2)), "shape"),
        (np.zeros((3, 5, 2)), r"\(4, 5, 2\)"),
        (np.zeros((4, 5, 3)), r"\(4, 5, 2\)"),
        (np.zeros((4, 0, 2)), "steps"),
        (np.full((4, 5, 2), np.inf), "row 0"),
    ):
        with pytest.raises(mjenv.InvalidValueError, match=match):
            envs.rollout(actions)


@pytest.mark.parametrize("id", mjenv.ids())
def test_snapshots_and_copies_go_on(id: str) -> None:
    """At another number of threads; pickles, too. The reference is the environment that was left alone."""
    envs = mjenv.make_vec(id, 4, num_threads=3, max_episode_steps=15)
    envs.action_space.seed(2)
    envs.reset(seed=7)
    for _ in range(20):
        envs.step(envs.action_space.sample())
    image, one = envs.snapshot(), envs.snapshot(2)
    restored = mjenv.make_vec(id, 4, num_threads=1, max_episode_steps=15)
    restored.restore(image)
    others = [restored, pickle.loads(pickle.dumps(envs)), copy.deepcopy(envs), copy.copy(envs)]
    single = mjenv.make_vec(id, 3, num_threads=2, max_episode_steps=15)
    single.reset(seed=0)
    for row in range(3):
        single.restore(one, row)
    mask = np.array([True, False, False, True])
    copied = copy.deepcopy(envs)
    copied.copy_row(2, mask)
    assert copied.observe()[3].tobytes() == envs.observe()[2].tobytes()
    assert copied.np_random_seed == (9, 8, 9, 9)
    assert restored.np_random_seed == (-1,) * 4
    for other in others:
        assert other.observe().tobytes() == envs.observe().tobytes()
    for _ in range(25):
        actions = envs.action_space.sample()
        expected = envs.step(actions)
        for other in others:
            assert bits(other.step(actions)) == bits(expected)
        for results in (single.step(actions[[2, 2, 2]]), copied.step(np.where(mask[:, None], actions[2], actions))):
            for array, wanted in zip(results[:4], expected[:4], strict=True):
                assert array[0].tobytes() == wanted[2].tobytes()
    assert envs.reset()[0].tobytes() == others[1].reset()[0].tobytes()


def test_a_pickle_keeps_what_surrounds_the_rows() -> None:
    envs = mjenv.make_vec("Hopper-v5", 2, autoreset_mode="SameStep", dtype=np.float32, copy=False, arrays="xpos")
    envs.action_space.seed(1)
    envs.reset(seed=[5, 2**70])
    envs.step(envs.action_space.sample())
    other = pickle.loads(pickle.dumps(envs))
    assert other.spec == envs.spec
    assert other.np_random_seed == (5, 2**70)
    assert (other.autoreset_mode, other.copy, other.metadata) == (envs.autoreset_mode, False, envs.metadata)
    assert other.action_space.sample().tobytes() == envs.action_space.sample().tobytes()
    assert other.arrays["xpos"].tobytes() == envs.arrays["xpos"].tobytes()
    assert other.statuses.tolist() == envs.statuses.tolist()
    mask = np.array([True, False])
    check_equal(other.reset(options={"reset_mask": mask}), envs.reset(options={"reset_mask": mask}))
    before = other.observe().copy()
    envs.step(np.ones((2, 3)))
    envs.close()
    assert other.observe().tobytes() == before.tobytes()


def test_another_process_goes_on() -> None:
    envs = mjenv.make_vec("Walker2d-v5", 3, num_threads=2)
    envs.reset(seed=5)
    envs.step(np.full((3, 6), 0.2))
    script = """
import pickle, sys
import numpy as np
envs = pickle.load(sys.stdin.buffer)
sys.stdout.buffer.write(envs.step(np.full((3, 6), 0.2))[0].tobytes() + envs.reset()[0].tobytes())
"""
    run = subprocess.run([sys.executable, "-c", script], input=pickle.dumps(envs), capture_output=True, check=True)
    assert run.stdout == envs.step(np.full((3, 6), 0.2))[0].tobytes() + envs.reset()[0].tobytes()


def test_images_that_do_not_belong(envs: mjenv.VectorEnv) -> None:
    image, one = envs.snapshot(), envs.snapshot(1)
    ant = mjenv.make_vec("Ant-v5", 4).snapshot()
    before = envs.observe()
    for bad, row in (
        (b"", None),
        (image[:-1], None),
        (image[:200] + bytes([image[200] ^ 1]) + image[201:], None),
        (one, None),
        (image, 0),
        (ant, None),
        (mjenv.make_vec("Reacher-v5", 3).snapshot(), None),
        (mjenv.make_vec("Reacher-v5", 4, reward_dist_weight=2.0).snapshot(), None),
    ):
        with refused(ValueError, Status.E_SNAPSHOT, "image"):
            envs.restore(bad, row)
    for row in (-1, 4):
        with refused(ValueError, Status.E_VALUE, f"row {row} is outside"):
            envs.snapshot(row)
        with refused(ValueError, Status.E_VALUE, f"row {row} is outside"):
            envs.restore(one, row)
        with refused(ValueError, Status.E_VALUE, f"row {row} is outside"):
            envs.copy_row(row, np.ones(4, np.bool_))
    with refused(TypeError, Status.E_TYPE, "bytes"):
        envs.restore("image")  # type: ignore[arg-type]
    assert envs.observe().tobytes() == before.tobytes()
    envs.restore(bytearray(one), 3)
    assert envs.observe()[3].tobytes() == before[1].tobytes()


# ---- diverged rows ----


@pytest.mark.parametrize("ends", [False, True])
def test_a_diverged_row(ends: bool) -> None:
    """MuJoCo restarts it; the others go on; the status tells."""
    options = {"on_divergence": "terminate"} if ends else {}
    envs = mjenv.make_vec("HalfCheetah-v5", 3, num_threads=2, autoreset_mode="Disabled", **options)
    alone = mjenv.make("HalfCheetah-v5")
    envs.reset(seed=1), alone.reset(seed=3)
    qpos, qvel = envs.envs[1].data.qpos, envs.envs[1].data.qvel.copy()
    qvel[3] = 1e12  # beyond MuJoCo's bound of 1e10
    envs.envs[1].set_state(qpos, qvel)
    obs, _, terminations, _, _ = envs.step(np.zeros((3, 6)))
    assert envs.statuses.tolist() == [Status.OK, Status.DIVERGED, Status.OK]
    assert terminations.tolist() == [False, ends, False]
    assert obs[2].tobytes() == alone.step(np.zeros(6))[0].tobytes()
    if ends:
        envs.reset(options={"reset_mask": np.array([False, True, False])})
    envs.step(np.zeros((3, 6)))
    assert envs.statuses.tolist() == [Status.OK] * 3


# A box that slides and turns above a floor, in a MuJoCo whose stack is too small for contacts.
BOX = """
<mujoco><size nstack="120"/><option timestep="0.01"/><worldbody><geom type="plane" size="9 9 1"/><body pos="0 0 3">
<joint name="x" type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 1 0"/>
<geom type="box" size=".3 .3 .3"/></body></worldbody><actuator><motor joint="x"/></actuator></mujoco>
"""


def test_a_row_that_mujoco_fails_in() -> None:
    """It keeps its state; the others are stepped; a reset puts it right."""
    envs, whole = (
        mjenv.make_vec("HalfCheetah-v5", 3, num_threads=2, autoreset_mode="Disabled", xml_string=BOX) for _ in range(2)
    )
    envs.reset(seed=1), whole.reset(seed=1)
    envs.envs[1].set_state([0, -2.6, 0], [0, -10, 0])
    action = np.ones((3, 1), np.float32)
    for again in range(2):
        with refused(mjenv.PhysicsError, Status.E_PHYSICS, "row 1.*MuJoCo"):
            if again:
                envs.send(action)
                envs.recv()
            else:
                envs.step(action)
        wanted = whole.step(action)[0]
        assert envs.statuses.tolist() == [Status.OK, Status.E_PHYSICS, Status.OK]
        assert envs.envs[1].data.qpos.tolist() == [0, -2.6, 0]
        assert envs.observe()[[0, 2]].tobytes() == wanted[[0, 2]].tobytes()
    envs.reset()
    envs.step(action)


@pytest.mark.parametrize("threads", [1, 2])
def test_recv_of_a_row_that_mujoco_fails_in(threads: int) -> None:
    """The exception has the results of the others, each row is received once, and the environment goes on."""
    options = {"num_threads": threads, "autoreset_mode": "Disabled", "xml_string": BOX}
    envs, whole = (mjenv.make_vec("HalfCheetah-v5", 4, **options) for _ in range(2))
    envs.reset(seed=1), whole.reset(seed=1)
    envs.envs[1].set_state([0, -2.6, 0], [0, -10, 0])
    actions = np.ones((4, 1), np.float32)
    wanted = whole.step(actions)
    envs.send(actions)
    received: list[Any] = []
    failures: list[mjenv.PhysicsError] = []
    while sum(map(len, received)) < 4:
        found: Any
        try:
            found = envs.recv(1)
        except mjenv.PhysicsError as error:
            found = error.results
            failures.append(error)
        rows, *results = found
        received.append(rows)
        for given, of_all in zip(results[:4], wanted[:4], strict=True):
            others = rows != 1
            assert given[others].tobytes() == of_all[rows[others]].tobytes()
        for name in ("x_position", "_x_position", "reward_ctrl"):
            assert results[4][name][others].tobytes() == wanted[4][name][rows[others]].tobytes()
    (failure,) = failures
    assert failure.status == Status.E_PHYSICS
    assert 1 in pickle.loads(pickle.dumps(failure)).results[0]
    assert sorted(np.concatenate(received).tolist()) == [0, 1, 2, 3]
    assert envs.statuses.tolist() == [Status.OK, Status.E_PHYSICS, Status.OK, Status.OK]
    with pytest.raises(mjenv.NoAsyncCallError) as refusal:
        envs.recv()
    assert refusal.value.results is None
    envs.reset()
    envs.send(actions)
    assert len(envs.recv()[0]) == 4


@pytest.mark.parametrize("mode", ["Disabled", "NextStep", "SameStep"])
def test_step_of_rows_of_which_one_fails(mode: str) -> None:
    """The exception has what the others returned; one that says that no row was stepped has nothing."""
    options = {"num_threads": 2, "autoreset_mode": mode, "xml_string": BOX, "max_episode_steps": 3}
    envs, whole = (mjenv.make_vec("HalfCheetah-v5", 4, **options) for _ in range(2))
    actions = np.ones((4, 1), np.float32)
    for fails in (1, 0, 3):
        others = np.array([row for row in range(4) if row != fails])
        envs.reset(seed=1), whole.reset(seed=1)
        assert envs.step(actions)[1].all()
        whole.step(actions)
        envs.envs[fails].set_state([0, -2.6, 0], [0, -10, 0])
        with pytest.raises(mjenv.PhysicsError) as failure:
            envs.step(actions)
        found, wanted = failure.value.results, whole.step(actions)
        assert found is not None
        for given, of_all in zip(found[:4], wanted[:4], strict=True):
            assert given[others].tobytes() == of_all[others].tobytes()
        for name in ("x_position", "_x_position", "reward_ctrl"):
            assert found[4][name][others].tobytes() == wanted[4][name][others].tobytes()
        assert (found[1][fails], found[2][fails], found[3][fails]) == (0, False, False)
        assert envs.statuses.tolist() == [Status.E_PHYSICS if row == fails else Status.OK for row in range(4)]
        for refused in (np.full((4, 1), np.nan), np.zeros((4, 2))):
            with pytest.raises(mjenv.InvalidValueError) as refusal:
                envs.step(refused)
            assert refusal.value.results is None
        rewards = found[1].copy()
        envs.envs[fails].set_state([0, 0, 0], [0, 0, 0])
        envs.step(actions)
        assert found[1].tobytes() == rewards.tobytes()  # no later call changes them


def test_a_row_that_cannot_be_reset() -> None:
    """It says so, and is reset by the next step for which that can be done, whose action is ignored."""
    still = BOX.replace("0.01", "1e-6")  # only where an episode begins decides whether there are contacts
    envs = mjenv.make_vec(
        "HalfCheetah-v5", 1, autoreset_mode="SameStep", xml_string=still, max_episode_steps=1, reset_noise_scale=5.0
    )
    envs.reset(seed=0)
    fails = failed = 0
    for _ in range(100):
        try:
            _, rewards, _, truncations, _ = envs.step(np.ones((1, 1)))
        except mjenv.PhysicsError:
            assert envs.statuses.tolist() == [Status.E_PHYSICS]
            failed = True
            fails += 1
            continue
        assert envs.statuses.tolist() == [Status.OK]
        assert (truncations[0], rewards[0] == 0) == (not failed, failed)
        failed = False
    assert 5 < fails < 50


# ---- bad input ----


@pytest.mark.parametrize(
    ("arguments", "keywords", "kind", "status", "match"),
    [
        (("Ant-v3",), {}, gymnasium.error.UnregisteredEnv, Status.E_NAME, "Ant-v5"),
        (("Ant-v5", 0), {}, ValueError, Status.E_VALUE, "num_envs"),
        (("Ant-v5", -1), {}, ValueError, Status.E_VALUE, "num_envs"),
        (("Ant-v5", 2**64 + 1), {}, ValueError, Status.E_VALUE, "num_envs"),
        (("Ant-v5", 1.0), {}, TypeError, Status.E_TYPE, "num_envs"),
        (("Ant-v5", "3"), {}, TypeError, Status.E_TYPE, "num_envs"),
        (("Ant-v5", 2**50), {}, MemoryError, Status.E_MEMORY, "free for this process"),
        (("Ant-v5", 2), {"num_threads": -1}, ValueError, Status.E_VALUE, "num_threads"),
        (("Ant-v5", 2), {"num_threads": 1025}, ValueError, Status.E_VALUE, "num_threads"),
        (("Ant-v5", 2), {"num_threads": 1.5}, TypeError, Status.E_TYPE, "num_threads"),
        (("Ant-v5", 2), {"autoreset_mode": "nextstep"}, ValueError, Status.E_VALUE, "NextStep.*SameStep.*Disabled"),
        (("Ant-v5", 2), {"autoreset_mode": None}, ValueError, Status.E_VALUE, "autoreset_mode"),
        (("Ant-v5", 2), {"dtype": np.float16}, TypeError, Status.E_TYPE, "dtype"),
        (("Ant-v5", 2), {"dtype": None}, TypeError, Status.E_TYPE, "dtype"),
        (("Ant-v5", 2), {"dtype": "numbers"}, TypeError, Status.E_TYPE, "dtype"),
        (("Ant-v5", 2), {"max_episode_steps": 0}, ValueError, Status.E_ARGUMENT, "max_episode_steps"),
        (("Ant-v5", 2), {"arrays": "xpos nothing"}, LookupError, Status.E_NAME, "nothing"),
        (("Ant-v5", 2), {"no_such_option": 1}, TypeError, Status.E_NAME, "no_such_option"),
        (("Ant-v5", 2), {"on_divergence": "stop"}, ValueError, Status.E_VALUE, "on_divergence"),
        (("Ant-v5", 2), {"width": 1.5}, TypeError, Status.E_TYPE, "width"),
    ],
)
def test_make_vec_refuses(
    arguments: tuple[Any, ...], keywords: dict[str, Any], kind: type[Exception], status: Status, match: str
) -> None:
    with refused(kind, status, match):
        mjenv.make_vec(*arguments, **keywords)
    gc.collect()  # Gymnasium 1.0 closes what could not be built


@pytest.mark.parametrize(
    ("seed", "kind"),
    [
        (-1, ValueError),
        ([1, 2, 3, -4], ValueError),
        ([1, 2, 3], ValueError),
        ([], ValueError),
        (1.0, TypeError),
        (np.int64(1), TypeError),
        ([1, 2, 3, np.int64(4)], TypeError),
        ([1, 2, 3, "4"], TypeError),
        ([1, 2, 3, [4]], TypeError),
        (np.arange(4), TypeError),
        ("1234", TypeError),
    ],
    ids=str,
)
def test_seeds_that_are_none(envs: mjenv.VectorEnv, seed: Any, kind: type[Exception]) -> None:
    before = envs.snapshot()
    with pytest.raises(kind, match="seed") as caught:
        envs.reset(seed=seed)
    assert isinstance(caught.value, gymnasium.error.Error)
    assert envs.snapshot() == before
    assert envs.np_random_seed == (3, 4, 5, 6)


@pytest.mark.parametrize(
    ("mask", "kind", "status"),
    [
        ([True] * 4, TypeError, Status.E_TYPE),
        (np.ones(4), TypeError, Status.E_TYPE),
        (np.ones(4, np.uint8), TypeError, Status.E_TYPE),
        (None, TypeError, Status.E_TYPE),
        (np.ones(3, np.bool_), ValueError, Status.E_SIZE),
        (np.ones(5, np.bool_), ValueError, Status.E_SIZE),
        (np.ones((4, 1), np.bool_), ValueError, Status.E_SIZE),
        (np.array(True), ValueError, Status.E_SIZE),
    ],
    ids=str,
)
def test_masks(envs: mjenv.VectorEnv, mask: Any, kind: type[Exception], status: Status) -> None:
    before = envs.snapshot()
    with refused(kind, status, "mask"):
        envs.reset(options={"reset_mask": mask})
    with refused(kind, status, "mask"):
        envs.copy_row(0, mask)
    with refused(ValueError, Status.E_VALUE, "no row"):
        envs.reset(options={"reset_mask": np.zeros(4, np.bool_)})
    with refused(TypeError, Status.E_TYPE, "options"):
        envs.reset(options=[mask])  # type: ignore[arg-type]
    assert envs.snapshot() == before
    strided = np.array([True, False, False, False, True, False, False, False])[::2]
    given = {"reset_mask": strided}
    obs, _ = envs.reset(seed=3, options=given)
    assert obs.tobytes() == envs.observe().tobytes()
    assert given["reset_mask"] is strided


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_actions_that_are_refused(envs: mjenv.VectorEnv, dtype: Any) -> None:
    before = envs.snapshot()
    for shape in ((4, 3), (3, 2), (5, 2), (8,), (4, 2, 1), ()):
        with refused(ValueError, Status.E_SIZE, r"shape.*\(4, 2\)"):
            envs.step(np.zeros(shape, dtype))
    actions = np.zeros((4, 2), dtype)
    actions[2, 1] = np.nan
    with refused(ValueError, Status.E_VALUE, r"row 2.*action\[1\]"):
        envs.step(actions)
    for bad in (None, "actions", np.zeros((4, 2), complex), np.zeros((4, 2), np.float16), [["a", "b"]] * 4):
        with refused(TypeError, Status.E_TYPE, "float32 or float64"):
            envs.step(bad)  # type: ignore[arg-type]
    assert envs.snapshot() == before


def test_the_action_of_a_row_that_is_reset_is_ignored() -> None:
    envs = mjenv.make_vec("Reacher-v5", 2, max_episode_steps=1)
    envs.reset(seed=1)
    envs.step(np.zeros((2, 2)))
    assert envs.step(np.full((2, 2), np.nan))[1].tolist() == [0.0, 0.0]


def test_a_finished_row_without_autoreset() -> None:
    envs = mjenv.make_vec("Reacher-v5", 2, autoreset_mode="Disabled", max_episode_steps=1)
    envs.reset(seed=1)
    envs.step(np.zeros((2, 2)))
    with refused(gymnasium.error.ResetNeeded, Status.E_EPISODE_ENDED, "row 0.*ended"):
        envs.step(np.zeros((2, 2)))
    envs.reset(options={"reset_mask": np.array([True, False])})
    with refused(gymnasium.error.ResetNeeded, Status.E_EPISODE_ENDED, "row 1.*ended"):
        envs.step(np.zeros((2, 2)))
    envs.send(np.zeros((1, 2)), [0])
    assert envs.recv()[4].tolist() == [True]


@pytest.mark.parametrize(
    "use",
    [
        lambda envs: envs.step(np.zeros((4, 2))),
        lambda envs: envs.reset(),
        lambda envs: envs.reset(seed=1),
        lambda envs: envs.send(np.zeros((4, 2))),
        lambda envs: envs.recv(),
        lambda envs: envs.rollout(np.zeros((4, 1, 2))),
        lambda envs: envs.observe(),
        lambda envs: envs.snapshot(),
        lambda envs: envs.call("state_vector"),
        pickle.dumps,
    ],
)
def test_use_after_close(envs: mjenv.VectorEnv, use: Callable[[Any], Any]) -> None:
    envs.send(np.zeros((4, 2)))  # rows under way are given up
    envs.close()
    envs.close()
    assert envs.closed
    with pytest.raises(mjenv.ClosedError, match="closed"):
        use(envs)


def test_two_threads() -> None:
    """A step lets other threads of Python run; they are refused, and the step is not disturbed."""
    envs, alone = (
        mjenv.make_vec("Humanoid-v5", 2, num_threads=2, frame_skip=2000, terminate_when_unhealthy=False)
        for _ in range(2)
    )
    envs.reset(seed=1), alone.reset(seed=1)
    actions = np.full((2, 17), 0.1)
    results: list[Any] = []
    thread = threading.Thread(target=lambda: results.append(envs.step(actions)))
    thread.start()
    uses = (
        lambda: envs.step(-actions),
        lambda: envs.send(-actions),
        envs.reset,
        envs.close,
        envs.snapshot,
        lambda: pickle.dumps(envs),
    )
    refusals = []
    while thread.is_alive():
        for use in uses:
            try:
                use()
            except mjenv.BusyError as error:
                refusals.append(error)
            else:
                break
    thread.join()
    assert len(refusals) >= len(uses)
    check_equal(results[0], alone.step(actions))


def test_dropped_while_rows_are_under_way() -> None:
    for _ in range(20):
        envs = mjenv.make_vec("Ant-v5", 8, num_threads=3)
        envs.reset(seed=1)
        envs.send(np.zeros((8, 8)))
        del envs
        gc.collect()


def script(text: str) -> "subprocess.CompletedProcess[str]":
    """Runs a script with a vector environment `envs` that has been reset, and NumPy."""
    head = """
import os, sys, threading, time, warnings
import numpy as np
import mjenv
warnings.simplefilter("ignore")
envs = mjenv.make_vec("Humanoid-v5", 16, num_threads=4, frame_skip=20)
envs.reset(seed=1)
actions = np.zeros((16, 17))
"""
    return subprocess.run(
        [sys.executable, "-c", head + text], capture_output=True, text=True, timeout=100, check=False, env=os.environ
    )


@pytest.mark.parametrize(
    "text",
    [
        "envs.send(actions)",
        "envs.send(actions); rows = envs.recv(1)[0]; envs.send(actions[: len(rows)], rows)",
        "envs.send(actions); sys.exit(0)",
        "envs.send(actions); other = envs; envs.loop = envs",
        "work = lambda: [envs.step(actions) for _ in range(999)]; "
        "threading.Thread(target=work, daemon=True).start(); time.sleep(0.05)",
        "threading.Thread(target=lambda: (envs.send(actions), envs.recv()), daemon=True).start()",
    ],
)
def test_the_end_of_the_process_while_rows_are_under_way(text: str) -> None:
    for _ in range(3):
        run = script(text)
        assert (run.returncode, run.stderr) == (0, "")


FORK = """
def attempt(use):
    try:
        use()
    except mjenv.ForkedError as error:
        assert isinstance(error, RuntimeError) and "fork" in str(error)
    else:
        print("not refused")

PREPARE
pid = os.fork()
if pid == 0:
    try:
        for use in (USES):
            attempt(use)
        own = mjenv.make_vec("Humanoid-v5", 16, num_threads=4, frame_skip=20)
        own.reset(seed=1)
        assert own.step(actions)[0].any()
        own.close(), envs.close()
        print("child done", flush=True)
    finally:
        os._exit(0)
assert os.waitpid(pid, 0)[1] == 0
AFTER
print("parent done")
"""


@pytest.mark.parametrize(
    ("prepare", "uses", "after"),
    [
        (
            "",
            "lambda: envs.step(actions), lambda: envs.reset(), lambda: envs.send(actions), "
            "lambda: envs.rollout(actions[:, None])",
            "envs.step(actions)",
        ),
        ("envs.send(actions)", "lambda: envs.recv(), lambda: envs.recv(1)", "envs.recv(); envs.step(actions)"),
    ],
)
@needs_fork
def test_fork(prepare: str, uses: str, after: str) -> None:
    """The child is told, may make its own, and the parent goes on."""
    run = script(FORK.replace("PREPARE", prepare).replace("USES", uses).replace("AFTER", after))
    assert (run.returncode, run.stdout, run.stderr) == (0, "child done\nparent done\n", "")


@needs_fork
def test_one_thread_survives_a_fork() -> None:
    """Without threads of its own an environment goes on in the child."""
    run = script(
        """
one = mjenv.make_vec("Hopper-v5", 2, num_threads=1)
one.reset(seed=1)
pid = os.fork()
obs = one.step(np.ones((2, 3)))[0]
os.write(1, obs.tobytes().hex().encode() + b"\\n")
if pid:
    os.waitpid(pid, 0)
else:
    os._exit(0)
"""
    )
    assert (run.returncode, run.stderr) == (0, "")
    first, second = run.stdout.split()
    assert first == second


def test_errors_can_be_pickled(envs: mjenv.VectorEnv) -> None:
    with pytest.raises(mjenv.NoAsyncCallError) as caught:
        envs.recv()
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is mjenv.NoAsyncCallError
    assert (str(again), again.status, again.name) == (str(caught.value), Status.E_NOT_PENDING, "recv")


# ---- zero-copy ----


def address(array: Any) -> int:
    """Where NumPy's array interface says that the numbers lie."""
    return array.__array_interface__["data"][0]


@pytest.mark.parametrize("copy", [True, False])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_outputs_speak_dlpack(dtype: Any, copy: bool) -> None:
    envs = mjenv.make_vec("Ant-v5", 3, arrays="xpos cfrc_ext", copy=copy, dtype=dtype)
    obs, _ = envs.reset(seed=1)
    actions = np.ones((3, 8), np.float32)
    rows, *received = (envs.send(actions), envs.recv())[1]
    results = envs.step(actions)
    outputs = [obs, rows, *received[:4], *results[:4], *results[4].values(), *envs.arrays.values()]
    for array in outputs:
        shared = np.from_dlpack(array)
        assert array.flags.writeable
        assert np.shares_memory(shared, array)
        assert address(shared) == address(array)
        array.reshape(-1)[0] = 1 - array.reshape(-1)[0]
        assert np.array_equal(shared, array)


def test_shared_arrays_show_the_next_step() -> None:
    envs = mjenv.make_vec("Ant-v5", 3, arrays="xpos", copy=False)
    obs, xpos = np.from_dlpack(envs.reset(seed=1)[0]), np.from_dlpack(envs.arrays["xpos"])
    for _ in range(2):
        before = obs.copy(), xpos.copy()
        stepped = envs.step(np.ones((3, 8), np.float32))[0]
        assert np.array_equal(obs, stepped)
        assert not np.array_equal(obs, before[0])
        assert not np.array_equal(xpos, before[1])
    assert all(np.array_equal(xpos[row], env.data.xpos) for row, env in enumerate(envs.envs))
    # They outlive the environment.
    last = xpos.copy()
    envs.close()
    del envs, stepped
    gc.collect()
    mjenv.make_vec("Ant-v5", 3, arrays="xpos").reset(seed=2)
    assert np.array_equal(xpos, last)


def test_what_mujoco_computes_is_read_only() -> None:
    """NumPy shares read-only arrays from 2.1 on, and older ones refuse: np.array(...) copies."""
    envs = mjenv.make_vec("Ant-v5", 2)
    envs.reset(seed=1)
    row = envs.envs[1]
    for array in (row.data.xpos, row.model.body_parentid, envs.data.xpos, envs.model.body_parentid):
        assert not array.flags.writeable
        if np.lib.NumpyVersion(np.__version__) < "2.1.0":
            with pytest.raises(BufferError, match="readonly"):
                np.from_dlpack(array)
        else:
            shared = np.from_dlpack(array)
            assert np.shares_memory(shared, array)
            assert not shared.flags.writeable
        assert np.from_dlpack(np.array(array)).shape == array.shape


# ---- rows as environments ----


def test_the_spec_of_a_row_makes_an_equal_environment() -> None:
    options = {"reset_noise_scale": 0.2, "max_episode_steps": 7, "time_aware": True}
    for envs in (
        mjenv.make_vec("Hopper-v5", 2, num_threads=1, dtype=np.float32, **options),
        gymnasium.make_vec("mjenv/Hopper-v5", 2, num_threads=1, **options),
        gymnasium.make_vec(mjenv.make("Hopper-v5", **options).spec, 2),
    ):
        row = envs.unwrapped.envs[0]
        for single in (mjenv.make(row.spec), gymnasium.make(row.spec)):
            obs, info = row.reset(seed=4)
            expected = single.reset(seed=4)
            assert obs.tobytes() == expected[0].astype(obs.dtype).tobytes()
            assert info == expected[1]
            assert [single.step(np.zeros(3))[3] for _ in range(7)] == [False] * 6 + [True]
    assert mjenv.VectorEnv("Hopper-v5").envs[0].spec is None


def test_the_reset_of_a_row_leaves_the_others() -> None:
    envs, twin = mjenv.make_vec("Hopper-v5", 3), mjenv.make_vec("Hopper-v5", 3)
    for each in (envs, twin):
        each.reset(seed=1)
        each.step(np.ones((3, 3)))
    obs, _ = envs.envs[1].reset(seed=9)
    assert envs.get_attr("np_random_seed") == (1, 9, 3)
    assert obs.tobytes() == mjenv.make("Hopper-v5").reset(seed=9)[0].tobytes()
    assert envs.envs[2].get_wrapper_attr("dt") == envs.call("get_wrapper_attr", "dt")[0] == 0.008
    ours, theirs = (each.step(np.ones((3, 3)))[0] for each in (envs, twin))
    assert ours[[0, 2]].tobytes() == theirs[[0, 2]].tobytes()


# ---- the cost of one row ----


def peak(call: Callable[[], Any]) -> int:
    """How many bytes of Python's memory the call takes at most."""
    call()  # once before, because a first call fills caches
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_one_row_costs_the_same_among_many() -> None:
    few, many = mjenv.make_vec("InvertedPendulum-v5", 2), mjenv.make_vec("InvertedPendulum-v5", 20_000)
    calls: list[Callable[[Any], Any]] = [
        lambda envs: envs.envs[1].model.body_mass.__setitem__(1, 2.0),
        lambda envs: envs.envs[1].np_random_seed,
        lambda envs: envs._pool.rows.seed(1, 2**70),
        lambda envs: envs.envs[1].set_constants(),
    ]
    for number, call in enumerate(calls):
        costs = [peak(lambda envs=envs, call=call: call(envs)) for envs in (few, many)]
        assert costs[1] < costs[0] + 4096, (number, costs)
    assert [envs.envs[1].model.body_mass[1] for envs in (few, many)] == [2, 2]
    assert len(many.envs) == 20_000
    assert [row.model.body_mass[1] for row in many.envs[:2]] == [
        mjenv.make("InvertedPendulum-v5").model.body_mass[1],
        2,
    ]
    assert many.envs[-1]._row == 19_999
    with pytest.raises(IndexError):
        many.envs[20_000]
