"""Rows with models and inputs of their own beside Gymnasium's SyncVectorEnv, every bit.

Gymnasium plays each episode once, and its outputs are kept. mjenv's rows then do the same on 1, 2 and 5 threads, go on
in another process in the middle, and play the end as a rollout.
"""

from __future__ import annotations

import copy
import multiprocessing
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import mjenv
from mjenv.verify import check_same
from test_writes import DATA, IDS, MODEL, names_for

ROWS, ROLLOUT = 7, 12  # in 4 lanes on one thread, in 2 on two threads, one by one on five

# What rows that are stepped in lanes may have of their own (docs/lanes.md). The first write of another array ends that.
IN_LANES = {
    *("body_mass", "body_inertia", "body_ipos", "geom_friction", "geom_solref", "geom_solimp", "geom_solmix"),
    *("dof_damping", "dof_armature", "dof_frictionloss", "jnt_range", "jnt_stiffness", "actuator_gainprm"),
    *("actuator_biasprm", "opt.gravity", "geom_rgba", "qpos", "qvel", "ctrl", "time", "qacc_warmstart"),
}


@dataclass
class Write:
    """values[ROWS, ...], of which the masked rows are written."""

    name: str
    mask: NDArray[np.bool_]
    values: NDArray[np.float64]


@dataclass
class Constants:
    """mj_setConst of all rows."""


@dataclass
class Reset:
    seed: int
    results: Any


@dataclass
class Step:
    actions: NDArray[Any]
    results: Any


Event = Write | Constants | Reset | Step


def place_of(owner: Any, name: str) -> tuple[Any, str]:
    """The object with the array, and the attribute: of an environment of Gymnasium, or of our rows."""
    group, _, member = name.rpartition(".")
    return owner.data if name in DATA else owner.model.opt if group == "opt" else owner.model, member


class Gymnasium:
    """Plays on Gymnasium, and keeps what was done and what came of it."""

    def __init__(self, id: str) -> None:
        self.vector: Any = gymnasium.make_vec(id, ROWS, vectorization_mode="sync")
        self.vector.action_space.seed(IDS.index(id))
        self.rng = np.random.default_rng(IDS.index(id))
        self.events: list[Event] = []

    def reset(self, seed: int) -> None:
        self.events.append(Reset(seed, copy.deepcopy(self.vector.reset(seed=seed))))

    def step(self) -> None:
        actions = self.vector.action_space.sample()
        with np.errstate(all="ignore"):
            results = self.vector.step(actions)
        self.events.append(Step(actions, copy.deepcopy(results)))

    def write(self, name: str) -> None:
        mask, values = self.rng.random(ROWS) < 0.6, []
        for env, is_written in zip(self.vector.envs, mask, strict=True):
            place, member = place_of(env.unwrapped, name)
            old = np.asarray(getattr(place, member), np.float64)
            values.append((MODEL | DATA)[name](self.rng, old))
            if not is_written:
                continue
            if old.ndim == 0:
                setattr(place, member, values[-1].item())
            else:
                getattr(place, member)[...] = values[-1]
        if values[0].size:
            self.events.append(Write(name, mask, np.stack(values)))

    def set_constants(self) -> None:
        for env in self.vector.envs:
            mujoco.mj_setConst(env.unwrapped.model, env.unwrapped.data)
        self.events.append(Constants())


def recording(id: str, steps: int, in_lanes: bool) -> list[Event]:
    names, theirs = names_for(id), Gymnasium(id)
    if in_lanes:
        names = [name for name in names if name in IN_LANES]
    theirs.reset(5)
    for t in range(steps):
        if theirs.rng.random() < 0.3:
            for name in theirs.rng.choice(names, 2, replace=False):
                theirs.write(name)
        if t == steps // 3:
            theirs.write("body_mass")
            theirs.set_constants()
        if t == 2 * steps // 3:
            theirs.write("dof_frictionloss")  # of some rows, while the model has none
        theirs.step()
    theirs.reset(6)  # the values in the model stay
    theirs.write("geom_friction")
    if not in_lanes:
        theirs.write("xfrc_applied")
    for _ in range(ROLLOUT):
        theirs.step()
    theirs.vector.close()
    return theirs.events


def check_infos(what: str, ours: dict[str, Any], theirs: dict[str, Any]) -> None:
    """A cost that reaches its limit is an int in Gymnasium, and rounds those of the other rows if it comes first."""
    check_same(f"{what}: keys", list(ours), list(theirs))
    for name in theirs:
        check_same(f"{what}: {name}", ours[name].astype(theirs[name].dtype), theirs[name])


def play(what: str, ours: mjenv.VectorEnv, events: list[Event]) -> None:
    """Does the same, and compares what comes of it."""
    for index, event in enumerate(events):
        at = f"{what}, event {index}"
        if isinstance(event, Write):
            place, member = place_of(ours, event.name)
            getattr(place, member)[event.mask] = event.values[event.mask]
        elif isinstance(event, Constants):
            ours.set_constants()
        else:
            results = ours.reset(seed=event.seed) if isinstance(event, Reset) else ours.step(event.actions)
            for a, b in zip(results[:-1], event.results[:-1], strict=True):
                check_same(at, a, b)
            check_infos(at, results[-1], event.results[-1])


def roll_out(what: str, ours: mjenv.VectorEnv, steps: list[Step]) -> None:
    """Each row's steps up to its end. Gymnasium resets it then, and a rollout does not."""
    actions = np.stack([step.actions for step in steps], axis=1)
    rewards, terminations, truncations, observations = ours.rollout(actions, observations=True)
    ended = np.zeros(ROWS, np.bool_)
    for t, step in enumerate(steps):
        obs, reward, terminated, truncated, _ = step.results
        for row in np.flatnonzero(~ended):
            at = f"{what}, step {t} of the rollout, row {row}"
            check_same(at, observations[row, t], obs[row])
            check_same(at, rewards[row, t], reward[row])
            check_same(at, (terminations[row, t], truncations[row, t]), (terminated[row], truncated[row]))
        ended |= terminated | truncated


def go_on(id: str, image: bytes, events: list[Event]) -> None:
    """Plays the rest of the events in this process."""
    ours = mjenv.make_vec(id, ROWS, num_threads=1, strict=False)
    ours.restore(image)
    play(f"{id} in another process", ours, events)


@pytest.fixture(scope="module")
def another_process() -> Iterator[Executor]:
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        yield pool


@pytest.mark.parametrize("id", IDS)
@pytest.mark.parametrize("in_lanes", [True, False])
def test_rows_that_differ(id: str, in_lanes: bool, another_process: Executor, request: pytest.FixtureRequest) -> None:
    events = recording(id, 300 if request.config.getoption("--long") else 40, in_lanes)
    steps = [event for event in events[-ROLLOUT:] if isinstance(event, Step)]
    assert len(steps) == ROLLOUT
    half, end = len(events) // 2, len(events) - ROLLOUT
    elsewhere = None
    for num_threads in (1, 2, 5):
        what = f"{id}, {num_threads} threads"
        ours = mjenv.make_vec(id, ROWS, num_threads=num_threads, strict=False)
        play(what, ours, events[:half])
        if num_threads == 2:
            elsewhere = another_process.submit(go_on, id, ours.snapshot(), events[half:])
        play(what, ours, events[half:end])
        image = ours.snapshot()
        play(what, ours, events[end:])
        ours.restore(image)
        roll_out(what, ours, steps)
        ours.close()
    assert elsewhere is not None
    elsewhere.result()
