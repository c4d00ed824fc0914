"""Arrays of mjModel and inputs of mjData, written at random times here and in Gymnasium, every bit.

Every test plays Gymnasium's environment beside mjenv's, writes the same numbers to both, and compares all outputs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import mjenv
from conftest import IDS
from mjenv.verify import check_same

STEPS = 300

Array = NDArray[np.float64]
Draw = Callable[[np.random.Generator, Array], Array]


def scaled(low: float, high: float) -> Draw:
    return lambda rng, old: old * rng.uniform(low, high, old.shape)


def moved(size: float) -> Draw:
    return lambda rng, old: old + rng.uniform(-size, size, old.shape)


def turned(rng: np.random.Generator, old: Array) -> Array:
    new = old + rng.uniform(-0.05, 0.05, old.shape)
    return new / np.linalg.norm(new, axis=-1, keepdims=True)


# What is written, and how its values are drawn from the old ones.
MODEL: dict[str, Draw] = {
    "body_mass": scaled(0.5, 1.5),
    "body_inertia": scaled(0.7, 1.4),
    "body_ipos": moved(0.02),
    "body_pos": moved(0.02),
    "body_quat": turned,
    "geom_friction": scaled(0.3, 2),
    "geom_size": scaled(0.9, 1.1),
    "geom_solref": scaled(0.9, 1.1),
    "geom_solimp": scaled(0.95, 1),
    "geom_margin": lambda rng, old: rng.uniform(0, 0.02, old.shape),
    "geom_solmix": scaled(0.5, 2),
    "dof_damping": scaled(0.5, 2),
    "dof_armature": scaled(0.5, 2),
    "dof_frictionloss": lambda rng, old: rng.uniform(0, 0.1, old.shape),
    "jnt_range": scaled(0.9, 1.1),
    "jnt_stiffness": lambda rng, old: rng.uniform(0, 2, old.shape),
    "qpos0": moved(0.05),
    "qpos_spring": moved(0.05),
    "actuator_gainprm": scaled(0.5, 1.5),
    "actuator_biasprm": scaled(0.5, 1.5),
    "actuator_gear": scaled(0.5, 1.5),
    "actuator_ctrlrange": scaled(0.8, 1.2),
    "actuator_forcerange": scaled(0.8, 1.2),
    "tendon_stiffness": lambda rng, old: rng.uniform(0, 2, old.shape),
    "tendon_damping": lambda rng, old: rng.uniform(0, 2, old.shape),
    "opt.timestep": scaled(0.8, 1.1),
    "opt.gravity": moved(2),
    "opt.wind": moved(2),
    "opt.density": lambda rng, old: rng.uniform(0, 2, old.shape),
    "opt.viscosity": lambda rng, old: rng.uniform(0, 1e-3, old.shape),
    "geom_rgba": lambda rng, old: rng.uniform(0, 1, old.shape).astype(np.float32).astype(np.float64),
}
DATA: dict[str, Draw] = {
    "qpos": moved(0.02),
    "qvel": moved(0.5),
    "ctrl": moved(0.1),
    "time": moved(0.1),
    "qacc_warmstart": moved(1),
    "qfrc_applied": lambda rng, old: rng.uniform(-2, 2, old.shape),
    "xfrc_applied": lambda rng, old: rng.uniform(-5, 5, old.shape),
}


def numbers(info: dict[str, Any]) -> dict[str, Array]:
    """Without the types: a cost that reaches its limit of 10 is an int in Gymnasium."""
    return {name: np.asarray(value, np.float64) for name, value in info.items()}


class Pair:
    """A row of mjenv, and Gymnasium's environment."""

    def __init__(self, rows: Any, row: int, theirs: Any) -> None:
        self.rows, self.row, self.theirs = rows, row, theirs

    def place(self, name: str) -> tuple[Any, str]:
        """The object of Gymnasium that has the array, and the attribute."""
        base = self.theirs.unwrapped
        owner, _, member = name.rpartition(".")
        return base.data if name in DATA else base.model.opt if owner == "opt" else base.model, member

    def old(self, name: str) -> Array:
        return np.asarray(getattr(*self.place(name)), np.float64)

    def write(self, name: str, values: Array) -> None:
        """The same assignment on both sides."""
        place, member = self.place(name)
        if values.ndim == 0:
            setattr(place, member, values.item())
        else:
            getattr(place, member)[...] = values
        self.rows.write(self.row, name, values)

    def write_some(self, rng: np.random.Generator, names: list[str]) -> list[str]:
        written = list(rng.choice(names, size=min(3, len(names)), replace=False))
        for name in written:
            old = self.old(name)
            if old.size:
                self.write(name, (MODEL | DATA)[name](rng, old))
        return written


def names_for(id: str) -> list[str]:
    # A ball or free joint's quaternion must keep its length, and the other arrays are empty there.
    free = id.split("-")[0] in ("Ant", "Humanoid", "HumanoidStandup")
    return [name for name in (*MODEL, *DATA) if not (free and name in ("qpos0", "qpos", "qpos_spring"))]


Opened = tuple[str, mjenv.Environment, Any]


@pytest.fixture(params=IDS)
def opened(request: pytest.FixtureRequest) -> Iterator[Opened]:
    """Each id with an environment here and in Gymnasium."""
    ours, theirs = mjenv.make(request.param), gymnasium.make(request.param)
    yield request.param, ours, theirs
    ours.close()
    theirs.close()


