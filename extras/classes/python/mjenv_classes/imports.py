"""Runs modules whose classes derive from Gymnasium's MujocoEnv, as they are, on mjenv."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any

from mjenv.rows.arrays import Data, Model
from mjenv_classes import MujocoEnv

# Functions of the mujoco package that are methods here.
_METHODS = ("mj_resetData", "mj_forward", "mj_step", "mj_name2id", "mj_id2name")


@contextmanager
def gymnasium_classes(engine: str | None = None) -> Iterator[None]:
    """While it is open, modules that are imported find mjenv.MujocoEnv as gymnasium.envs.mujoco.MujocoEnv:

        with mjenv.gymnasium_classes():
            from gymnasium.envs.mujoco.ant_v5 import AntEnv
        env = AntEnv()

    Modules that have a class derived from Gymnasium's are imported anew. Afterwards everything is as before: who then
    imports these modules gets Gymnasium's classes again. Imported modules also find a mujoco package whose mj_step and
    its like take self.model and self.data. engine: that of the classes.
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
    functions = sys.modules.get("mujoco")
    if functions is not None:
        sys.modules["mujoco"] = _Functions(functions)
    try:
        yield
    finally:
        package.MujocoEnv = mujoco_env.MujocoEnv = theirs
        if functions is not None:
            sys.modules["mujoco"] = functions
        new = [name for name, module in sys.modules.items() if name not in known and _derives(module, ours)]
        for name in (*before, *new):
            _put(name, before.get(name))


class _Functions(ModuleType):
    """The mujoco package, in which some functions also take mjenv's model and data."""

    def __init__(self, theirs: ModuleType) -> None:
        super().__init__("mujoco", theirs.__doc__)
        self.__dict__.update(vars(theirs))
        self.__dict__.update((name, _function(name, getattr(theirs, name))) for name in _METHODS)
        self.__dict__["_theirs"] = theirs

    def __setattr__(self, name: str, value: Any) -> None:
        """The import of a submodule makes it an attribute."""
        super().__setattr__(name, value)
        setattr(self._theirs, name, value)


def _function(name: str, theirs: Any) -> Any:
    def function(*given: Any, **named: Any) -> Any:
        structs = [value for value in (*given, *named.values()) if isinstance(value, (Model, Data))]
        if not structs:
            return theirs(*given, **named)
        rest = [value for value in given if not isinstance(value, (Model, Data))]
        named = {key: value for key, value in named.items() if not isinstance(value, (Model, Data))}
        return getattr(structs[0].simulation, name)(*rest, **named)

    return function


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
