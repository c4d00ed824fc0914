"""Records what Gymnasium's SyncVectorEnv returns in its three modes of automatic resets: vector/."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from cases import VECTOR_IDS, VECTOR_ROWS, VECTOR_SEED, VECTOR_SEEDS, VECTOR_STEPS
from episodes import field_lines, golden, learn_types

OPTION = {
    AutoresetMode.DISABLED: "disabled",
    AutoresetMode.NEXT_STEP: "next_step",
    AutoresetMode.SAME_STEP: "same_step",
}


def make(name: str, mode: AutoresetMode, limit: int) -> gymnasium.vector.VectorEnv:
    return gymnasium.make_vec(
        name,
        VECTOR_ROWS,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        max_episode_steps=limit,
        disable_env_checker=True,
    )


def actions_of(envs: gymnasium.vector.VectorEnv) -> Iterator[np.ndarray]:
    envs.action_space.seed(VECTOR_SEED)
    while True:
        yield envs.action_space.sample()


def first_fall(name: str) -> int | None:
    """The steps until a row falls, None if no row soon does: with that time limit the fall is a truncation, too."""
    envs = make(name, AutoresetMode.DISABLED, VECTOR_STEPS)
    envs.reset(seed=VECTOR_SEED)
    for step, action in zip(range(1, VECTOR_STEPS // 2), actions_of(envs), strict=False):
        if envs.step(action)[2].any():
            return step
    return None


def masked(infos: dict[str, Any], fields: list[list[Any]]) -> tuple[np.ndarray, np.ndarray]:
    """[rows][numbers of all fields], 0 where a field's mask is unset, and [rows][fields], the masks."""
    values, masks = [np.empty((VECTOR_ROWS, 0))], [np.empty((VECTOR_ROWS, 0), np.uint8)]
    for name, count, _ in fields:
        mask = np.asarray(infos.get(f"_{name}", np.zeros(VECTOR_ROWS, np.bool_)))
        value = np.zeros((VECTOR_ROWS, count))
        if mask.any():
            value[mask] = np.asarray(infos[name], np.float64).reshape(VECTOR_ROWS, count)[mask]
        values.append(value)
        masks.append(mask[:, None].astype(np.uint8))
    return np.concatenate(values, axis=1), np.concatenate(masks, axis=1)


class Rows:
    """Arrays that grow by a row of numbers with each call."""

    def __init__(self) -> None:
        self.lists: dict[str, list[np.ndarray]] = {}

    def put(self, **values: Any) -> None:
        for key, value in values.items():
            self.lists.setdefault(key, []).append(np.array(value).reshape(-1))

    def put_infos(self, name: str, infos: dict[str, Any], fields: list[list[Any]]) -> None:
        values, masks = masked(infos, fields)
        self.put(**{name: values, f"{name}_mask": masks})

    def arrays(self) -> dict[str, np.ndarray]:
        return {key: np.stack(values) for key, values in self.lists.items()}


def vector(name: str, mode: AutoresetMode, facts: dict[str, str]) -> bytes:
    """One golden: steps, resets in between, and with reset masks where nothing else resets."""
    fall = first_fall(name)
    limit = fall or 12
    with gymnasium.make(name, disable_env_checker=True) as single:
        info_fields, reset_fields = learn_types(single, 0)
    envs = make(name, mode, limit)
    width = envs.single_observation_space.shape[0]
    steps, resets = Rows(), Rows()

    def reset(at: int, seeds: list[int | None], mask: np.ndarray) -> None:
        options = None if mask.all() else {"reset_mask": mask.copy()}
        obs, infos = envs.reset(seed=seeds, options=options)
        resets.put(reset_at=np.int64(at), reset_mask=mask.astype(np.uint8))
        resets.put(reset_seed=np.int64([-1 if seed is None else seed for seed in seeds]))
        resets.put(reset_obs=obs * mask[:, None])
        resets.put_infos("reset_reset_info", infos, reset_fields)

    every = np.ones(VECTOR_ROWS, np.bool_)
    nothing = [None] * VECTOR_ROWS
    reset(0, [VECTOR_SEED + row for row in range(VECTOR_ROWS)], every)
    ended, both = ~every, False
    for step, action in zip(range(VECTOR_STEPS), actions_of(envs), strict=False):
        if step == VECTOR_STEPS // 2:
            reset(step, VECTOR_SEEDS, every)
        elif mode == AutoresetMode.DISABLED and ended.any():
            reset(step, nothing, ended)
        obs, rewards, terminations, truncations, infos = envs.step(action)
        ended = terminations | truncations
        both = both or bool((terminations & truncations).any())
        final = np.zeros((VECTOR_ROWS, width))
        final_mask = infos.get("_final_obs", ~every)
        for row in np.flatnonzero(final_mask):
            final[row] = infos["final_obs"][row]
        steps.put(action=action, obs=obs, reward=rewards, terminated=terminations.astype(np.uint8))
        steps.put(truncated=truncations.astype(np.uint8))
        steps.put_infos("info", infos, info_fields)
        steps.put_infos("reset_info", infos, reset_fields)
        steps.put(final_obs=final, final_obs_mask=final_mask.astype(np.uint8))
        steps.put_infos("final_info", infos.get("final_info", {}), info_fields)
    envs.close()
    if fall and not both:
        raise SystemExit(f"record.py: no row of {name} fell on its last step")
    options = {"max_episode_steps": limit, "autoreset_mode": OPTION[mode]}
    arrays = {**steps.arrays(), **resets.arrays()}
    return golden(name, VECTOR_SEED, options, field_lines(info_fields, reset_fields), arrays, facts, rows=VECTOR_ROWS)


def vectors(facts: dict[str, str]) -> Iterator[tuple[str, bytes]]:
    for name in VECTOR_IDS:
        for mode in AutoresetMode:
            yield f"vector/{name}.{OPTION[mode]}.golden", vector(name, mode, facts)
