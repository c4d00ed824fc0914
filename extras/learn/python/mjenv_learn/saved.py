"""The folder of a training: its files, its lock, and the description with which the training continues."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, is_dataclass
from pathlib import Path
from typing import IO, Any, TypeVar

from mjenv import errors
from mjenv.capi.declarations import Status
from mjenv_learn.learner import note_of

if sys.platform != "win32":
    import fcntl

CHECKPOINT, CURVE, PICTURE, POLICY, DESCRIPTION = "checkpoint", "curve.csv", "curve.svg", "policy.txt", "training.json"
LOCK = "lock"
# Options that say which model is read, and how far it is trusted.
MODEL_OPTIONS = ("xml_file", "xml_string", "trust_xml")
# Options that change no episode. A policy does not keep those of its training.
RUNNING = ("arrays", "autoreset_mode", "cpu_affinity", "lanes", "num_threads")

T = TypeVar("T")


@dataclass(frozen=True)
class Stage:
    """A part of a training: a number of steps, and the options of the environments in it. until: the mean return with
    which it ends early; its steps then belong to the next part."""

    steps: int
    options: Mapping[str, Any] = field(default_factory=dict)
    until: float | None = None

    @classmethod
    def of(cls, given: Any) -> Stage:
        """From JSON. Raises TypeError if this is none."""
        stage = cls(**_checked(dict, given))
        _checked(int, stage.steps), _checked(dict, stage.options), _checked((int, float, type(None)), stage.until)
        return stage


@dataclass(frozen=True)
class Description:
    """What a training needs to continue, besides the state in its checkpoint, which contains this as its note.

    tasks: the files of tasks that the process had loaded. options: those of make_vec in all stages, the engine among
    them. stage: the present one. changed: the options that Training.set_options has changed in it. settings: the values
    of a Settings.
    """

    id: str
    seed: int
    tasks: list[str]
    options: dict[str, Any]
    stages: list[Stage]
    stage: int
    changed: dict[str, Any]
    settings: dict[str, Any]

    def text(self) -> str:
        return json.dumps(asdict(self), indent=2, default=plain) + "\n"

    @classmethod
    def read(cls, folder: Path) -> Description:
        """Reads it from the checkpoint, because training.json can be older. Anyone can have written it."""
        file = folder / CHECKPOINT
        try:
            found = json.loads(note_of(file))
            return cls(
                id=_checked(str, found["id"]),
                seed=_checked(int, found["seed"]),
                tasks=[_checked(str, task) for task in _checked(list, found["tasks"])],
                options=_checked(dict, found["options"]),
                stages=[Stage.of(one) for one in found["stages"]],
                stage=max(0, _checked(int, found["stage"])),
                changed=_checked(dict, found["changed"]),
                settings=_checked(dict, found["settings"]),
            )
        except errors.Error:
            raise
        except (KeyError, RecursionError, TypeError, ValueError) as error:
            raise errors.InvalidValueError(f"{file} describes no training: {type(error).__name__}: {error}") from None

    def present_options(self) -> dict[str, Any]:
        """The options of the environments in the present stage."""
        stage = self.stages[self.stage].options if self.stage < len(self.stages) else {}
        return {**self.options, **stage, **self.changed}


def without_trust(options: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a checkpoint. A model that only they name is read as that of a stranger, who may have written
    them."""
    return {**options, **({"trust_xml": "no"} if any(name in options for name in MODEL_OPTIONS) else {})}


def stages_of(path: Path) -> list[Stage]:
    """The stages in a file: JSON as that of training.json's "stages"."""
    try:
        return [Stage.of(one) for one in _checked(list, json.loads(path.read_bytes()))]
    except (RecursionError, TypeError, ValueError) as error:
        raise errors.InvalidValueError(f"{path} is no list of stages: {error}") from None


def _checked(kind: Any, value: T) -> T:
    if not isinstance(value, kind) or isinstance(value, bool):  # to Python, true and false are integers
        raise TypeError(f"{value!r} is no {getattr(kind, '__name__', 'number')}")
    return value


def plain(value: Any) -> Any:
    """An option as JSON has it. All options can be given like this, too."""
    if is_dataclass(value) and not isinstance(value, type):  # of randomize, noise, delay and push
        return asdict(value)
    if isinstance(value, os.PathLike):
        return os.path.abspath(os.fspath(value))
    if hasattr(value, "tolist"):  # NumPy's
        return value.tolist()
    raise errors.OptionError(f"a training with a folder keeps its options there, and cannot keep {value!r}")


def replace(path: Path, text: str) -> None:
    """Replaces a file in one operation, so that no reader finds a part of it, even after a power cut."""
    if path.exists() and not path.is_file():
        raise FileExistsError(f"{path} is no regular file")
    partial = path.with_name(f"{path.name}.partial")
    partial.unlink(missing_ok=True)
    with partial.open("x", encoding="utf-8", newline="") as file:  # "x" follows no link
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.replace(partial, path)


def clear(folder: Path, overwrite: bool) -> None:
    """Makes room for a new training. Raises InvalidValueError if the folder holds one that is not to be overwritten."""
    if not overwrite and any((folder / name).exists() for name in (CHECKPOINT, POLICY)):
        raise errors.InvalidValueError(
            f"{folder} holds a training: resume it, overwrite it, or choose another folder", Status.E_VALUE
        )
    for name in (CHECKPOINT, POLICY, CURVE, PICTURE, DESCRIPTION):
        (folder / name).unlink(missing_ok=True)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keeps other trainings out of the folder. The lock ends with the process, also if the process is killed."""
    path = folder / LOCK
    file = _lock(path)
    if file is None:
        raise errors.BusyError(f"another training runs in {folder}: {path} is locked", Status.E_BUSY)
    try:
        yield
    finally:
        if sys.platform != "win32":
            path.unlink(missing_ok=True)
        file.close()


def _lock(path: Path) -> IO[str] | None:
    """Locks a file, which is made if it is missing. None: another holds the lock."""
    if sys.platform == "win32":  # a file of which there is only one, and which is removed with its last handle
        try:
            return open(path, "x", opener=lambda name, flags: os.open(name, flags | os.O_TEMPORARY))
        except (FileExistsError, PermissionError):
            return None
    while True:
        # Neither follows a link nor waits for the reader of a pipe.
        file = os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666), "w")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.close()
            return None
        except OSError:  # a file system without locks
            return file
        if _is_at(file, path):  # not if the last holder has removed it since it was opened
            return file
        file.close()


def _is_at(file: IO[str], path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(file.fileno()), os.stat(path))
    except FileNotFoundError:
        return False
