"""QuadrupedJoystickNumPy-v0: the task of joystick.cpp in NumPy, with equal bits. joystick.cpp explains it."""

from __future__ import annotations

from typing import Any

import numpy as np
from mjenv_batch import Random, Sim
from numpy.typing import NDArray

import mjenv
from mjenv.task import Model, Setting
from mjenv.task.locomotion import Terrain, air_time, touching

ID = "QuadrupedJoystickNumPy-v0"
LEVELS, TYPES, PATCH, EPISODE = 6, 3, 6, 500
COMMANDS = ("command_forward", "command_left", "command_turn")
# The terms of the observation and their lengths, named as in joystick.cpp, so that policies of one play in the other.
POLICY = {
    "up": 3,
    "velocity": 3,
    "spin": 3,
    "joints": 12,
    "joint_speeds": 12,
    "last_action": 12,
    "command": 3,
    "clock": 2,
}
TRUE = {f"true_{name}": length for name, length in POLICY.items() if name != "last_action"}
GRID = [(0.2 * i, 0.2 * j) for i in range(-2, 3) for j in range(-1, 2)]

Array = NDArray[np.float64]


def turned_back(qpos: Array, vectors: Array) -> Array:
    """Vectors in the trunk's frame."""
    w, axis = qpos[:, 3:4], -qpos[:, 4:7]
    twice = np.cross(axis, vectors)
    twice += twice
    return np.asarray(vectors + w * twice + np.cross(axis, twice))


def closeness(squared_error: Array, width: float) -> Array:
    """The value of a term of the reward: 1 if the error is 0."""
    return 1 / (1 + squared_error / (width * width))


def squares(values: Array) -> Array:
    return np.asarray(np.square(values).sum(axis=1))


def wave(phase: Array) -> Array:
    """A wave between -1 and 1 with period 1, which is -1 at 0 and rises as fast as it falls."""
    return 1 - np.abs(4 * (phase - np.floor(phase)) - 2)


