"""Plays mjenv and the installed Gymnasium side by side and compares every bit of every output.

    python -m mjenv verify [ID ...]

Needs gymnasium[mujoco], with MuJoCo 2.2.2 or 4.0, which is compared with the engine of its version. Options, seeds and
actions are drawn from a seeded generator, so a difference can be repeated. Option values are Python numbers, because a
weight that is an np.float64 makes float32 costs float64 in Gymnasium but not in mjenv.
"""

from __future__ import annotations

import contextlib
import inspect
import math
import struct
import warnings
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import gymnasium
import mujoco  # type: ignore[import-not-found, unused-ignore]
import numpy as np
from gymnasium.envs.registration import load_env_creator
from numpy.typing import NDArray

import mjenv
from mjenv import Kind, Option
from mjenv.capi.declarations import Role

# The ways to draw actions, each with the multiple of the action's bounds that it can reach.
SCALES = {"inside": 1.0, "three times out of bounds": 3.0, "wild": 1e6}
_WILD = (math.nan, math.inf, -math.inf)
OUTPUTS = ("obs", "reward", "terminated", "truncated", "info")


class DifferenceError(AssertionError):
    """Says in which output mjenv and Gymnasium differ, and how."""


@dataclass(frozen=True)
class Run:
    """One run: an id, its options, a seed, and how actions are drawn."""

    id: str
    options: Mapping[str, Any]
    seed: int
    steps: int
    dtype: str = "float32"
    actions: str = "inside"
    engine: str | None = None


def same(ours: Any, theirs: Any) -> bool:
    """Whether two values have the same type and the same bits."""
    if type(ours) is not type(theirs):
        return False
    if isinstance(ours, dict):
        return list(ours) == list(theirs) and all(same(ours[key], theirs[key]) for key in ours)
    if isinstance(ours, (tuple, list)):
        return len(ours) == len(theirs) and all(same(a, b) for a, b in zip(ours, theirs, strict=True))
    if isinstance(ours, (np.ndarray, np.generic)):
        return (ours.dtype, ours.shape, ours.tobytes()) == (theirs.dtype, theirs.shape, theirs.tobytes())
    if isinstance(ours, float):
        return struct.pack("d", ours) == struct.pack("d", theirs)
    return bool(ours == theirs)


def check_same(what: str, ours: Any, theirs: Any) -> None:
    """Raises DifferenceError, naming the first key or element that differs."""
    if same(ours, theirs):
        return
    if isinstance(ours, dict) and isinstance(theirs, dict):
        if list(ours) != list(theirs):
            raise DifferenceError(f"{what}: the keys are {list(ours)}, Gymnasium's {list(theirs)}")
        for key in ours:
            check_same(f"{what}[{key!r}]", ours[key], theirs[key])
    if isinstance(ours, tuple) and isinstance(theirs, tuple) and len(ours) == len(theirs):
        for index, (a, b) in enumerate(zip(ours, theirs, strict=True)):
            check_same(f"{what}[{index}]", a, b)
    if isinstance(ours, np.ndarray) and isinstance(theirs, np.ndarray):
        if ours.shape != theirs.shape or ours.dtype != theirs.dtype:
            raise DifferenceError(
                f"{what}: {ours.dtype} of shape {ours.shape}, Gymnasium's {theirs.dtype} of shape {theirs.shape}"
            )
        for position in np.ndindex(ours.shape):
            check_same(f"{what}{list(position)}", ours[position], theirs[position])
    raise DifferenceError(f"{what}: {_exact(ours)}, Gymnasium's {_exact(theirs)}")


def _exact(value: Any) -> str:
    if isinstance(value, (float, np.floating)):
        return f"{value!r} ({type(value).__name__} {float(value).hex()})"
    return f"{value!r} ({type(value).__name__})"


