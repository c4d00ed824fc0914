"""mjenv.make_vec against Gymnasium's SyncVectorEnv, side by side, every bit, dtype and key."""

from __future__ import annotations

import hashlib
import platform
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

import mjenv
from conftest import IDS
from mjenv.verify import DifferenceError, check_same

PUSHER = "Pusher-v4" if "Pusher-v4" in IDS else "Pusher-v5"
MODES = list(AutoresetMode)
OUTPUTS = ("obs", "rewards", "terminations", "truncations", "infos")


def both(id: str, num_envs: int, mode: AutoresetMode, **options: Any) -> tuple[mjenv.VectorEnv, Any]:
    """The vector environment of that id from mjenv and from Gymnasium."""
    own = {name: options.pop(name) for name in ("num_threads", "strict", "copy", "lanes") if name in options}
    kwargs: dict[str, Any] = {"copy": own["copy"]} if "copy" in own else {}
    if mode != AutoresetMode.NEXT_STEP:
        kwargs["autoreset_mode"] = mode
    theirs = gymnasium.make_vec(id, num_envs, vectorization_mode="sync", vector_kwargs=kwargs, **options)
    return mjenv.make_vec(id, num_envs, autoreset_mode=mode, **own, **options), theirs


def check_infos(what: str, ours: Any, theirs: Any) -> None:
    """check_same that goes into dictionaries, keys in order, and into arrays of objects."""
    if isinstance(ours, dict) and isinstance(theirs, dict):
        check_same(f"{what}: keys", list(ours), list(theirs))
        for key in ours:
            check_infos(f"{what}[{key!r}]", ours[key], theirs[key])
    elif isinstance(theirs, np.ndarray) and theirs.dtype == object:
        check_same(f"{what}: type", (type(ours), ours.dtype, ours.shape), (np.ndarray, theirs.dtype, theirs.shape))
        for row, (a, b) in enumerate(zip(ours, theirs, strict=True)):
            check_same(f"{what}[{row}]", a, b)
    elif what.endswith("['reward_impact']") and theirs.dtype == np.int64:
        # HumanoidStandup-v4: an impact that is capped is an int in Gymnasium, and rounds the others if it comes first.
        check_same(what, ours.astype(np.int64), theirs)
    else:
        check_same(what, ours, theirs)


def check_results(what: str, ours: tuple[Any, ...], theirs: tuple[Any, ...]) -> None:
    names = OUTPUTS if len(theirs) == len(OUTPUTS) else ("obs", "infos")
    for name, a, b in zip(names, ours, theirs, strict=True):
        check_infos(f"{what}: {name}", a, b)


def draw_actions(space: Any, rng: np.random.Generator, dtype: str) -> NDArray[Any]:
    """Actions within the bounds or three times as large, of which a few are not finite."""
    low, high = space.low.astype(np.float64), space.high.astype(np.float64)
    actions: NDArray[Any] = rng.uniform(low, high) * rng.choice([1.0, 3.0])
    if rng.random() < 0.02:
        actions[tuple(rng.integers(actions.shape))] = rng.choice([np.nan, np.inf, 1e6])
    return actions.astype(dtype)


def play(ours: mjenv.VectorEnv, theirs: Any, seed: Any, steps: int, dtype: str) -> NDArray[np.int64]:
    """Plays on both; counts the rows that fell, were truncated, and both at once."""
    rng = np.random.default_rng([zlib.crc32(repr(seed).encode()), steps])
    disabled = ours.autoreset_mode == AutoresetMode.DISABLED
    counts = np.zeros(3, np.int64)
    check_results("reset", ours.reset(seed=seed), theirs.reset(seed=seed))
    for step in range(steps):
        actions = draw_actions(ours.action_space, rng, dtype)
        mine, other = ours.step(actions), theirs.step(actions)
        check_results(f"step {step}", mine, other)
        _, _, fell, truncated, _ = other
        counts += np.array([fell.sum(), truncated.sum(), (fell & truncated).sum()])
        mask = fell | truncated if disabled else rng.random(ours.num_envs) < 0.02
        if mask.any():
            if rng.random() < 0.5:
                mask |= rng.random(ours.num_envs) < 0.2
            seeds = None if rng.random() < 0.5 else [[None, int(s)][s % 2] for s in rng.integers(99, size=len(mask))]
            check_results(
                f"reset after step {step}",
                ours.reset(seed=seeds, options={"reset_mask": mask}),
                theirs.reset(seed=seeds, options={"reset_mask": mask}),
            )
    return counts


