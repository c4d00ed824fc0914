"""Runs modules whose classes derive from Gymnasium's MujocoEnv, as they are, on mjenv."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any

from mjenv.gym.env import MujocoEnv


@contextmanager
def gymnasium_classes(engine: str | None = None) -> Iterator[None]:
    """While it is open, modules that are imported find mjenv.MujocoEnv as gymnasium.envs.mujoco.MujocoEnv:

        with mjenv.gymnasium_classes():
            from gymnasium.envs.mujoco.ant_v5 import AntEnv
        env = AntEnv()

    Modules that have a class derived from Gymnasium's are imported anew. Afterwards everything is as before: who then
    imports these modules gets Gymnasium's classes again. engine: that of the classes.
    """
    package: Any = import_module("gymnasium.envs.mujoco")
    mujoco_env: Any = import_module("gymnasium.envs.mujoco.mujoco_env")
    theirs = mujoco_env.MujocoEnv
    ours = type("MujocoEnv", (MujocoEnv,), {}, engine=engine)
    found = {name: module for name, module in sys.modules.items() if _derives(module, theirs)}
    before = {name: module for name, module in found.items() if name != "__main__"}
    known = set(sys.modules)
    for name in before:
        _put(name, None)
    package.MujocoEnv = mujoco_env.MujocoEnv = ours
    try:
        yield
    finally:
        package.MujocoEnv = mujoco_env.MujocoEnv = theirs
        new = [name for name, module in sys.modules.items() if name not in known and _derives(module, ours)]
        for name in (*before, *new):
            _put(name, before.get(name))


def _derives(module: ModuleType | None, base: type) -> bool:
    """Whether a module has a class that is derived from this one."""
    values = list(vars(module).values()) if isinstance(module, ModuleType) else ()
    return any(isinstance(value, type) and issubclass(value, base) and value is not base for value in values)


def _put(name: str, module: ModuleType | None) -> None:
    """Makes the imported module of a name, also as an attribute of its package; None: none is imported."""
    package, _, attribute = name.rpartition(".")
    holder = sys.modules.get(package)
    if module is None:
        sys.modules.pop(name, None)
        if holder is not None and isinstance(vars(holder).get(attribute), ModuleType):
            delattr(holder, attribute)
    else:
        sys.modules[name] = module
        if holder is not None:
            setattr(holder, attribute, module)