def describe(run: Run) -> str:
    """The run as text, with everything that is needed to repeat it."""
    engine = "" if run.engine is None else f", engine {run.engine}"
    return f"{run.id} {dict(run.options)!r} seed {run.seed}, {run.dtype} actions {run.actions}{engine}"


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Hides Gymnasium's deprecation warnings, and MuJoCo's warnings on the terminal and in MUJOCO_LOG.TXT."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        mujoco.set_mju_user_warning(before)


def common_options(id: str) -> dict[str, Option]:
    """The options that both libraries have, except xml_file, whose values cannot be drawn at random."""
    entry_point = gymnasium.spec(id).entry_point
    assert isinstance(entry_point, str)
    theirs = inspect.signature(load_env_creator(entry_point)).parameters
    return {name: option for name, option in mjenv.options(id).items() if name in theirs and name != "xml_file"}


def draw_options(id: str, bodies: Sequence[str], rng: np.random.Generator) -> dict[str, Any]:
    """Random values for a random choice of the id's options."""
    options = {name: _value(o, bodies, rng) for name, o in common_options(id).items() if rng.random() < 0.6}
    if rng.random() < 0.5:
        options["max_episode_steps"] = int(rng.choice([-1, 1, 20, 150]))
    return options


def _value(option: Option, bodies: Sequence[str], rng: np.random.Generator) -> Any:
    if option.kind == Kind.FLAG:
        return bool(rng.integers(2))
    if option.kind == Kind.INTEGER:
        return int(rng.integers(1, 8))
    if option.kind == Kind.STRING_OR_INT:
        index = int(rng.integers(len(bodies)))
        return bodies[index] if bodies[index] and rng.random() < 0.5 else index
    if isinstance(option.default, tuple):
        return _range(option.default, rng)
    if option.low == 0:
        return [0, 0.0, 1e-3, 0.05, 0.3][rng.integers(5)]
    return [int(rng.integers(-2, 5)), 0.0, option.default * float(rng.uniform(0, 3)), float(rng.normal())][
        rng.integers(4)
    ]


def _range(default: tuple[float, float], rng: np.random.Generator) -> tuple[float, float] | list[float]:
    low, high = default
    width = high - low if math.isfinite(high - low) else 1.0
    shift = float(rng.uniform(-0.3, 0.3)) * width
    ranges: list[tuple[float, float] | list[float]] = [
        (-math.inf, math.inf),
        (low + shift, math.inf),
        [-math.inf, high + shift],
        [low - abs(shift), high + abs(shift)],
        (low + abs(shift), high - abs(shift)),
        (high, low),
    ]
    return ranges[rng.integers(len(ranges))]


def compare_descriptions(ours: mjenv.Environment, theirs: gymnasium.Env[Any, Any]) -> None:
    """Compares the spaces, the spec, the metadata, and the attributes that never change."""
    for name in ("action_space", "observation_space"):
        mine, other = getattr(ours, name), getattr(theirs, name)
        check_same(name, str(mine), str(other))
        for part in ("low", "high", "bounded_below", "bounded_above", "dtype", "shape"):
            check_same(f"{name}.{part}", getattr(mine, part), getattr(other, part))
    check_same("metadata", ours.metadata, theirs.metadata)
    assert ours.spec is not None
    assert theirs.spec is not None
    mine, other = asdict(ours.spec), asdict(theirs.spec)
    for name in ("strict", "engine"):
        mine["kwargs"].pop(name, None)
    for fields in (mine, other):
        for name in ("entry_point", "vector_entry_point"):  # each package has its own
            fields.pop(name)
    check_same("spec", mine, other)
    base: Any = theirs.unwrapped
    missing = "no such attribute"
    check_same(
        "observation_structure",
        getattr(ours, "observation_structure", missing),
        getattr(base, "observation_structure", missing),
    )
    for name in ("dt", "frame_skip", "init_qpos", "init_qvel", "render_mode", "width", "height"):
        check_same(name, getattr(ours, name), getattr(base, name))