class Joystick(mjenv.Task):
    model = "./rough.xml"
    frame_skip = 2
    time_limit = EPISODE
    needs = (
        *("qpos", "qvel", "time", "xpos", "xmat", "site_xpos", "qfrc_actuator"),
        *("ncon", "contact.geom1", "contact.geom2", "contact.dist"),
        *("model.geom_friction", "model.body_mass", "model.actuator_gainprm"),
    )
    max_contacts = 32
    observation_fields = {
        "policy": POLICY,
        "critic": {**TRUE, "heights": len(GRID), "feet": 4, "friction": 1, "mass": 1, "kp": 1},
    }
    options = {
        "command_forward": Setting((-0.4, 0.8), "range of the commanded velocity forward, m/s", live=True),
        "command_left": Setting((-0.3, 0.3), "range of the commanded velocity to the left, m/s", live=True),
        "command_turn": Setting((-0.6, 0.6), "range of the commanded turn to the left, rad/s", live=True),
        "least_level": Setting(0.0, "the easiest ground, 0 to 5", 0, LEVELS - 1, live=True),
        "most_level": Setting(LEVELS - 1.0, "the hardest ground, 0 to 5", 0, LEVELS - 1, live=True),
        "command_seconds": Setting(4.0, "mean time until a command changes, s", 0.1, 1000),
        "reset_noise_scale": 0.05,
        "stride": Setting(0.5, "time of a stride of the trot, s", 0.05, 10),
        "lift": Setting(0.08, "how high the trot lifts a foot above the ground, m", 0, 1),
        "velocity_reward": 1.5,
        "turn_reward": 0.75,
        "gait_reward": 0.5,
        "air_time_reward": 0.5,
        "alive_reward": 0.2,
        "bounce_cost": 1.0,
        "tilt_cost": 0.5,
        "jerk_cost": 0.02,
        "torque_cost": 0.0002,
    }
    state = {"command": (3,), "air": (4,), "touched": (4,), "last": (12,), "level": (), "score": ()}
    state_bounds = {"level": (0, LEVELS - 1)}
    kept = ("level", "score")

    # The options, which become attributes.
    command_seconds: float
    reset_noise_scale: float
    stride: float
    lift: float
    velocity_reward: float
    turn_reward: float
    gait_reward: float
    air_time_reward: float
    alive_reward: float
    bounce_cost: float
    tilt_cost: float
    jerk_cost: float
    torque_cost: float

    def build(self, model: Model) -> None:
        legs = ("fl", "fr", "rl", "rr")
        self.feet = [model.index("geom", f"{leg}_foot") for leg in legs]
        self.sites = [model.index("site", f"{leg}_foot") for leg in legs]
        self.trunk, self.floor = model.index("body", "trunk"), model.index("geom", "floor")
        self.ground, self.terrain = model.index("geom", "ground"), Terrain(model, "ground")

    def drawn(self, rng: Random, parameters: Any, rows: int) -> Array:
        ranges = np.stack([parameters[name] for name in COMMANDS], axis=1)
        low, high = ranges[:, :, 0], ranges[:, :, 1]
        return np.asarray(low + (high - low) * rng.random((rows, 3)))

    def reset(self, rng: Random, rows: int) -> tuple[Array, Array, dict[str, Array]]:
        easiest, hardest = rng.parameters["least_level"], rng.parameters["most_level"]
        well = rng.kept["score"] / EPISODE
        level = rng.kept["level"] + np.where(well > 0.6, 1, np.where(well < 0.4, -1, 0))
        level = np.maximum(easiest, np.minimum(level, hardest))
        qpos, kind = np.tile(self.qpos0, (rows, 1)), rng.integers(0, TYPES, (rows,))
        qpos[:, 0] = PATCH * (level + 0.5 - 0.5 * LEVELS) + rng.uniform(-1, 1, (rows,))
        qpos[:, 1] = PATCH * (kind + 0.5 - 0.5 * TYPES) + rng.uniform(-1, 1, (rows,))
        qpos[:, 2] += self.terrain.height(qpos[:, 0], qpos[:, 1]) + 0.02
        sine = rng.uniform(-1, 1, (rows,))  # of half the heading
        qpos[:, 3], qpos[:, 6] = np.sqrt(1 - sine * sine), sine
        noise = self.reset_noise_scale
        qpos[:, 7:] += rng.uniform(-noise, noise, (rows, 12))
        qvel = rng.uniform(-noise, noise, (rows, 18))
        state = {"air": np.zeros((rows, 4)), "touched": np.zeros((rows, 4)), "last": np.zeros((rows, 12))}
        command = self.drawn(rng, rng.parameters, rows)
        return qpos, qvel, {**state, "command": command, "level": level, "score": np.zeros(rows)}

    def observe(self, sim: Sim) -> dict[str, Array]:
        rows, phase = len(sim.qpos), sim.time.reshape(-1) / self.stride
        upwards = np.tile([0.0, 0.0, 1.0], (rows, 1))
        seen = [turned_back(sim.qpos, upwards), turned_back(sim.qpos, sim.qvel[:, :3]), sim.qvel[:, 3:6]]
        seen += [sim.qpos[:, 7:], sim.qvel[:, 6:]]
        clock = np.stack([wave(phase), wave(phase + 0.25)], axis=1)
        heights = sim.qpos[:, 2:3] - self.terrain.around(sim.xpos[:, self.trunk], sim.xmat[:, self.trunk], GRID)
        friction, mass, gain = sim.model.geom_friction, sim.model.body_mass, sim.model.actuator_gainprm
        robot = np.stack([friction[:, self.feet[0], 0], mass[:, self.trunk], gain[:, 0, 0]], axis=1)
        return {
            "policy": np.concatenate([*seen, sim.last, sim.command, clock], axis=1),
            "critic": np.concatenate([*seen, sim.command, clock, heights, sim.touched, robot], axis=1),
        }

    def step(self, sim: Sim, action: NDArray[Any]) -> tuple[Array, NDArray[np.bool_], dict[str, Array]]:
        action, rows = action.astype(np.float64), len(action)
        velocity, spin = turned_back(sim.qpos, sim.qvel[:, :3]), sim.qvel[:, 3:6]
        vertical = turned_back(sim.qpos, np.tile([0.0, 0.0, 1.0], (rows, 1)))

        touches = touching(sim, self.feet, self.ground) | touching(sim, self.feet, self.floor)
        sim.touched[...] = touches
        flights = air_time(sim.air, touches, self.dt)
        flight = np.where(flights > 0, flights - 0.1, 0).sum(axis=1)

        # In a trot, the first and the last foot are in the air together, then the other two.
        swing = wave(sim.time.reshape(-1, 1) / self.stride + [0.25, 0.75, 0.75, 0.25])
        feet = sim.site_xpos[:, self.sites]
        above = feet[:, :, 2] - self.terrain.height(feet[:, :, 0], feet[:, :, 1])
        miss = squares(above - 0.022 - self.lift * np.maximum(swing, 0))

        off, turned = (velocity - sim.command)[:, :2], spin[:, 2] - sim.command[:, 2]
        follow = closeness(squares(off), 0.25)
        terms = {
            "velocity": self.velocity_reward * follow,
            "turn": self.turn_reward * closeness(turned * turned, 0.4),
            "gait": self.gait_reward * closeness(miss, 0.06),
            "air": self.air_time_reward * flight,
            "bounce": -(self.bounce_cost * (velocity[:, 2] * velocity[:, 2])),
            "tilt": -(self.tilt_cost * (squares(vertical[:, :2]) + 0.05 * squares(spin[:, :2]))),
            "jerk": -(self.jerk_cost * squares(action - sim.last)),
            "torque": -(self.torque_cost * squares(sim.qfrc_actuator[:, 6:])),
        }
        reward = self.alive_reward + terms["velocity"]
        for name in list(terms)[1:]:
            reward = reward + terms[name]
        finite = np.isfinite(sim.qpos).all(axis=1) & np.isfinite(sim.qvel).all(axis=1)
        low = sim.qpos[:, 2] - self.terrain.height(sim.qpos[:, 0], sim.qpos[:, 1]) < 0.16
        fallen = ~finite | low | (vertical[:, 2] < 0.5)

        sim.last[...] = action
        sim.score[...] += follow
        changes = sim.rng.random((rows,)) < self.dt / self.command_seconds
        drawn = self.drawn(sim.rng, sim.parameters, rows)
        sim.command[changes] = drawn[changes]
        infos = {"error": np.sqrt(squares(off)), "level": sim.level.copy()}
        return reward, fallen, {**infos, **{f"reward_{name}": values for name, values in terms.items()}}


mjenv.register(ID, Joystick)
