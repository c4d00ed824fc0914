"""Randomisation at resets, noise, delays and pushes, against a wrapper around Gymnasium's environment, every bit."""

from __future__ import annotations

import dataclasses
import math
import pickle
from collections import deque
from collections.abc import Mapping
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

import mjenv
from conftest import IDS
from mjenv import Delay, Noise, Offset, Push, Same, Scale, Value
from mjenv.verify import check_same

Array = NDArray[Any]


class Perturbed(gymnasium.Wrapper[Any, Any, Any, Any]):
    """What mjenv's keywords randomize, noise, delay and push do, written for Gymnasium."""

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        randomize: Mapping[str, Value | Same] | None = None,
        noise: Noise | None = None,
        delay: Delay | None = None,
        push: list[Push] | None = None,
    ) -> None:
        super().__init__(env)
        self.base: Any = env.unwrapped
        self.draws, self.noise, self.delay = dict(randomize or {}), noise or Noise(), delay or Delay()
        self.pushes = push or []
        self.bodies = [self.number("body", push.body) for push in self.pushes]
        self.own = {name: np.array(getattr(*self.place(name)), np.float64) for name in self.draws}

    def number(self, kind: str, name: str | int) -> int:
        """The number of an object."""
        if isinstance(name, int):
            return name
        return int(mujoco.mj_name2id(self.base.model, mujoco.mju_str2Type(kind), name))

    def place(self, name: str) -> tuple[Any, str]:
        owner, _, member = name.rpartition(".")
        return self.base.model.opt if owner == "opt" else self.base.model, member

    def elements(self, name: str, draw: Value | Same) -> Any:
        """The numbers of the elements that are drawn."""
        numbers = np.arange(self.own[name].size).reshape(self.own[name].shape)
        if draw.elements is not None:
            return np.array(draw.elements)
        for kind in ("body", "geom", "joint", "actuator"):
            names = getattr(draw, kind)
            if names is not None:
                numbers = numbers[[self.number(kind, one) for one in names]]
        return (numbers if draw.columns is None else numbers[:, np.atleast_1d(draw.columns)]).reshape(-1)

    def drawn(self, draw: Value, count: int) -> Any:
        rng = self.base.np_random
        if draw.choices is not None:
            return np.array(draw.choices, np.float64)[rng.integers(len(draw.choices), size=count)]
        low, high, mean, std = draw.low, draw.high, draw.mean, draw.std
        if draw.distribution == "uniform":
            return rng.uniform(low, high, count)
        if draw.distribution == "log_uniform":
            return np.array([math.exp(x) for x in rng.uniform(math.log(low or 0), math.log(high or 0), count)])
        if draw.distribution == "normal":
            return rng.normal(mean, std, count)
        values = np.empty(count)
        for i in range(count):
            values[i] = rng.normal(mean, std)
            while not (low or 0) <= values[i] <= (high or 0):
                values[i] = rng.normal(mean, std)
        return values

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        obs, info = self.env.reset(**options)
        drawn, kind = np.zeros(0), "value"
        for name, draw in self.draws.items():
            elements, own = self.elements(name, draw), self.own[name].reshape(-1)
            if isinstance(draw, Same):
                values = np.repeat(drawn, len(elements) // len(drawn)) * draw.factor
            else:
                values = drawn = self.drawn(draw, 1 if draw.shared else len(elements))
                kind = draw.kind
            values = (
                values if kind == "value" else own[elements] * values if kind == "scale" else own[elements] + values
            )
            owner, member = self.place(name)
            if self.own[name].ndim == 0:
                setattr(owner, member, values.item())
            else:
                getattr(owner, member).reshape(-1)[elements] = values
        if any(draw.set_constants for draw in self.draws.values()):
            mujoco.mj_setConst(self.base.model, mujoco.MjData(self.base.model))
        rng = self.base.np_random
        self.left = [rng.integers(push.every[0], push.every[1] + 1) for push in self.pushes]
        self.lasts = [0 for _ in self.pushes]  # how many steps each force lasts, the last step included
        first = np.zeros(self.base.model.nu) + self.delay.first_action
        if self.delay.redraw == "reset":
            self.delays = {name: self.drawn_delay(name) for name in ("action", "observation")}
        else:
            self.delays = {}
        self.actions = deque([first] * np.max(self.delay.action))
        self.observations = deque([np.zeros_like(obs)] * np.max(self.delay.observation))
        first_seen = self.observed(obs)
        if self.delay.first_observation == "reset":
            first_seen = self.observations[-1]
            self.observations = deque([first_seen] * len(self.observations))
        return first_seen, info

    def drawn_delay(self, name: str) -> int:
        """The delay of an episode; of a step, if each draws one."""
        given = getattr(self.delay, name)
        return given if isinstance(given, int) else int(self.base.np_random.integers(given[0], given[1] + 1))

    def delayed(self, name: str, waiting: Any) -> Any:
        """The newest of those that wait, which is the last one, or an older one."""
        found = waiting[-1 - self.delays[name]]
        waiting.popleft()
        return found

    def noisy(self, scale: Any, shape: Any) -> Any:
        if self.noise.distribution == "uniform":
            return self.base.np_random.uniform(-np.array(scale), np.array(scale), shape)
        return self.base.np_random.normal(0, scale, shape)

    def observed(self, obs: Array) -> Array:
        if self.delay.redraw == "step":
            self.delays["observation"] = self.drawn_delay("observation")
        if np.any(self.noise.observation):
            obs = obs + self.noisy(self.noise.observation, obs.shape)
        self.observations.append(obs)
        return self.delayed("observation", self.observations)

    def step(self, action: Array) -> Any:
        rng, dtype = self.base.np_random, action.dtype
        self.actions.append(action.copy())
        if self.delay.redraw == "step":
            self.delays["action"] = self.drawn_delay("action")
        action = self.delayed("action", self.actions).astype(dtype)
        if np.any(self.noise.action):
            action = (action + self.noisy(self.noise.action, action.shape)).astype(dtype)
        forces = self.base.data.xfrc_applied
        for i, (push, body) in enumerate(zip(self.pushes, self.bodies, strict=True)):
            if self.lasts[i] > 1:
                self.lasts[i] -= 1
                continue
            if self.lasts[i] == 1:
                forces[body] = 0
                self.lasts[i] = 0
            self.left[i] -= 1
            if self.left[i] > 0:
                continue
            if push.velocity is None:
                forces[body] = rng.uniform(*np.array((*push.force, *push.torque)).T)
                fewest, most = np.broadcast_to(push.duration, 2)
                self.lasts[i] = rng.integers(fewest, most + 1)
            else:
                dof = self.base.model.body_dofadr[body]
                still = ((0.0, 0.0),) * 3
                kick = rng.uniform(*np.array((*push.velocity, *(push.angular_velocity or still))).T)
                self.base.data.qvel[dof : dof + 6] += kick
            self.left[i] = rng.integers(push.every[0], push.every[1] + 1)
        obs, *rest = self.env.step(action)
        return (self.observed(obs), *rest)


def settings_of(id: str, rng: np.random.Generator) -> dict[str, Any]:
    """Every distribution, and each of noise, delay and pushes in half of the cases."""
    env: Any = gymnasium.make(id).unwrapped
    model = env.model
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, i) for i in range(model.nbody)]
    bodies: list[Any] = [names[i] or i for i in range(1, model.nbody)]
    many = [
        ("body_mass", Scale(0.5, 1.5, body=bodies[:2], set_constants=bool(rng.integers(2)))),
        ("body_mass", Scale(0.5, 2.0, "log_uniform", shared=True)),
        ("geom_friction", Scale(0.3, 2.0, columns=0)),
        ("dof_damping", Scale(distribution="normal", mean=1.0, std=0.05)),
        ("actuator_gear", Scale(0.8, 1.1, "truncated_normal", mean=1.0, std=0.2, columns=(0,))),
        ("dof_armature", Scale(choices=(0.5, 1.0, 1.5))),
        ("opt.gravity", Offset(-0.5, 0.5, elements=(2, 0))),
        ("opt.timestep", Scale(0.9, 1.1)),
        ("geom_rgba", Value(0.0, 1.0)),
        ("geom_solref", Scale(0.9, 1.2, shared=True)),
    ]
    chosen = [many[i] for i in rng.permutation(len(many))[:4]]
    found: dict[str, Any] = {"randomize": dict(chosen)}
    if rng.integers(2):
        size = env.observation_space.shape[0]
        found["noise"] = Noise(
            float(rng.choice([0, 0.1])), list(rng.uniform(0, 0.2, size)) if rng.integers(2) else 0.05
        )
    if rng.integers(2):
        count = env.action_space.shape[0]
        first = [0.0, 0.3, tuple(rng.uniform(-0.4, 0.4, count))][rng.integers(3)]
        found["delay"] = Delay(*(int(x) for x in rng.integers(0, 4, 2)), first_action=first)
    if rng.integers(2):
        force = ((-30.0, 30.0), (-30.0, 30.0), (0.0, 0.0))
        lasts: Any = [1, 3, (2, 5)][rng.integers(3)]
        found["push"] = [
            Push(bodies[0], force, every=(3, 9), duration=lasts),
            Push(bodies[-1], torque=((0, 1),) * 3, every=(1, 1)),
        ]
        if model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE:
            ranges: Any = ((-0.5, 0.5), (-0.5, 0.5), (0.0, 0.3))
            turns: Any = [None, ((-1.0, 1.0),) * 3][rng.integers(2)]
            found["push"].append(Push(bodies[0], velocity=ranges, angular_velocity=turns, every=(2, 6)))
    return found