def test_random_writes(opened: Opened) -> None:
    """Arrays of the whole list, written before, between and after resets, one environment."""
    id, ours, theirs = opened
    rng = np.random.default_rng(IDS.index(id))
    base: Any = theirs.unwrapped
    pair = Pair(ours._rows, 0, theirs)
    written: set[str] = set()
    check_same("reset", ours.reset(seed=5), theirs.reset(seed=5))
    for t in range(STEPS):
        what = f"{id} step {t} after {sorted(written)}"
        if rng.random() < 0.15:
            written |= set(pair.write_some(rng, names_for(id)))
        if rng.random() < 0.03:
            check_same(f"{what}: reset", ours.reset(), theirs.reset())
        if rng.random() < 0.05:
            qpos = base.init_qpos + rng.uniform(-0.01, 0.01, base.model.nq)
            qvel = rng.uniform(-0.1, 0.1, base.model.nv)
            base.set_state(qpos, qvel)
            ours.set_state(qpos, qvel)
        if rng.random() < 0.1:
            for name in ("xpos", "cvel", "cfrc_ext", "geom_xpos", "qfrc_bias", "xfrc_applied"):
                check_same(f"{what}: {name}", np.array(getattr(ours.data, name)), np.array(getattr(base.data, name)))
        action = theirs.action_space.sample()
        with np.errstate(all="ignore"):
            a, b = ours.step(action), theirs.step(action)
        check_same(what, a[:4], b[:4])
        check_same(f"{what}: info", numbers(a[4]), numbers(b[4]))
        if b[2] or b[3]:
            check_same(f"{what}: reset", ours.reset(), theirs.reset())
    assert len(written) > 10


def test_write_after_set_constants(opened: Opened) -> None:
    """A write after mj_setConst does not change what mj_setConst has computed, also if it was the first write."""
    id, ours, theirs = opened
    rng = np.random.default_rng(IDS.index(id))
    base: Any = theirs.unwrapped
    pair = Pair(ours._rows, 0, theirs)
    check_same("reset", ours.reset(seed=1), theirs.reset(seed=1))
    for t in range(20):
        action = theirs.action_space.sample()
        a, b = ours.step(action), theirs.step(action)
        check_same(f"step {t}", a[:4], b[:4])
        if b[2]:
            check_same(f"step {t}: reset", ours.reset(), theirs.reset())
        if t == 2:
            mujoco.mj_setConst(base.model, base.data)
            ours._rows.set_constants(0)
            pair.write("body_mass", MODEL["body_mass"](rng, pair.old("body_mass")))
            for name in ("xpos", "cinert", "subtree_com", "crb"):
                check_same(name, np.array(getattr(ours.data, name)), np.array(getattr(base.data, name)))


def test_set_constants(opened: Opened) -> None:
    """mj_setConst in the middle of an episode and before a reset: the same model, the same steps."""
    id, ours, theirs = opened
    rng = np.random.default_rng(IDS.index(id))
    base: Any = theirs.unwrapped
    pair = Pair(ours._rows, 0, theirs)
    check_same("reset", ours.reset(seed=1), theirs.reset(seed=1))
    for name in ("body_mass", "body_inertia", "dof_armature"):
        pair.write(name, MODEL[name](rng, pair.old(name)))
    for when in ("in the episode", "before a reset"):
        mujoco.mj_setConst(base.model, base.data)
        ours._rows.set_constants(0)
        for name in ("body_subtreemass", "dof_invweight0", "body_invweight0", "actuator_acc0", "dof_M0"):
            check_same(f"{when}: {name}", np.array(getattr(ours.model, name)), np.array(getattr(base.model, name)))
        check_same(f"{when}: xpos", np.array(ours.data.xpos), np.array(base.data.xpos))
        check_same(f"{when}: meaninertia", float(ours.model.stat.meaninertia), float(base.model.stat.meaninertia))
        if when == "before a reset":
            check_same("reset", ours.reset(), theirs.reset())
        for t in range(50):
            action = theirs.action_space.sample()
            a, b = ours.step(action), theirs.step(action)
            check_same(f"{when}, step {t}", (*a[:4], numbers(a[4])), (*b[:4], numbers(b[4])))
            if b[2] or b[3]:
                check_same(f"{when}, step {t}: reset", ours.reset(), theirs.reset())


def test_reset_data(opened: Opened) -> None:
    """mj_resetData sets the row's own qpos0; a reset the model's, as Gymnasium's init_qpos."""
    _, ours, theirs = opened
    base: Any = theirs.unwrapped
    check_same("reset", ours.reset(seed=1), theirs.reset(seed=1))
    for model in (ours.model, base.model):
        model.qpos0[-1] += 0.1
    mujoco.mj_resetData(base.model, base.data)
    ours.mj_resetData()
    for name in ("qpos", "qvel", "xpos", "qacc_warmstart"):
        check_same(name, np.array(getattr(ours.data, name)), np.array(getattr(base.data, name)))
    action = theirs.action_space.sample()
    check_same("step", ours.step(action)[:4], theirs.step(action)[:4])
    check_same("reset", ours.reset(), theirs.reset())
