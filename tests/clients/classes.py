"""Classes of other packages that derive from Gymnasium's MujocoEnv, as they are installed."""

import importlib

import gymnasium

from common import ENGINE, classes, play, show

ROBOTS = ("ant", "half_cheetah", "hopper", "humanoid", "swimmer", "walker2d", "reacher")

with classes():
    for robot in ROBOTS:
        module = importlib.import_module(f"mo_gymnasium.envs.mujoco.{robot}_v5")
        kind = next(kind for name, kind in vars(module).items() if name.startswith("MO"))
        show(f"MO-Gymnasium, {kind.__name__}:", play(kind()))

    import gymnasium_robotics

    gymnasium.register_envs(gymnasium_robotics)
    for id in ("PointMaze_UMaze-v3", "PointMaze_LargeDense-v3", "AntMaze_UMaze-v4", "AntMaze_UMaze-v5"):
        show(f"Gymnasium-Robotics, {id}:", play(gymnasium.make(id, max_episode_steps=70)))
    if ENGINE == "2.2.2":  # on MuJoCo 4.0 the class itself fails
        from gymnasium_robotics.envs.multiagent_mujoco.coupled_half_cheetah import CoupledHalfCheetahEnv

        show("MaMuJoCo, CoupledHalfCheetahEnv:", play(CoupledHalfCheetahEnv()))

    from ogbench.locomaze.maze import make_maze_env

    for robot in ("ant", "point"):  # the class of humanoidmaze calls mj_step1 and mj_step2
        env = make_maze_env(robot, "maze", maze_type="medium", render_mode=None)
        show(f"OGBench, {robot}maze:", play(gymnasium.wrappers.TimeLimit(env, 70), options={"task_id": 1}))