def numbers(info: dict[str, Any]) -> dict[str, Any]:
    """Without the types: a cost that reaches its limit of 10 is an int in Gymnasium."""
    return {name: np.asarray(value, np.float64) for name, value in info.items()}


@pytest.mark.parametrize("id", IDS)
def test_wrapper(id: str) -> None:
    """One environment, two sets of settings, with resets, pickling and draws of the user's own in between."""
    rng = np.random.default_rng([IDS.index(id), 7])
    for _ in range(2):
        settings = settings_of(id, rng)
        ours, theirs = mjenv.make(id, **settings), Perturbed(gymnasium.make(id), **settings)
        what = f"{id} {settings}"
        check_same(what, ours.reset(seed=3), theirs.reset(seed=3))
        for t in range(40):
            dtype = np.float32 if t < 20 else np.float64
            action = rng.uniform(-1, 1, ours.action_space.shape).astype(dtype)
            a, b = ours.step(action), theirs.step(action)
            check_same(f"{what}: step {t}", (*a[:4], numbers(a[4])), (*b[:4], numbers(b[4])))
            if t % 13 == 5:
                check_same("np_random", ours.np_random.integers(9, size=3), theirs.base.np_random.integers(9, size=3))
            if t % 17 == 8:
                ours = pickle.loads(pickle.dumps(ours))
            if b[2] or b[3] or t % 11 == 10:
                for name in (*settings["randomize"], "xfrc_applied"):
                    place, member = (theirs.base.data, name) if name == "xfrc_applied" else theirs.place(name)
                    mine: Any = (
                        ours.data if name == "xfrc_applied" else ours.model.opt if "opt." in name else ours.model
                    )
                    check_same(f"{what}: {name}", np.array(getattr(mine, member)), np.array(getattr(place, member)))
                check_same(f"{what}: reset", ours.reset(), theirs.reset())
        ours.close()


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.name)
@pytest.mark.parametrize("id", ["Hopper-v5", "Ant-v4", "Reacher-v5"])
def test_vector(id: str, mode: AutoresetMode) -> None:
    """Rows on threads, with automatic resets; same_step has final observations."""
    rng = np.random.default_rng([IDS.index(id), 8])
    settings = settings_of(id, rng) | {"noise": Noise(0.05, 0.02), "delay": Delay(1, 2)}
    options: dict[str, Any] = {"max_episode_steps": 15, "autoreset_mode": mode}
    ours = mjenv.make_vec(id, 3, num_threads=2, **options, **settings)
    makers = [lambda: Perturbed(gymnasium.make(id, max_episode_steps=15), **settings)] * 3
    theirs = gymnasium.vector.SyncVectorEnv(makers, autoreset_mode=mode)
    check_same("reset", ours.reset(seed=1)[0], theirs.reset(seed=1)[0])
    for t in range(50):
        actions = rng.uniform(-1, 1, ours.action_space.shape).astype(np.float32)
        a, b = ours.step(actions), theirs.step(actions)
        check_same(f"step {t}", a[:4], b[:4])
        for row, final in enumerate(b[4].get("final_obs", ())):
            if final is not None:
                check_same(f"step {t}: final_obs of row {row}", a[4]["final_obs"][row], final)
        check_same(f"step {t}: observe", ours.observe(), b[0])
        done = b[2] | b[3]
        if mode == AutoresetMode.DISABLED and done.any():
            mask = {"reset_mask": done}
            check_same(f"step {t}: reset", ours.reset(options=mask)[0], theirs.reset(options=mask)[0])
    ours.close()


