"""The exceptions. Each is a mjenv.Error, and also the exception that a user of Python or Gymnasium expects.

Error.status is the library's status code. The message says what is wrong and what is valid.
"""

from __future__ import annotations

from typing import Any

import gymnasium

from mjenv.capi.declarations import Status

_FOUND = gymnasium.__version__
if int(_FOUND.split(".")[0]) < 1:  # from whose classes those of mjenv cannot be derived
    raise ImportError(f'mjenv needs Gymnasium 1.0 or newer, not {_FOUND}: pip install "gymnasium>=1.0"')


class Error(gymnasium.error.Error):
    """Base class of all exceptions of mjenv.

    results: if some rows failed and others were stepped, what VectorEnv.step or recv would have returned; else None.
    """

    results: tuple[Any, ...] | None = None

    def __init__(self, message: str, status: int = Status.E_ARGUMENT) -> None:
        Exception.__init__(self, message)  # some of Gymnasium's classes ask for more
        self.message: str = message
        self.status: Status = Status(status)

    def __str__(self) -> str:
        return self.message

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.message, self.status), {"results": self.results}


class EngineError(Error, ImportError):
    """No engine has this name, or its library or MuJoCo's cannot be loaded; the message says what to install."""

    def __init__(self, message: str, status: int = Status.E_FILE) -> None:
        super().__init__(message, status)


class UnknownIdError(Error, gymnasium.error.UnregisteredEnv):
    """No environment has this id."""


class OptionError(Error, TypeError):
    """The id has no such option, or the option takes values of another type."""


class InvalidValueError(Error, ValueError):
    """A value is out of range, or an action has another shape or holds a number that is not finite."""


class UnknownNameError(Error, KeyError, IndexError):
    """No object or array of the model has this name or index."""


class ResetNeeded(Error, gymnasium.error.ResetNeeded):  # noqa: N818 as Gymnasium's
    """A step before the first reset, or after the end of the episode."""


class AlreadyPendingCallError(Error, gymnasium.error.AlreadyPendingCallError):
    """Rows are under way between send and recv."""

    name = "send"


class NoAsyncCallError(Error, gymnasium.error.NoAsyncCallError):
    """A recv without a send."""

    name = "recv"


class ForkedError(Error, RuntimeError):
    """The environment was made before a fork, and its threads do not exist in this process."""


class BusyError(Error, RuntimeError):
    """Another thread is inside this environment, or another training runs in this folder."""


class ModelError(Error, ValueError):
    """A model that is malformed or lacks what the task needs."""


class ModelFileError(ModelError, FileNotFoundError):
    """A model file that is missing or cannot be read."""


class PhysicsError(Error, RuntimeError):
    """MuJoCo reported an error."""


class SnapshotError(Error, ValueError):
    """An image that is damaged or belongs to another environment."""


class OutOfMemoryError(Error, MemoryError):
    """There is not enough memory."""


class InternalError(Error, RuntimeError):
    """A defect of the library; please report it."""


class RenderError(Error, RuntimeError):
    """There is no OpenGL to draw with, or it failed; the message names what to install."""


class TaskError(Error, RuntimeError):
    """A callback of a registered task failed, or a plug-in holds no tasks."""


class RenderSettingError(Error, AttributeError):
    """render() was called without a render_mode, or default_camera_config has an unknown key."""


class ClosedError(Error, gymnasium.error.ClosedEnvironmentError):
    """The environment was closed."""


_BY_STATUS: dict[int, type[Error]] = {
    Status.E_ARGUMENT: InvalidValueError,
    Status.E_NAME: UnknownNameError,
    Status.E_TYPE: OptionError,
    Status.E_VALUE: InvalidValueError,
    Status.E_SIZE: InvalidValueError,
    Status.E_NOT_RESET: ResetNeeded,
    Status.E_EPISODE_ENDED: ResetNeeded,
    Status.E_PENDING: AlreadyPendingCallError,
    Status.E_NOT_PENDING: NoAsyncCallError,
    Status.E_BUSY: BusyError,
    Status.E_FORKED: ForkedError,
    Status.E_FILE: ModelFileError,
    Status.E_MODEL: ModelError,
    Status.E_PHYSICS: PhysicsError,
    Status.E_SNAPSHOT: SnapshotError,
    Status.E_MEMORY: OutOfMemoryError,
    Status.E_INTERNAL: InternalError,
    Status.E_RENDER: RenderError,
    Status.E_TASK: TaskError,
}


def error_of(status: int, message: str, *, names_id: bool = False) -> Error:
    """The exception for a call that failed. names_id: MJENV_E_NAME means that there is no such id."""
    kind = UnknownIdError if names_id and status == Status.E_NAME else _BY_STATUS[status]
    return kind(message, status)