# ---- the comparison itself ----


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
@pytest.mark.parametrize("id", IDS)
def test_episodes(id: str, mode: AutoresetMode, request: pytest.FixtureRequest) -> None:
    """Whole episodes with falls, truncations and both, float32 and float64 actions, several sizes and thread counts."""
    long = request.config.getoption("--long")
    steps = 400 if long else 45
    sizes = ((1, 1), (3, 2), (7, 3), (16, 8)) if long else ((4, 2), (5, 1))
    for index, (num_envs, num_threads) in enumerate(sizes):
        dtype = ("float32", "float64")[index % 2]
        limit = 30 if long else (11, 17)[index]
        ours, theirs = both(id, num_envs, mode, num_threads=num_threads, strict=False, max_episode_steps=limit)
        try:
            counts = play(ours, theirs, 5 + index, steps, dtype)
        except DifferenceError as difference:
            raise DifferenceError(
                f"{id} {mode} {num_envs} rows, {num_threads} threads, {dtype}: {difference}"
            ) from None
        finally:
            ours.close(), theirs.close()
        assert counts[:2].sum() >= num_envs


def lanes_of_this_cpu() -> list[int]:
    """How many rows it can step at once. Those of aarch64 follow MuJoCo 2.2.2 alone."""
    if platform.machine() == "aarch64":
        return [2] if mujoco.__version__ == "2.2.2" else []
    features: dict[int, set[str]] = {2: set(), 4: {"avx2"}, 8: {"avx512f", "avx512dq"}}
    found = set(Path("/proc/cpuinfo").read_text().split())
    return [lanes for lanes, needed in features.items() if needed <= found]


@pytest.mark.parametrize("lanes", [2, 4, 8])
@pytest.mark.parametrize("id", IDS)
def test_lanes(id: str, lanes: int, request: pytest.FixtureRequest) -> None:
    """Episodes with each number of lanes, of rows that fill lanes and of a rest that does not; else it is refused."""
    long = request.config.getoption("--long")
    if lanes not in lanes_of_this_cpu():
        with pytest.raises(mjenv.Error, match="lanes"):
            mjenv.make_vec(id, 2 * lanes, lanes=lanes)
        return
    rows, mode = lanes + 3, AutoresetMode.SAME_STEP
    ours, theirs = both(id, rows, mode, num_threads=1, lanes=lanes, strict=False, max_episode_steps=20)
    assert play(ours, theirs, 9 + lanes, 400 if long else 25, "float32")[:2].sum() > 0


FALLING = (
    "Ant-v5",
    "Hopper-v4",
    "Hopper-v5",
    "Humanoid-v5",
    "InvertedDoublePendulum-v4",
    "InvertedPendulum-v5",
    "Walker2d-v5",
)


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
@pytest.mark.parametrize("id", FALLING)
def test_a_fall_on_the_last_step(id: str, mode: AutoresetMode) -> None:
    """The time limit is where the first row falls, so that both flags are set at once."""
    options = {"healthy_z_range": (0.6, 1.0)} if id == "Ant-v5" else {}
    probe = mjenv.make(id, **options)
    probe.reset(seed=3)
    action = probe.action_space.high * 0.8
    limit = 1
    while not probe.step(action)[2]:
        limit += 1
    ours, theirs = both(id, 3, mode, max_episode_steps=limit, num_threads=2, **options)
    check_results("reset", ours.reset(seed=3), theirs.reset(seed=3))
    ended = np.zeros(3, np.bool_)
    for step in range(limit):
        if mode == AutoresetMode.DISABLED and ended.any():
            for envs in (ours, theirs):
                envs.reset(options={"reset_mask": ended})
        results = [envs.step(np.tile(action, (3, 1))) for envs in (ours, theirs)]
        check_results(f"step {step}", *results)
        _, _, fell, truncated, _ = results[0]
        ended = fell | truncated
    assert fell[0]
    assert truncated[0]