def compare_data(ours: mjenv.Environment, theirs: gymnasium.Env[Any, Any]) -> int:
    """Compares the arrays of mjData that both have in the same shape, and returns their number.

    Arrays of constraints are left out, because MuJoCo leaves their elements past the present constraints undefined.
    """
    data = theirs.unwrapped.data  # type: ignore[attr-defined]
    count = 0
    for field in ours._rows.fields(Role.DATA):
        other: Any = getattr(data, field.name, None)
        if np.shape(other) == field.shape and not field.name.startswith("efc_"):
            check_same(f"data.{field.name}", getattr(ours.data, field.name), other)
            count += 1
    return count


def play(run: Run) -> int:
    """Plays a run on both libraries and returns the number of episodes. Raises DifferenceError."""
    # Not strict, because Gymnasium accepts actions that are not finite, and steps after the end of an episode.
    ours = mjenv.make(run.id, disable_env_checker=True, strict=False, engine=run.engine, **run.options)
    theirs = gymnasium.make(run.id, disable_env_checker=True, **run.options)
    rng = np.random.default_rng([zlib.crc32(run.id.encode()), run.seed % 2**32])
    where = "at construction"
    episodes = 0
    begin = True
    try:
        compare_descriptions(ours, theirs)
        for step in range(run.steps):
            if begin:
                where = f"reset before step {step}"
                seed = None if episodes else run.seed
                check_same("reset", ours.reset(seed=seed), theirs.reset(seed=seed))
                episodes += 1
            where = f"step {step}"
            action = _action(run, theirs.action_space, rng)
            mine, other = ours.step(action), theirs.step(action)
            for name, a, b in zip(OUTPUTS, mine, other, strict=True):
                check_same(name, a, b)
            # Some episodes are stepped past their end, some cut short.
            begin = rng.random() < (0.7 if mine[2] or mine[3] else 0.003)
        where = f"after step {run.steps - 1}"
        check_same("np_random_seed", ours.np_random_seed, theirs.unwrapped.np_random_seed)
        check_same("np_random", ours.np_random.random(), theirs.unwrapped.np_random.random())
        compare_data(ours, theirs)
    except DifferenceError as difference:
        raise DifferenceError(f"{describe(run)}: {where}: {difference}") from None
    finally:
        ours.close()
        theirs.close()  # type: ignore[no-untyped-call, unused-ignore]
    return episodes


def _action(run: Run, space: Any, rng: np.random.Generator) -> NDArray[Any]:
    scale = SCALES[run.actions] if run.actions != "wild" or rng.random() < 0.2 else 1.0
    action: NDArray[Any] = rng.uniform(space.low.astype(np.float64), space.high.astype(np.float64)) * scale
    if run.actions == "wild" and rng.random() < 0.1:
        action[rng.integers(action.size)] = _WILD[rng.integers(len(_WILD))]
    return action.astype(run.dtype)


def draw_runs(
    id: str, option_sets: int, seeds: int, steps: int, draw: int = 0, engine: str | None = None
) -> Iterator[Run]:
    """Runs of an id, first with the default options and then with random ones. draw: the seed of the drawing."""
    rng = np.random.default_rng([draw, zlib.crc32(id.encode())])
    with mjenv.make(id, engine=engine) as env:
        bodies = [env.model.body(i).name for i in range(env.model.nbody)]
    for index in range(option_sets):
        options = draw_options(id, bodies, rng) if index else {}
        for _ in range(seeds):
            seed = int(rng.choice([0, 2**32 + 5, 2**63 + 1])) if rng.random() < 0.1 else int(rng.integers(2**31))
            dtype = "float64" if rng.integers(2) else "float32"
            actions = list(SCALES)[rng.integers(len(SCALES))]
            yield Run(id, options, seed, steps, dtype, actions, engine)


def versions(engine: str | None = None) -> str:
    """The versions of what is compared."""
    theirs = f"gymnasium {gymnasium.__version__}, mujoco {mujoco.__version__}, numpy {np.__version__}"
    return f"mjenv {mjenv.version(engine)} with {theirs}"
