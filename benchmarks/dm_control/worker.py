"""Steps the suite's tasks for one peer on request: worker.py PEER. Reads commands from stdin and answers on stdout.

about -> what runs here | tasks -> the tasks that the peer has | open DOMAIN-TASK -> ok | run SECONDS -> env steps and
CPU seconds taken | close -> ok
Each peer plays its own episodes under random actions drawn beforehand. Peers with pixels draw pictures of 64 x 64.
"""

from __future__ import annotations

import gc
import importlib.metadata
import itertools
import os
import platform
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

ENVS = 64
WARM_UP = 50  # steps of each environment before measuring
ACTIONS = 256
EPISODE = 1000  # steps


class Task:
    """One task: step takes an action and returns how many environment steps it made."""

    def __init__(self, shape: tuple[int, ...], low: Any, high: Any, step: Callable[[Any], int]) -> None:
        low, high = np.maximum(low, -1), np.minimum(high, 1)  # lqr's motors have no bounds
        values = np.random.default_rng(0).uniform(low, high, (ACTIONS, *shape))
        self.actions, self.step = itertools.cycle(list(values)), step


def of_suite(suite: Any, task: str) -> Task:
    env = suite.load(*task.split("-"), task_kwargs={"random": 1})
    env.reset()
    spec = env.action_spec()

    def step(action: Any) -> int:
        env.step(action)
        return 1

    return Task(spec.shape, spec.minimum, spec.maximum, step)


def their_suite() -> Any:
    from dm_control import suite

    suite.quadruped.Physics.contexts = None  # quadruped-escape shows its terrain to OpenGL, which is off here
    return suite


def dm_control(task: str) -> Task:
    return of_suite(their_suite(), task)


def mj_step(task: str) -> Task:
    """MuJoCo's part of dm_control's steps alone, in MuJoCo's own library."""
    import mujoco

    env = their_suite().load(*task.split("-"), task_kwargs={"random": 1})
    env.reset()
    spec = env.action_spec()
    physics, frames, left = env.physics, env._n_sub_steps, itertools.cycle(reversed(range(EPISODE)))
    model, data = physics.model.ptr, physics.data.ptr

    def step(action: Any) -> int:
        data.ctrl[:] = action
        mujoco.mj_step(model, data, frames)
        if next(left) == 0:
            env.reset()
        return 1

    return Task(spec.shape, spec.minimum, spec.maximum, step)


def mjenv_suite(task: str) -> Task:
    from mjenv_dm_control import suite

    return of_suite(suite, task)


def mjenv_single(task: str) -> Task:
    import mjenv

    env = mjenv.make(f"dm_control/{task}-v0")
    env.reset(seed=1)
    space = env.action_space

    def step(action: Any) -> int:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()
        return 1

    return Task(space.shape, space.low, space.high, step)


def mjenv_rows(task: str) -> Task:
    return mjenv_vector(task, ENVS)


def mjenv_vector(task: str, rows: int, make: Any = None, **keywords: Any) -> Task:
    import mjenv

    file, _, frame_skip = task.rpartition(":")
    if file:  # a model
        keywords |= {"xml_file": file, "frame_skip": int(frame_skip)}
    envs = (make or mjenv.make_vec)("Model-v0" if file else f"dm_control/{task}-v0", rows, num_threads=1, **keywords)
    envs.reset(seed=1)
    space = envs.single_action_space

    def step(actions: Any) -> int:
        envs.step(actions)
        return rows

    return Task((rows, *space.shape), space.low, space.high, step)


PIXELS = {"height": 64, "width": 64, "camera_id": 0}
REPEAT = 2  # of each action before a picture


alive = []  # dm_control hangs when it frees a context of OSMesa, so these environments stay


def dm_control_pixels(task: str) -> Task:
    """As agents that learn from pixels use dm_control: a picture after two steps with the same action."""
    from dm_control import suite

    env = suite.load(*task.split("-"), task_kwargs={"random": 1})
    alive.append(env)
    env.reset()
    spec = env.action_spec()

    def step(action: Any) -> int:
        for _ in range(REPEAT):
            if env.step(action).last():
                break
        env.physics.render(**PIXELS)
        return 1

    return Task(spec.shape, spec.minimum, spec.maximum, step)


def mjenv_pixels(rows: int) -> Callable[[str], Task]:
    def open_task(task: str) -> Task:
        from mjenv_dm_control.pixels import PixelVectorEnv

        size = PIXELS["height"], PIXELS["width"]
        return mjenv_vector(task, rows, PixelVectorEnv, pixels=size, camera=PIXELS["camera_id"], action_repeat=REPEAT)

    return open_task


def envpool_id(task: str) -> str:
    """EnvPool's name: ball_in_cup-catch is BallInCupCatch-v1."""
    words = task.replace("-", "_").split("_")
    return "".join(word[:1].upper() + word[1:] for word in words) + "-v1"


def envpool_rows(task: str) -> Task:
    import envpool

    envs = envpool.make_gymnasium(envpool_id(task), num_envs=ENVS, num_threads=1, seed=1)
    envs.reset()
    space = envs.action_space

    def step(actions: Any) -> int:
        envs.step(actions)
        return ENVS

    return Task((ENVS, *space.shape), space.low, space.high, step)


def envpool_tasks() -> list[str]:
    import envpool

    known = set(envpool.list_all_envs())
    return [task for task in all_tasks() if envpool_id(task) in known]


def all_tasks() -> list[str]:
    """The suite's tasks, without those that mjenv lacks."""
    return os.environ["TASKS"].split()


PEERS: dict[str, tuple[Callable[[str], Task], str]] = {
    "dm_control": (dm_control, "dm_control mujoco numpy"),
    "mj_step": (mj_step, "dm_control mujoco numpy"),
    "mjenv-suite": (mjenv_suite, "numpy dm_env"),
    "mjenv-single": (mjenv_single, "numpy gymnasium"),
    "mjenv-64": (mjenv_rows, "numpy gymnasium"),
    "envpool-64": (envpool_rows, "numpy envpool"),
    "dm_control-pixels": (dm_control_pixels, "dm_control mujoco numpy"),
    "mjenv-pixels": (mjenv_pixels(1), "numpy gymnasium"),
    "mjenv-pixels-64": (mjenv_pixels(ENVS), "numpy gymnasium"),
}


def run(task: Task, seconds: float, least: int = 1) -> tuple[int, float]:
    clock, steps = time.process_time, 0
    start = clock()
    while clock() - start < seconds or steps < least:
        steps += task.step(next(task.actions))
    return steps, clock() - start


def main() -> None:
    open_task, packages = PEERS[sys.argv[1]]
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    task: Task | None = None
    gc.disable()
    for line in sys.stdin:
        command, *arguments = line.split()
        answer = "ok"
        if command == "about":
            versions = [f"{name} {importlib.metadata.version(name)}" for name in packages.split()]
            answer = ", ".join([*versions, f"Python {platform.python_version()}"])
        elif command == "tasks":
            answer = " ".join(envpool_tasks() if sys.argv[1].startswith("envpool") else all_tasks())
        elif command == "open":
            task = open_task(arguments[0])
            # A picture takes milliseconds, so rows with pictures make few steps.
            least = WARM_UP if "pixels" not in sys.argv[1] else 2
            run(task, 0, least * (ENVS if "64" in sys.argv[1] else 1))
        elif command == "close":
            task = None
            gc.collect()
        else:
            assert task is not None
            answer = "{} {!r}".format(*run(task, float(arguments[0])))
        answers.write(answer + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
