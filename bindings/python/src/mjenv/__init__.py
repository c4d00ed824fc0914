"""Gymnasium's MuJoCo environments, bit for bit, from a native library.

make("Ant-v5") gives a gymnasium.Env, make_vec("Ant-v5", 64) a gymnasium.vector.VectorEnv. ids(), spec(id), options(id)
and model_xml(id) describe the environments. load_tasks("libmy_robots.so") adds your own robots and tasks. Importing
mjenv registers all ids with Gymnasium, as mjenv/Ant-v5 and so on.

make("Ant-v5", engine="4.0") computes with MuJoCo 4.0 instead of 2.2.2. engines() lists the engines.
"""

from typing import TYPE_CHECKING

from mjenv import _requirements as _requirements  # first: with too old a Gymnasium, other modules fail
from mjenv._abi import Kind, Status
from mjenv._arguments import AutoresetMode
from mjenv._schema import EngineInfo, Option
from mjenv.env import MujocoEnv
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
from mjenv.randomization import Delay, Noise, Offset, Push, Same, Scale, Value
from mjenv.registration import (
    engine,
    engines,
    ids,
    load_tasks,
    model_xml,
    options,
    register,
    register_ids,
    spec,
    version,
)
from mjenv.task import Task
from mjenv.training import evaluate, train
from mjenv.vector import VectorEnv
from mjenv.viewer import view

if TYPE_CHECKING:
    from mjenv._overloads import make, make_vec  # the same functions, with the keywords of each id
else:
    from mjenv._make_vec import make_vec
    from mjenv.registration import make

__all__ = [
    "AlreadyPendingCallError",
    "AutoresetMode",
    "BusyError",
    "ClosedError",
    "Delay",
    "EngineError",
    "EngineInfo",
    "Error",
    "ForkedError",
    "InternalError",
    "InvalidValueError",
    "Kind",
    "ModelError",
    "ModelFileError",
    "MujocoEnv",
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
    "evaluate",
    "ids",
    "load_tasks",
    "make",
    "make_vec",
    "model_xml",
    "options",
    "register",
    "spec",
    "train",
    "version",
    "view",
]

register_ids()
