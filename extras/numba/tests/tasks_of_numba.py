"""Hopper-v5 as machine code that numba compiles."""

from collections.abc import Sequence
from typing import Any

import mjenv_numba as jit
import numpy as np

from mjenv.capi.declarations import Dtype
from mjenv.task import Model
from tasks_of_python import CodeHopper

_FLOAT32 = int(Dtype.FLOAT32)


class NumbaHopper(CodeHopper):
    def build(self, model: Model) -> Sequence[float]:
        return self.numbers(model)

    @jit.reset
    def reset(self: Any, start: Any) -> None:  # type: ignore[override]
        qpos, qvel = jit.array(start.qpos, start.nq), jit.array(start.qvel, start.nv)
        for i in range(start.nq):
            qpos[i] += jit.uniform(start.random, -self[4], self[4])
        for i in range(start.nv):
            qvel[i] += jit.uniform(start.random, -self[4], self[4])

    @jit.reset_info
    def reset_info(self: Any, sim: Any, info: Any) -> None:  # type: ignore[override]
        qpos, qpos0 = jit.array(sim.qpos, sim.nq), jit.array(sim.qpos0, sim.nq)
        info[0] = qpos[0]
        info[1] = qpos[1] - qpos0[1]

    @jit.carry
    def carry(self: Any, sim: Any, carried: Any) -> None:  # type: ignore[override]
        carried[0] = jit.array(sim.qpos, 1)[0]

    @jit.observe
    def observe(self: Any, sim: Any, observation: Any) -> None:  # type: ignore[override]
        qpos, qvel = jit.array(sim.qpos, sim.nq), jit.array(sim.qvel, sim.nv)
        first = int(self[5])
        for i in range(first, sim.nq):
            observation[i - first] = qpos[i]
        for i in range(sim.nv):
            observation[sim.nq - first + i] = min(max(qvel[i], -10), 10)

    @jit.step
    def step(self: Any, sim: Any, outcome: Any) -> None:  # type: ignore[override]
        qpos, qvel, qpos0 = jit.array(sim.qpos, sim.nq), jit.array(sim.qvel, sim.nv), jit.array(sim.qpos0, sim.nq)
        action, info = jit.array(sim.action, sim.nu), jit.array(outcome.info, 6)
        velocity = (qpos[0] - jit.array(sim.carried, 1)[0]) / sim.dt
        healthy = self[8] < qpos[1] < self[9] and self[10] < qpos[2] < self[11]
        for i in range(2, sim.nq):
            healthy = healthy and self[6] < qpos[i] < self[7]
        for i in range(sim.nv):
            healthy = healthy and self[6] < qvel[i] < self[7]
        forward = self[0] * velocity
        survive = self[2] if healthy else 0.0
        if sim.action_dtype == _FLOAT32:  # NumPy computes in the action's type
            narrow = np.float32(0)
            for i in range(sim.nu):
                narrow += np.float32(action[i]) * np.float32(action[i])
            ctrl = float(np.float32(self[1]) * narrow)
        else:
            wide = 0.0
            for i in range(sim.nu):
                wide += action[i] * action[i]
            ctrl = self[1] * wide
        info[0] = qpos[0]
        info[1] = qpos[1] - qpos0[1]
        info[2] = velocity
        info[3] = forward
        info[4] = -ctrl
        info[5] = survive
        outcome.reward = (forward + survive) - ctrl
        outcome.terminated = self[3] != 0 and not healthy
