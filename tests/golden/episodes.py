"""Records what Gymnasium returns step by step: trajectories/, custom/, state/ and episodes.txt."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from cases import (
    CUSTOM_MODELS,
    DATA_ARRAYS,
    EPISODE,
    EXAMPLE_EPISODES,
    EXAMPLE_SEED,
    FRAMES,
    IDS,
    IS_MUJOCO_4,
    LONG_STEPS,
    MODEL_ARRAYS,
    OPTIONS,
    OPTIONS_SEED,
    RESET,
    SEED,
    SIMULATE,
    STAGES,
    STATE_IDS,
    STEP,
    STEPS,
    UNGUARDED,
)
from machine import FOLDERS, HERE, hexed, lines_of, norm_rounding

CUSTOM = HERE / "custom"
HASHED = re.compile(r"obs|reset_obs|final_obs|qpos|qvel|data\..*|model\..*")
ARRAYS = (
    *("action", "obs", "reward", "terminated", "truncated", "info", "qpos", "qvel"),
    *("reset_at", "reset_obs", "reset_info"),
)


def type_name(value: Any) -> str:
    """mjenv_dtype's name for what Gymnasium returns."""
    if isinstance(value, np.ndarray | np.generic):
        return f"numpy_{value.dtype}"
    return f"python_{type(value).__name__}"


def learn_types(env: gymnasium.Env, seed: int) -> tuple[list[list[Any]], list[list[Any]]]:
    """Fields [name, count, type] of the infos of a step and a reset."""
    _, reset_info = env.reset(seed=seed)
    info = env.step(np.zeros(env.action_space.shape, np.float32))[4]

    def fields(values: dict[str, Any]) -> list[list[Any]]:
        return [[key, np.size(value), type_name(value)] for key, value in values.items()]

    def described(field: list[Any]) -> list[Any]:
        return [field[0], field[1], "action_dtype" if field[2] == "numpy_float32" else field[2]]

    return [described(field) for field in fields(info)], [described(field) for field in fields(reset_info)]


def flat(info: dict[str, Any], fields: list[list[Any]]) -> np.ndarray:
    if list(info) != [field[0] for field in fields]:
        raise SystemExit(f"record.py: the keys of an info changed to {list(info)}")
    return np.concatenate([np.empty(0)] + [np.ravel(value).astype(np.float64) for value in info.values()])


def widened(env: gymnasium.Env, scale: float) -> np.ndarray:
    """A float64 action, drawn as a sample but not rounded."""
    low, high = env.action_space.low.astype(np.float64), env.action_space.high.astype(np.float64)
    return env.action_space.np_random.uniform(low, high) * scale


def sampled_actions(env: gymnasium.Env, steps: int) -> Iterator[np.ndarray]:
    for _ in range(steps):
        yield env.action_space.sample()