@pytest.mark.parametrize(
    ("id", "options"),
    [
        ("InvertedDoublePendulum-v5", {"healthy_reward": 2}),
        ("Ant-v5", {"healthy_reward": 3, "exclude_current_positions_from_observation": False}),
        ("Ant-v4", {"use_contact_forces": True}),
        ("Hopper-v5", {"healthy_reward": 1}),
        ("Walker2d-v5", {"healthy_reward": 1, "frame_skip": 2}),
        ("Humanoid-v5", {"healthy_reward": 5, "include_cinert_in_observation": False}),
    ],
)
@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
def test_options(id: str, options: dict[str, Any], mode: AutoresetMode) -> None:
    ours, theirs = both(id, 3, mode, max_episode_steps=8, num_threads=2, strict=False, **options)
    play(ours, theirs, 1, 25, "float32")


@pytest.mark.parametrize(
    "id", ["Ant-v5", "HalfCheetah-v5", "Hopper-v5", "Humanoid-v5", "Reacher-v4", "Swimmer-v5", "Walker2d-v5"]
)
def test_states_of_all_rows(id: str) -> None:
    """set_state of all rows at once, after resets and in mid-episode, with quaternions that are not normalised."""
    rows = 7
    options = {"terminate_when_unhealthy": False} if id in FALLING else {}
    ours, theirs = both(id, rows, AutoresetMode.DISABLED, num_threads=1, strict=False, **options)
    check_results("reset", ours.reset(seed=3), theirs.reset(seed=3))
    ours.action_space.seed(1)
    plain, rng = [env.unwrapped for env in theirs.envs], np.random.default_rng(1)

    def check() -> None:
        for name in "time qpos qvel qacc qacc_warmstart xpos cvel qfrc_actuator cfrc_ext ncon".split():
            mine = np.array(getattr(ours.data, name))
            check_same(name, mine, np.array([getattr(env.data, name) for env in plain], mine.dtype))

    for turn in range(6):
        qpos, qvel = (np.array([getattr(env.data, name) for env in plain]) for name in ("qpos", "qvel"))
        qpos, qvel = qpos * rng.uniform(0.98, 1.02, (rows, 1)), qvel + rng.uniform(-1, 1, qvel.shape)
        qvel[turn] = 0
        ours.set_state(qpos, qvel)
        for env, *state in zip(plain, qpos, qvel, strict=True):
            env.set_state(*state)
        if turn % 2:
            check()
        if turn == 3:
            ours.restore(ours.snapshot())
        for step in range(4):
            actions = ours.action_space.sample()
            check_results(f"step {step}", ours.step(actions), theirs.step(actions))
        check()
        mask = rng.random(rows) < 0.3
        mask[turn] = True
        check_results("reset", *(envs.reset(options={"reset_mask": mask}) for envs in (ours, theirs)))


def test_infos_that_gymnasium_rounds() -> None:
    """The steps reach HumanoidStandup-v4's capped impacts, so that the exception above is tested."""
    ours, theirs = both("HumanoidStandup-v4", 2, AutoresetMode.NEXT_STEP)
    ours.reset(seed=0), theirs.reset(seed=0)
    # a fall from 40 m hits hard
    qpos = ours.envs[0].data.qpos.copy()
    qpos[2], qvel = 1.0, np.zeros(ours.envs[0].model.nv)
    qvel[2] = -60.0
    ours.envs[0].set_state(qpos, qvel), theirs.envs[0].unwrapped.set_state(qpos, qvel)
    seen = set()
    for step in range(6):
        actions = np.zeros(ours.action_space.shape)
        mine, other = ours.step(actions), theirs.step(actions)
        check_results(f"step {step}", mine, other)
        seen.add(other[4]["reward_impact"].dtype)
        assert mine[4]["reward_impact"].dtype == np.float64
    assert seen == {np.dtype(np.int64), np.dtype(np.float64)}


