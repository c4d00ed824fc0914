"""Gymnasium's MuJoCo environments, bit for bit, from a native library.

make("Ant-v5") gives a gymnasium.Env, make_vec("Ant-v5", 64) a gymnasium.vector.VectorEnv. ids(), spec(id), options(id)
and model_xml(id) describe the environments. load_tasks("libmy_robots.so") adds your own robots and tasks. Gymnasium
knows all ids as mjenv/Ant-v5 and so on.

make("Ant-v5", engine="4.0") computes with MuJoCo 4.0 instead of 2.2.2. engines() lists the engines.
"""

import importlib
from typing import TYPE_CHECKING, Any

from mjenv.beside import value_of
from mjenv.capi.engine import ENGINES
from mjenv.gym.namespace import follow_gymnasium

if TYPE_CHECKING:
    from mjenv._overloads import make, make_vec  # the same functions, with the keywords of each id
    from mjenv.capi.declarations import Kind, Status
    from mjenv.capi.schema import EngineInfo, Option
    from mjenv.errors import (
        AlreadyPendingCallError,
        BusyError,
        ClosedError,
        EngineError,
        Error,
        ForkedError,
        InternalError,
        InvalidValueError,
        ModelError,
        ModelFileError,
        NoAsyncCallError,
        OptionError,
        OutOfMemoryError,
        PhysicsError,
        RenderError,
        RenderSettingError,
        ResetNeeded,
        SnapshotError,
        TaskError,
        UnknownIdError,
        UnknownNameError,
    )
    from mjenv.gym.env import Environment
    from mjenv.gym.vector import VectorEnv
    from mjenv.randomization import Delay, Noise, Offset, Push, Same, Scale, Value
    from mjenv.registration import engine, engines, ids, load_tasks, model_xml, options, register, spec, version
    from mjenv.rows.arguments import AutoresetMode
    from mjenv.task import Task

# The modules with the names that the package has from each of them. A module is imported when one of its names, or the
# module itself, is first used. So `mjenv train`, which needs neither NumPy nor Gymnasium, starts without them.
_NAMES = {
    "capi.declarations": "Kind Status",
    "capi.schema": "EngineInfo Option",
    "gym.env": "Environment",
    "gym.make": "make",
    "gym.make_vec": "make_vec",
    "gym.vector": "VectorEnv",
    "rows.arguments": "AutoresetMode",
    "errors": "AlreadyPendingCallError BusyError ClosedError EngineError Error ForkedError InternalError "
    "InvalidValueError ModelError ModelFileError NoAsyncCallError OptionError OutOfMemoryError PhysicsError "
    "RenderError RenderSettingError ResetNeeded SnapshotError TaskError UnknownIdError UnknownNameError",
    "randomization": "Delay Noise Offset Push Same Scale Value",
    "registration": "engine engines ids load_tasks model_xml options register spec version",
    "task": "Task",
}
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = [
    "AlreadyPendingCallError",
    "AutoresetMode",
    "BusyError",
    "ClosedError",
    "Delay",
    "EngineError",
    "EngineInfo",
    "Environment",
    "Error",
    "ForkedError",
    "InternalError",
    "InvalidValueError",
    "Kind",
    "ModelError",
    "ModelFileError",
    "NoAsyncCallError",
    "Noise",
    "Offset",
    "Option",
    "OptionError",
    "OutOfMemoryError",
    "PhysicsError",
    "Push",
    "RenderError",
    "RenderSettingError",
    "ResetNeeded",
    "Same",
    "Scale",
    "SnapshotError",
    "Status",
    "Task",
    "TaskError",
    "UnknownIdError",
    "UnknownNameError",
    "Value",
    "VectorEnv",
    "engine",
    "engines",
    "ids",
    "load_tasks",
    "make",
    "make_vec",
    "model_xml",
    "options",
    "register",
    "spec",
    "version",
]


if not TYPE_CHECKING:  # with this function, type checkers would accept every name

    def __getattr__(name: str) -> Any:
        if name in _MODULES:
            value = getattr(importlib.import_module(f"mjenv.{_MODULES[name]}"), name)
            globals()[name] = value  # so that only the first use calls this function
            return value
        if name in _NAMES:
            return importlib.import_module(f"mjenv.{name}")
        if name.startswith("__"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return value_of(name)  # of a program beside this package


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_NAMES})


ENGINES.get()  # a library that cannot be loaded is an error of the import
follow_gymnasium()
