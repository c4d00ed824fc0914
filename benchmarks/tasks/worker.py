"""Steps Hopper-v5 as one kind of task on request: worker.py KIND [FOLDER]. peers/worker.py describes the commands.

FOLDER holds the plug-ins that benchmarks/tasks/run builds."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from peers.worker import GymnasiumSync, Mjenv, Vector, drawn, serve


class Plugin(Mjenv):
    """A task of a plug-in."""

    file, id = "", ""

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import mjenv

        mjenv.load_tasks(str(Path(sys.argv[2]) / self.file))
        super().__init__(self.id, envs, threads, seed)


class C(Plugin):
    file, id = "libhopper_c.so", "OwnHopper-v5"


class Cpp(Plugin):
    file, id = "libhopper_cpp.so", "CppHopper-v5"


class Rust(Plugin):
    file, id = "libhopper.so", "RustHopper-v5"


class Numpy(Mjenv):
    """A task in Python that computes with NumPy over all rows."""

    registered = False

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        if not Numpy.registered:
            self.register()
            Numpy.registered = True
        super().__init__("PythonHopper-v5", envs, threads, seed)

    @staticmethod
    def register() -> None:
        import mjenv
        from tasks_of_python import NumpyHopper

        mjenv.register("PythonHopper-v5", NumpyHopper)


class Numba(Numpy):
    """A task in Python that numba compiles."""

    packages = (*Numpy.packages, "numba")

    @staticmethod
    def register() -> None:
        import mjenv
        from tasks_of_numba import NumbaHopper

        mjenv.register("PythonHopper-v5", NumbaHopper)


class MujocoBatch(Vector):
    """Hopper-v5 as a user of mujoco.batch would write it: observations, rewards, limits and resets in NumPy over all
    simulations. It plays the same episodes as the others in distribution, on MuJoCo 4."""

    packages = ("mujoco", "numpy")

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import gymnasium
        from mujoco.batch import Batch

        env: Any = gymnasium.make(id).unwrapped
        batch = Batch(env.model, envs, threads)
        qpos, qvel, ctrl = batch.bind("qpos"), batch.bind("qvel"), batch.bind("ctrl")
        random = np.random.default_rng(seed)
        init_qpos, dt, frames = env.init_qpos.copy(), env.dt, env.frame_skip
        elapsed, ended = np.zeros(envs, np.int64), np.ones(envs, bool)

        def restart() -> None:
            ids = np.flatnonzero(ended)
            noise = random.uniform(-5e-3, 5e-3, (len(ids), qpos.shape[1] + qvel.shape[1]))
            qpos[ids] = init_qpos + noise[:, : qpos.shape[1]]
            qvel[ids] = noise[:, qpos.shape[1] :]
            elapsed[ids] = 0

        def advance(action: Any) -> tuple[Any, ...]:
            nonlocal ended
            before = qpos[:, 0].copy()
            ctrl[:] = action
            batch.step(nstep=frames)
            elapsed[:] += 1
            again = ended
            velocity = (qpos[:, 0] - before) / dt
            healthy = (qpos[:, 1] > 0.7) & (np.abs(qpos[:, 2]) < 0.2)
            healthy &= (np.abs(qpos[:, 2:]) < 100).all(1) & (np.abs(qvel) < 100).all(1)
            cost = 1e-3 * np.square(action).sum(1)
            info = {
                "x_position": qpos[:, 0].copy(),
                "z_distance_from_origin": qpos[:, 1] - init_qpos[1],
                "x_velocity": velocity,
                "reward_forward": velocity,
                "reward_ctrl": -cost,
                "reward_survive": healthy * 1.0,
            }
            reward, terminated, truncated = velocity + healthy - cost, ~healthy, elapsed >= 1000
            if again.any():  # a simulation whose episode had ended is reset instead of stepped
                restart()
                reward[again], terminated[again], truncated[again] = 0, False, False
            ended = terminated | truncated
            observation = np.concatenate([qpos[:, 1:], np.clip(qvel, -10, 10)], axis=1)
            return observation, reward, terminated, truncated, info

        restart()

        class Env:
            step = staticmethod(advance)
            close = staticmethod(env.close)

        super().__init__(Env, drawn(env.action_space, envs, np.float64, seed))


KINDS: dict[str, Any] = {
    "built-in": Mjenv,
    "c": C,
    "cpp": Cpp,
    "rust": Rust,
    "numba": Numba,
    "numpy": Numpy,
    "gymnasium": GymnasiumSync,
    "mujoco-batch": MujocoBatch,
}

if __name__ == "__main__":
    serve(KINDS[sys.argv[1]])