@pytest.mark.parametrize("copy", [True, False])
def test_copy(copy: bool) -> None:
    for envs in both("Reacher-v5", 2, AutoresetMode.NEXT_STEP, copy=copy):
        first = envs.reset(seed=1)[0]
        second = envs.step(np.ones((2, 2)))[0]
        assert (first is second) is not copy
        assert np.shares_memory(first, second) is not copy


# ---- seeds, masks, random streams ----


@pytest.mark.parametrize(
    "seed",
    [
        0,
        2**32 - 1,
        2**64 - 2,
        2**64,
        2**200,
        True,
        [1, None, 5],
        [None, None, None],
        (7, 7, 2**100),
        [0, 2**64 - 1, True],
    ],
    ids=str,
)
def test_seeds(seed: Any) -> None:
    ours, theirs = both("HalfCheetah-v5", 3, AutoresetMode.NEXT_STEP, max_episode_steps=3)
    check_results("reset", ours.reset(seed=42), theirs.reset(seed=42))
    for again in (seed, None, seed, [None, 3, None], None):
        check_results("reset", ours.reset(seed=again), theirs.reset(seed=again))
        check_same("np_random_seed", ours.np_random_seed, theirs.np_random_seed)
        check_same("get_attr", ours.get_attr("np_random_seed"), theirs.get_attr("np_random_seed"))
        for a, b in zip(ours.np_random, theirs.np_random, strict=True):
            assert a.bit_generator.state["state"] == b.bit_generator.state["state"]


@pytest.mark.parametrize("seed", [None, 9, [4, None, 2, 2**70]], ids=str)
@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
def test_reset_masks(mode: AutoresetMode, seed: Any) -> None:
    for id in ("Ant-v5", "InvertedPendulum-v5", "Humanoid-v5", PUSHER):
        ours, theirs = both(id, 4, mode, max_episode_steps=4, num_threads=3)
        check_results("reset", ours.reset(seed=1), theirs.reset(seed=1))
        rng = np.random.default_rng(0)
        for _ in range(12):
            actions = rng.uniform(-1, 1, ours.action_space.shape)
            mine, other = ours.step(actions), theirs.step(actions)
            check_results("step", mine, other)
            mask = rng.random(4) < 0.4
            if mode == AutoresetMode.DISABLED:
                mask |= mine[2] | mine[3]
            if mask.any():
                options: list[dict[str, Any]] = [{"reset_mask": mask, "other": 1} for _ in range(2)]
                check_results(
                    "reset", ours.reset(seed=seed, options=options[0]), theirs.reset(seed=seed, options=options[1])
                )
        check_same("np_random_seed", ours.np_random_seed, theirs.np_random_seed)


@pytest.mark.parametrize("id", IDS)
def test_descriptions(id: str) -> None:
    """Spaces and the streams of their samples, metadata, spec, and what single rows offer."""
    mode = MODES[zlib.crc32(id.encode()) % 3]
    ours, theirs = both(id, 3, mode, max_episode_steps=50)
    for name in ("action_space", "observation_space", "single_action_space", "single_observation_space"):
        mine, other = getattr(ours, name), getattr(theirs, name)
        assert mine == other
        assert (mine.dtype, str(mine)) == (other.dtype, str(other))
        check_same("seed", mine.seed(8), other.seed(8))
        for _ in range(3):
            check_same("sample", mine.sample(), other.sample())
    assert ours.metadata == theirs.metadata
    assert (ours.num_envs, ours.render_mode, ours.closed) == (theirs.num_envs, theirs.render_mode, theirs.closed)
    mine, other = ours.spec, theirs.spec
    mine.entry_point, mine.vector_entry_point = other.entry_point, other.vector_entry_point
    other.kwargs.update(other.kwargs.pop("vector_kwargs", {}), vectorization_mode="vector_entry_point")
    assert mine == other
    for name in ("dt", "frame_skip", "init_qpos", "init_qvel", "render_mode"):
        check_same(name, ours.get_attr(name), theirs.get_attr(name))
    check_results("reset", ours.reset(seed=4), theirs.reset(seed=4))
    check_same("state_vector", ours.call("state_vector"), theirs.call("state_vector"))
    actions = ours.action_space.sample()
    check_results("step", ours.step(actions), theirs.step(actions))
    for a, b in zip(ours.envs, theirs.envs, strict=True):
        check_same("xpos", a.data.xpos, b.unwrapped.data.xpos)
        check_same(
            "structure", getattr(a, "observation_structure", None), getattr(b.unwrapped, "observation_structure", None)
        )
    base = theirs.envs[1].unwrapped
    qpos, qvel = base.data.qpos + 0.01, base.data.qvel * 0.5
    ours.envs[1].set_state(qpos, qvel), base.set_state(qpos, qvel)
    ours.envs[1].do_simulation(actions[1], 2), base.do_simulation(actions[1], 2)
    check_results("step", ours.step(actions), theirs.step(actions))