DELAYS = [
    Delay((0, 3), (1, 2), first_action=0.25),
    Delay((1, 1), (0, 4)),
    Delay(2, (0, 2)),
    Delay((0, 2), 0, first_action=-0.5, redraw="step"),
    Delay((0, 3), (0, 3), redraw="step"),
]


@pytest.mark.parametrize("delay", DELAYS, ids=str)
@pytest.mark.parametrize("noise", [None, Noise(0.05, 0.02)], ids=["calm", "noisy"])
def test_delays_with_a_range(delay: Delay, noise: Noise | None) -> None:
    """One environment, and images in the middle of episodes."""
    settings: dict[str, Any] = {"delay": delay, "noise": noise, "push": [Push(1, ((-9, 9),) * 3, every=(2, 5))]}
    ours, theirs = mjenv.make("Hopper-v5", **settings), Perturbed(gymnasium.make("Hopper-v5"), **settings)
    rng = np.random.default_rng(1)
    check_same("reset", ours.reset(seed=5), theirs.reset(seed=5))
    for t in range(60):
        action = rng.uniform(-1, 1, 3).astype(np.float32 if t % 3 else np.float64)
        a, b = ours.step(action), theirs.step(action)
        check_same(f"step {t}", (*a[:4], numbers(a[4])), (*b[:4], numbers(b[4])))
        if t % 7 == 3:
            other = mjenv.make("Hopper-v5", **settings)
            other.restore(ours.snapshot())
            ours = other
        if b[2] or b[3] or t % 11 == 10:
            check_same("reset", ours.reset(), theirs.reset())