def large_actions(env: gymnasium.Env, steps: int) -> Iterator[np.ndarray]:
    """float64 actions; in every second ten steps they are up to three times as large as the bounds."""
    for t in range(steps):
        yield widened(env, 3.0 if t // 10 % 2 else 1.0)


def bad_actions(env: gymnasium.Env, steps: int, dtype: type) -> Iterator[np.ndarray]:
    """NaN, infinite and huge elements among good actions."""
    for t in range(steps):
        action = widened(env, 1e6 if t % 7 == 5 else 1.0)
        if t % 7 == 1:
            action[t % action.size] = np.nan
        if t % 7 == 3:
            action[t % action.size] = np.inf if t % 2 else -np.inf
        yield action.astype(dtype)


def option_line(name: str, value: Any) -> str:
    if isinstance(value, str):
        return f"option {name} string {value}"
    if isinstance(value, int):
        return f"option {name} integer {int(value)}"
    return f"option {name} reals {hexed(value if isinstance(value, tuple) else [value])}"


def hashes(array: np.ndarray, rows: int) -> np.ndarray:
    """A hash for each step and row, in place of an array's numbers."""
    words = np.ascontiguousarray(array, np.float64).view(np.uint64).reshape(len(array) * rows, -1)
    values = np.full(len(words), 0xCBF29CE484222325, np.uint64)
    for column in words.T:
        values = (values ^ column) * np.uint64(0x100000001B3)
        values ^= values >> np.uint64(32)
    return values.reshape(len(array), rows)


def golden(
    name: str,
    seed: int,
    options: dict[str, Any],
    fields: list[str],
    arrays: dict[str, np.ndarray],
    facts: dict[str, str],
    rows: int = 1,
    is_whole: bool = False,
) -> bytes:
    for key, array in arrays.items():
        if not is_whole and HASHED.fullmatch(key) and array.shape[1] > rows:
            arrays[key] = hashes(array, rows)
    lines = ["mjenv-golden 1", f"id {name}", f"seed {seed}", *lines_of(facts)]
    lines += [*(option_line(*option) for option in options.items()), *fields]
    for key, array in arrays.items():
        lines.append(f"array {key} {array.dtype.kind}{array.dtype.itemsize} {' '.join(map(str, array.shape))}")
    return "\n".join([*lines, "data\n"]).encode() + b"".join(array.tobytes() for array in arrays.values())


def field_lines(info_fields: list[list[Any]], reset_fields: list[list[Any]]) -> list[str]:
    lines = ["info {} {} {}".format(*field) for field in info_fields]
    return lines + ["reset_info {} {} {}".format(*field) for field in reset_fields]


def trajectory(name: str, seed: int, kind: str, options: dict[str, Any], facts: dict[str, str]) -> bytes:
    """One golden. kind: "" (defaults), "options" or "strict0"."""
    limit = 20 if kind == "strict0" else EPISODE
    local = {
        key: str(CUSTOM / Path(value).name) if str(value).startswith(".") else value for key, value in options.items()
    }
    env = gymnasium.make(name, disable_env_checker=True, max_episode_steps=limit, **local)
    info_fields, reset_fields = learn_types(env, seed)
    env.action_space.seed(seed)
    steps = LONG_STEPS if env.observation_space.shape[0] > 150 else STEPS
    actions = {
        "": lambda: sampled_actions(env, steps),
        "options": lambda: large_actions(env, steps),
        "strict0": lambda: bad_actions(env, steps, UNGUARDED[name][0]),
    }[kind]()

    rows: dict[str, list[Any]] = {}

    def put(**values: Any) -> None:
        for key, value in values.items():
            rows.setdefault(key, []).append(np.array(value))

    def reset(at: int, seed: int | None = None) -> None:
        obs, info = env.reset(seed=seed)
        put(reset_at=np.int64(at), reset_obs=obs, reset_info=flat(info, reset_fields))

    reset(0, seed)
    ended = 0
    for t, action in enumerate(actions):
        # Without strict an ended episode goes on for a while.
        if ended > (3 if kind == "strict0" else 0):
            reset(t)
            ended = 0
        obs, reward, terminated, truncated, info = env.step(action)
        data = env.unwrapped.data
        put(action=action, obs=obs, reward=np.float64(reward), info=flat(info, info_fields))
        put(terminated=np.uint8(terminated), truncated=np.uint8(truncated), qpos=data.qpos, qvel=data.qvel)
        ended += bool(terminated or truncated)
    env.close()

    own = {"max_episode_steps": limit} | ({"strict": 0} if kind == "strict0" else {})
    arrays = {key: np.stack(rows[key]) for key in ARRAYS}
    is_whole = kind == "" and name.endswith("-v5") and not IS_MUJOCO_4
    fields = field_lines(info_fields, reset_fields)
    return golden(name, seed, options | own, fields, arrays, facts, is_whole=is_whole)


def packed(value: Any) -> np.ndarray:
    """A flat float64 copy. Under NumPy 2, mujoco 2.2.2 gives small arrays a stride of 0, so that one element shows."""
    array = np.asarray(value)
    if array.size > 1 and 0 in array.strides:
        strides = np.empty(array.shape, array.dtype).strides
        array = np.lib.stride_tricks.as_strided(array, strides=strides)
    return array.astype(np.float64).ravel()


def state(name: str, facts: dict[str, str]) -> bytes:
    """The contents of MuJoCo's arrays after resets, steps and set_state."""
    env = gymnasium.make(name, disable_env_checker=True)
    info_fields, reset_fields = learn_types(env, SEED)
    env.action_space.seed(SEED)
    generator = np.random.default_rng(SEED)
    bare = env.unwrapped
    rows: dict[str, list[np.ndarray]] = {}
    for index, stage in enumerate(STAGES):
        action, qpos, qvel = np.zeros(bare.model.nu, np.float32), np.zeros(bare.model.nq), np.zeros(bare.model.nv)
        reward, info = 0.0, np.zeros(sum(field[1] for field in info_fields))
        if stage == RESET:
            obs = env.reset(seed=None if index else SEED)[0]
        elif stage == STEP:
            action = env.action_space.sample()
            obs, reward, _, _, values = env.step(action)
            info = flat(values, info_fields)
        elif stage == SIMULATE:
            action = env.action_space.sample()
            bare.do_simulation(action, FRAMES)
            obs = bare._get_obs()
        else:
            qpos = bare.data.qpos + generator.uniform(-0.1, 0.1, bare.model.nq)
            qvel = bare.data.qvel + generator.uniform(-0.5, 0.5, bare.model.nv)
            bare.set_state(qpos, qvel)
            obs = bare._get_obs()
        row = {"stage": np.uint8(stage), "action": action, "set_qpos": qpos, "set_qvel": qvel}
        row |= {"obs": obs, "reward": np.float64(reward), "info": info}
        row |= {f"data.{key}": packed(getattr(bare.data, key)) for key in DATA_ARRAYS}
        for key, value in row.items():
            rows.setdefault(key, []).append(np.array(value))
    arrays = {key: np.stack(values) for key, values in rows.items()}
    for key in MODEL_ARRAYS:
        arrays[f"model.{key}"] = packed(attrgetter(key)(bare.model))[None]
    env.close()
    return golden(name, SEED, {}, field_lines(info_fields, reset_fields), arrays, facts)


def option_goldens(facts: dict[str, str]) -> Iterator[tuple[str, bytes]]:
    for name in IDS:
        content = trajectory(name, OPTIONS_SEED, "options", OPTIONS[name], facts)
        yield f"trajectories/{name}.options.golden", content


def goldens(facts: dict[str, str]) -> Iterator[tuple[str, bytes]]:
    for name in IDS:
        yield f"trajectories/{name}.golden", trajectory(name, SEED, "", {}, facts)
    for name, (_, options) in UNGUARDED.items():
        yield f"trajectories/{name}.strict0.golden", trajectory(name, SEED, "strict0", options, facts)
    for model, (name, options) in CUSTOM_MODELS.items():
        place = FOLDERS[facts["mujoco"]] / facts["libm"] / "custom"
        chosen = {"xml_file": os.path.relpath(CUSTOM / f"{model}.xml", place), **options}
        yield f"custom/{model}.golden", trajectory(name, SEED, "options", chosen, facts)
    for name in STATE_IDS:
        yield f"state/{name}.golden", state(name, facts)


class Checksum:
    """FNV-1a over 64-bit words."""

    def __init__(self) -> None:
        self.value = 0xCBF29CE484222325

    def add(self, *values: Any) -> None:
        for value in values:
            for word in np.ravel(value).astype(np.float64).view(np.uint64).tolist():
                self.add_word(word)

    def add_word(self, word: int) -> None:
        self.value = (self.value ^ word) * 0x100000001B3 % 2**64


def example_episodes(name: str, norm: str) -> str:
    """The line of an id in episodes.txt: ID NORM LENGTH RETURN CHECKSUM."""
    env = gymnasium.make(name, disable_env_checker=True)
    env.action_space.seed(EXAMPLE_SEED)
    checksum, length, total = Checksum(), 0, 0.0
    for episode in range(EXAMPLE_EPISODES):
        obs, info = env.reset(seed=None if episode else EXAMPLE_SEED)
        checksum.add(obs, *info.values())
        done = False
        while not done:
            obs, reward, terminated, truncated, info = env.step(env.action_space.sample())
            checksum.add(obs, reward)
            checksum.add_word(int(terminated))
            checksum.add_word(int(truncated))
            checksum.add(*info.values())
            done = terminated or truncated
            length += 1
            total += float(reward)
    env.close()
    return f"{name} {norm} {length} {total.hex()} {checksum.value:016x}"


def episodes(facts: dict[str, str]) -> bytes:
    lines = [
        "# What Gymnasium gives for the examples' episodes: ID NORM LENGTH RETURN CHECKSUM",
        f"# {EXAMPLE_EPISODES} episodes of sampled float32 actions, the environment and the action space seeded with"
        f" {EXAMPLE_SEED} once; LENGTH steps in all, RETURN their rewards added in order.",
        "# CHECKSUM: h = 0xcbf29ce484222325, then h = (h ^ word) * 0x100000001b3 mod 2^64 for each 64-bit word: after a"
        " reset observation, reset info; after a step observation, reward, terminated, truncated, info.",
        "# " + ", ".join(lines_of(facts)),
        *(example_episodes(name, facts["norm"]) for name in IDS),
    ]
    return "\n".join(lines).encode() + b"\n"


# Comparisons with the Gymnasium that is installed: episodes.py ID... prints the lines of the ids.
if __name__ == "__main__":
    for chosen in sys.argv[1:]:
        print(example_episodes(chosen, norm_rounding()))
