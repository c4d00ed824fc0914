"""OGBench's pointmaze and antmaze, its own classes on mjenv: make_maze_env("ant", "maze", maze_type="teleport")."""

import sys
from types import SimpleNamespace
from unittest import mock

import gymnasium.envs.mujoco

import mjenv


class MujocoEnv(mjenv.MujocoEnv, engine="4.0"):
    """The engine of which OGBench needs at least 3.1.6."""


with mock.patch.object(gymnasium.envs.mujoco, "MujocoEnv", MujocoEnv), mock.patch.dict(sys.modules):
    for name in [name for name in sys.modules if name.startswith("ogbench.locomaze")]:
        del sys.modules[name]
    from ogbench.locomaze import maze, point


class PointEnv(point.PointEnv):
    """Calls the class's mj_step instead of the package's."""

    def step(self, action):
        with mock.patch.object(point, "mujoco", SimpleNamespace(mj_step=lambda m, d, nstep: self.mj_step(nstep))):
            return super().step(action)


maze.PointEnv, make_maze_env = PointEnv, maze.make_maze_env