@pytest.mark.parametrize("lanes", [0, "auto"])
@pytest.mark.parametrize("delay", [Delay(1, 3), Delay((0, 2), (1, 3)), Delay(0, (0, 2), redraw="step")], ids=str)
def test_uniform_noise_by_names(delay: Delay, lanes: int | str) -> None:
    """Rows in lanes and alone, with the reset's own observation before the first delayed one."""
    delay = dataclasses.replace(delay, first_observation="reset")
    by_names = Noise({"thigh_joint": 0.2}, {"qpos": 0.1, "qvel": [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]}, "uniform")
    by_numbers = Noise([0.2, 0.0, 0.0], [0.1] * 5 + [0.0, 0.1, 0.2, 0.3, 0.4, 0.5], "uniform")
    limits: dict[str, Any] = {"max_episode_steps": 9, "autoreset_mode": AutoresetMode.SAME_STEP}
    ours = mjenv.make_vec("Hopper-v5", 5, lanes=lanes, noise=by_names, delay=delay, **limits)
    makers = [lambda: Perturbed(gymnasium.make("Hopper-v5", max_episode_steps=9), noise=by_numbers, delay=delay)] * 5
    theirs = gymnasium.vector.SyncVectorEnv(makers, autoreset_mode=AutoresetMode.SAME_STEP)
    check_same("reset", ours.reset(seed=1)[0], theirs.reset(seed=1)[0])
    for t in range(30):
        actions = np.random.default_rng(t).uniform(-1, 1, (5, 3)).astype(np.float32)
        check_same(f"step {t}", ours.step(actions)[:4], theirs.step(actions)[:4])


@pytest.mark.parametrize("options", [{"num_threads": 2}, {"lanes": 0}, {"num_threads": 1}], ids=str)
@pytest.mark.parametrize("redraw", ["reset", "step"])
def test_delays_with_a_range_in_rows(redraw: Any, options: dict[str, Any]) -> None:
    rows = 7
    settings: dict[str, Any] = {"delay": Delay((0, 2), (0, 3), 0.1, redraw), "noise": Noise(0.0, 0.01)}
    limits: dict[str, Any] = {"max_episode_steps": 9, "autoreset_mode": AutoresetMode.SAME_STEP}
    ours = mjenv.make_vec("HalfCheetah-v5", rows, **limits, **options, **settings)
    makers = [lambda: Perturbed(gymnasium.make("HalfCheetah-v5", max_episode_steps=9), **settings)] * rows
    theirs = gymnasium.vector.SyncVectorEnv(makers, autoreset_mode=AutoresetMode.SAME_STEP)
    check_same("reset", ours.reset(seed=1)[0], theirs.reset(seed=1)[0])
    for t in range(30):
        actions = np.random.default_rng(t).uniform(-1, 1, (rows, 6)).astype(np.float32)
        check_same(f"step {t}", ours.step(actions)[:4], theirs.step(actions)[:4])
        check_same(f"observe {t}", ours.observe(), ours.observe())


