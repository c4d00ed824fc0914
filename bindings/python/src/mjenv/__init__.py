"""Gymnasium's MuJoCo environments, bit for bit, from a native library.

make("Ant-v5") gives a gymnasium.Env, make_vec("Ant-v5", 64) a gymnasium.vector.VectorEnv. ids(), spec(id), options(id)
and model_xml(id) describe the environments. load_tasks("libmy_robots.so") adds your own robots and tasks. Gymnasium
knows all ids as mjenv/Ant-v5 and so on.

make("Ant-v5", engine="4.0") computes with MuJoCo 4.0 instead of 2.2.2. engines() lists the engines.
"""

from typing import TYPE_CHECKING, Any

from mjenv import errors as errors  # which checks Gymnasium's version

# isort: split
from mjenv._overloads import make, make_vec
from mjenv.beside import value_of
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
from mjenv.gym.namespace import register_ids
from mjenv.gym.vector import VectorEnv
from mjenv.randomization import Delay, Noise, Offset, Push, Same, Scale, Value
from mjenv.registration import engine, engines, ids, load_tasks, model_xml, options, register, spec, version
from mjenv.rows.arguments import AutoresetMode
from mjenv.task import Task

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
        """What programs beside this package add."""
        if name.startswith("__"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return value_of(name)


register_ids()
