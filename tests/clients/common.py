"""What the programs of this folder share. Each runs on mjenv or on Gymnasium, by its argument, and prints results."""

import contextlib
import hashlib
import sys
from functools import partial
from typing import Any

import mujoco
import numpy as np

import mjenv
from mjenv.capi.engine import name_of

ON_MJENV = sys.argv[1:] == ["mjenv"]
ENGINE = name_of(mujoco.__version__)
# What run.py compares. Packages print other lines, with the time.
show = partial(print, ">", flush=True)


def id_of(robot: str) -> str:
    return f"mjenv:mjenv/{robot}" if ON_MJENV else robot


def classes() -> contextlib.AbstractContextManager[None]:
    """Inside it, imported classes derive from mjenv's MujocoEnv."""
    return mjenv.gymnasium_classes(ENGINE) if ON_MJENV else contextlib.nullcontext()


def digest(value: Any) -> str:
    """A few letters that stand for every bit of arrays, tensors, numbers, and containers of them."""
    found = hashlib.sha256()

    def add(value: Any) -> None:
        if isinstance(value, dict):
            value = [item for pair in sorted(value.items(), key=lambda pair: str(pair[0])) for item in pair]
        if isinstance(value, (list, tuple)):
            for item in value:
                add(item)
        else:
            array = np.asarray(value)
            found.update(str((array.dtype, array.shape)).encode())
            found.update(str(value).encode() if array.dtype.hasobject else array.tobytes())

    add(value)
    return found.hexdigest()[:12]


def seen(picture: Any) -> Any:
    """The digest of a picture. With NumPy 2, the package of MuJoCo 2.2.2 misreads its cameras: then the shape."""
    return np.shape(picture) if ENGINE == "2.2.2" else digest(picture)


def play(env: Any, steps: int = 150, seed: int = 4, **options: Any) -> str:
    """The digest of episodes: of all that reset and step return."""
    np.random.seed(seed)  # from which some packages draw
    env.action_space.seed(seed)
    found = [env.reset(seed=seed, **options)]
    for _ in range(steps):
        found.append(env.step(env.action_space.sample()))
        if found[-1][2] or found[-1][3]:
            found.append(env.reset(**options))
    return digest(found)