SAME: list[dict[str, Any]] = [
    {"actuator_gainprm": Value(20, 40, columns=0), "actuator_biasprm": Same(factor=-1, columns=1)},
    {"actuator_gainprm": Scale(0.5, 2, "log_uniform", columns=0), "actuator_biasprm": Same(columns=1)},
    {"body_mass": Scale(0.8, 1.2, shared=True), "body_inertia": Same(set_constants=True), "geom_friction": Same(0.5)},
    {"dof_damping": Offset(distribution="normal", mean=1.0, std=0.1), "dof_armature": Same(factor=0.25)},
    {"body_mass": Scale(0.8, 1.2), "body_inertia": Same(set_constants=True)},
    {"body_mass": Scale(0.8, 1.2, body=["torso", 3]), "body_inertia": Same(body=["torso", 3], set_constants=True)},
    {"geom_rbound": Scale(0.5, 1.5), "geom_size": Same(set_constants=True)},
    {"actuator_gainprm": Value(20, 40, columns=0), "actuator_biasprm": Same(factor=-1, columns=(1, 2))},
    {"dof_damping": Value(choices=(1.0, 2.0)), "dof_armature": Same(factor=0.5), "opt.gravity": Offset(-0.5, 0.5)},
]


@pytest.mark.parametrize("randomize", SAME, ids=range(len(SAME)))
def test_one_draw_for_several_arrays(randomize: dict[str, Any]) -> None:
    ours = mjenv.make("Ant-v5", randomize=randomize)
    theirs = Perturbed(gymnasium.make("Ant-v5"), randomize)
    for seed in (3, None, None):
        check_same("reset", ours.reset(seed=seed), theirs.reset(seed=seed))
        for t in range(5):
            action = np.random.default_rng(t).uniform(-1, 1, 8)
            a, b = ours.step(action), theirs.step(action)
            check_same(f"step {t}", a[:4], b[:4])
            if b[2]:
                break
        for name in randomize:
            owner: Any = ours.model.opt if "opt." in name else ours.model
            place, member = theirs.place(name)
            check_same(name, np.array(getattr(owner, member)), np.array(getattr(place, member)))


@pytest.mark.parametrize("threads", [1, 2])
def test_ranges_of_rows(threads: int) -> None:
    """A curriculum: rows draw from other ranges while they run. An image holds them."""
    rows = 5
    randomize: dict[str, Any] = {
        "geom_friction": Scale(0.9, 1.1, columns=0),
        "actuator_gear": Scale(0.5, 2, "log_uniform", columns=0),
        "body_mass": Scale(distribution="truncated_normal", mean=1.0, std=0.1, low=0.8, high=1.2),
    }
    ours = mjenv.make_vec("Hopper-v5", rows, num_threads=threads, randomize=randomize)
    wrappers = [Perturbed(gymnasium.make("Hopper-v5"), randomize) for _ in range(rows)]

    def check_resets(seed: int | None) -> None:
        found = ours.reset(seed=seed)[0]
        for row, wrapper in enumerate(wrappers):
            obs = wrapper.reset(seed=None if seed is None else seed + row)[0]
            check_same(f"row {row}", found[row], obs)
            for name in randomize:
                theirs = np.array(getattr(wrapper.base.model, name))
                check_same(f"row {row}: {name}", getattr(ours.model, name)[row], theirs)

    check_resets(1)
    assert ours.draw_range("actuator_gear").tolist() == [[0.5, 2]] * rows
    ours.set_draw_range("geom_friction", (0.2, 3))
    for wrapper in wrappers:
        wrapper.draws["geom_friction"] = Scale(0.2, 3, columns=0)
    check_resets(None)
    mask = np.arange(rows) % 2 == 1
    ranges = np.stack([1 + np.arange(rows) / 10, 2 + np.arange(rows) / 10], axis=1)
    ours.set_draw_range("actuator_gear", ranges, mask)
    ours.set_draw_range("body_mass", (1.0, 0.2, 0.5, 1.5), mask)
    for row in np.flatnonzero(mask):
        wrappers[row].draws["actuator_gear"] = Scale(*ranges[row].tolist(), "log_uniform", columns=0)
        wrappers[row].draws["body_mass"] = Scale(0.5, 1.5, "truncated_normal", mean=1.0, std=0.2)
    check_resets(None)
    other = mjenv.make_vec("Hopper-v5", rows, randomize=randomize)
    other.restore(ours.snapshot())
    assert np.array_equal(other.draw_range("body_mass"), ours.draw_range("body_mass"))
    ours = other
    check_resets(None)
    ours.copy_row(1, np.arange(rows) == 0)
    assert ours.draw_range("actuator_gear")[0].tolist() == ranges[1].tolist()
