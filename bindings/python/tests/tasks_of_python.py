"""Hopper-v5, written again as tasks of Python: with NumPy over all rows, and with machine code for each row.

And how tests compare such tasks with Hopper-v5.
"""
# ruff: noqa: RUF012

from typing import Any

import numpy as np

import mjenv
from mjenv.task import Field, Model, Setting


class Hopper(mjenv.Task):
    """What both kinds have in common."""

    model = "hopper.xml"
    frame_skip = 4
    time_limit = 1000
    reward_threshold = 3800.0
    camera = {"trackbodyid": 2, "distance": 3.0, "lookat": (0, 0, 1.15), "elevation": -20.0}
    options = {
        "forward_reward_weight": 1.0,
        "ctrl_cost_weight": 1e-3,
        "healthy_reward": 1.0,
        "terminate_when_unhealthy": True,
        "healthy_state_range": (-100.0, 100.0),
        "healthy_z_range": (0.7, np.inf),
        "healthy_angle_range": (-0.2, 0.2),
        "reset_noise_scale": Setting(5e-3, low=0, high=1e300),
        "exclude_current_positions_from_observation": True,
    }
    state = {"x": ()}  # before the step

    forward_reward_weight: float
    ctrl_cost_weight: float
    healthy_reward: float
    terminate_when_unhealthy: bool
    healthy_state_range: tuple[float, float]
    healthy_z_range: tuple[float, float]
    healthy_angle_range: tuple[float, float]
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool


def within(values: Any, bounds: tuple[float, float]) -> Any:
    return (bounds[0] < values) & (values < bounds[1])


class NumpyHopper(Hopper):
    def reset(self, rng: Any, rows: int) -> tuple[Any, ...]:
        noise = self.reset_noise_scale
        qpos = self.qpos0 + rng.uniform(-noise, noise, (rows, self.nq))
        qvel = rng.uniform(-noise, noise, (rows, self.nv))
        return qpos, qvel, {"x": qpos[:, 0]}

    def carry(self, sim: Any) -> None:
        sim.x[...] = sim.qpos[:, 0]

    def observe(self, sim: Any) -> Any:
        first = 1 if self.exclude_current_positions_from_observation else 0
        return np.concatenate([sim.qpos[:, first:], np.clip(sim.qvel, -10, 10)], axis=1)

    def reset_info(self, sim: Any) -> dict[str, Any]:
        return {"x_position": sim.qpos[:, 0], "z_distance_from_origin": sim.qpos[:, 1] - self.qpos0[1]}

    def step(self, sim: Any, action: Any) -> tuple[Any, ...]:
        healthy = within(sim.qpos[:, 1], self.healthy_z_range) & within(sim.qpos[:, 2], self.healthy_angle_range)
        healthy &= within(sim.qpos[:, 2:], self.healthy_state_range).all(1)
        healthy &= within(sim.qvel, self.healthy_state_range).all(1)
        velocity = (sim.qpos[:, 0] - sim.x) / self.dt
        forward, survive = self.forward_reward_weight * velocity, healthy * self.healthy_reward
        ctrl = self.ctrl_cost_weight * np.sum(np.square(action), axis=1)
        infos = self.reset_info(sim)
        infos |= {"x_velocity": velocity, "reward_forward": forward, "reward_ctrl": -ctrl, "reward_survive": survive}
        return (forward + survive) - ctrl, ~healthy & self.terminate_when_unhealthy, infos


class CodeHopper(Hopper):
    """What tasks in machine code declare."""

    info_fields = {
        "x_position": (),
        "z_distance_from_origin": (),
        "x_velocity": (),
        "reward_forward": (),
        "reward_ctrl": Field(type="action"),
        "reward_survive": Field(type=float),
    }
    reset_info_fields = {"x_position": (), "z_distance_from_origin": ()}

    def numbers(self, model: Model) -> list[float]:
        first = int(self.exclude_current_positions_from_observation)
        self.observation_fields = {"qpos": model.nq - first, "qvel": model.nv}
        return [
            *(self.forward_reward_weight, self.ctrl_cost_weight, self.healthy_reward, self.terminate_when_unhealthy),
            *(self.reset_noise_scale, first, *self.healthy_state_range, *self.healthy_z_range),
            *self.healthy_angle_range,
        ]


def flat(values: Any) -> Any:
    """What two results must have in common: types, shapes and bits."""
    if isinstance(values, dict):
        return {name: flat(value) for name, value in values.items()}
    if isinstance(values, (tuple, list)):
        return [flat(value) for value in values]
    if values is None:
        return None
    array = np.asarray(values)
    return flat(list(array)) if array.dtype == object else (array.dtype.str, array.shape, array.tobytes())


def pair(rows: int = 64, own: str = "NumpyHopper-v5", **options: Any) -> list[mjenv.VectorEnv]:
    envs = [mjenv.make_vec(id, rows, **options) for id in ("Hopper-v5", own)]
    assert flat(envs[0].reset(seed=3)) == flat(envs[1].reset(seed=3))
    return envs


def check_steps(envs: list[mjenv.VectorEnv], steps: int, dtype: Any = np.float32, seed: int = 0) -> int:
    """Steps both and returns how many episodes ended."""
    stream, ended = np.random.default_rng(seed), 0
    for _ in range(steps):
        action = stream.uniform(-1, 1, (envs[0].num_envs, 3)).astype(dtype)
        built_in, own = (env.step(action) for env in envs)
        assert flat(built_in) == flat(own)
        ended += int((built_in[2] | built_in[3]).sum())
    return ended