def test_unseeded_sampling_starts_from_the_single_space() -> None:
    for envs in both("Hopper-v5", 2, AutoresetMode.NEXT_STEP):
        single = np.array([envs.single_action_space.sample() for _ in range(2)])
        assert single.tobytes() == envs.action_space.sample().tobytes()


# ---- refusals ----


@pytest.mark.parametrize(
    "use",
    [
        lambda envs: envs.reset(seed=-1),
        lambda envs: envs.reset(seed=[1, -1]),
        lambda envs: envs.reset(seed=np.int64(1)),
        lambda envs: envs.reset(seed=[1, np.int64(1)]),
        lambda envs: envs.reset(seed=np.arange(2)),
        lambda envs: envs.reset(seed=1.0),
        lambda envs: envs.reset(seed=[1]),
        lambda envs: envs.reset(seed="12"),
        lambda envs: envs.reset(options={"reset_mask": [True, False]}),
        lambda envs: envs.reset(options={"reset_mask": np.array([1, 0])}),
        lambda envs: envs.reset(options={"reset_mask": np.array([True])}),
        lambda envs: envs.reset(options={"reset_mask": np.array([False, False])}),
        lambda envs: envs.step(np.zeros((2, 3))),
        lambda envs: envs.step(np.zeros((3, 2))),
        lambda envs: envs.step(np.zeros(2)),
        lambda envs: envs.call("no_such_method"),
        # stepping a finished environment
        lambda envs: [envs.step(np.zeros((2, 2))) for _ in range(3)],
    ],
)
def test_both_refuse(use: Callable[[Any], Any]) -> None:
    """Gymnasium raises any exception, for instance an assertion; mjenv raises one of its own errors."""
    ours, theirs = both("Reacher-v5", 2, AutoresetMode.DISABLED, max_episode_steps=2)
    ours.reset(seed=1), theirs.reset(seed=1)
    with pytest.raises(Exception):  # noqa: B017, PT011 any
        use(theirs)
    with pytest.raises((mjenv.Error, AttributeError)):
        use(ours)


# ---- threads ----


@pytest.mark.parametrize("id", IDS)
def test_threads_do_not_change_a_bit(id: str, request: pytest.FixtureRequest) -> None:
    """The hash of all outputs of 64 rows at 1, 2, 3, 5 and 8 threads; the first rows are Gymnasium's."""
    long = request.config.getoption("--long")
    rows, steps, known = 64 if long else 13, 1000 if long else 30, 2
    theirs = gymnasium.make_vec(id, known, vectorization_mode="sync", max_episode_steps=20)
    hashes = {}
    for threads in (1, 2, 3, 5, 8):
        digest = hashlib.sha256()
        ours = mjenv.make_vec(id, rows, num_threads=threads, max_episode_steps=20)
        ours.action_space.seed(3)
        obs, _ = ours.reset(seed=3)
        expected = theirs.reset(seed=3)[0]
        check_same("reset", obs[:known], expected)
        for step in range(steps):
            actions = ours.action_space.sample()
            results = ours.step(actions)
            for output in results[:4]:
                digest.update(output.tobytes())
            for key, values in results[4].items():
                digest.update(key.encode() + values.tobytes())
            if threads == 3 and step < 45:
                for a, b in zip(results[:4], theirs.step(actions[:known])[:4], strict=True):
                    check_same(f"step {step}", a[:known], b)
        hashes[threads] = digest.hexdigest()
        ours.close()
    assert len(set(hashes.values())) == 1, hashes
