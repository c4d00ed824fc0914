"""The functions that describe ids and engines, and those that make more ids known."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from dataclasses import replace
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from gymnasium.envs.registration import EnvSpec

from mjenv import errors
from mjenv.beside import listed, value_of
from mjenv.capi import handle
from mjenv.capi.declarations import Status
from mjenv.capi.engine import ENGINES, Engine
from mjenv.capi.schema import EngineInfo, Option
from mjenv.gym import namespace
from mjenv.task import Task
from mjenv.task.registered import Registered, is_code

_TASKS: dict[str, None] = {}  # the files that load_tasks has loaded, in their order

# Where make_vec has another default than the library.
VECTOR_DEFAULTS: dict[str, Any] = {"num_threads": 0, "autoreset_mode": "next_step"}


def engines(usable: bool = True) -> tuple[str, ...]:
    """The names of the engines that can be used here: "2.2.2", and "4.0" if MuJoCo 4.0 is installed.

    An engine's name is the version of MuJoCo with which it computes. usable=False also returns engines that cannot be
    used here, for example because a library is missing. This function loads the engines.
    """

    def is_usable(name: str) -> bool:
        with suppress(errors.EngineError):
            return bool(ENGINES.get(name))
        return False

    return tuple(name for name in ENGINES.names() if not usable or is_usable(name))


# Here and in the other functions, engine is one of engines(). None is the default, which the environment variable
# MJENV_ENGINE names.


def engine(name: str | None = None) -> EngineInfo:
    """An engine, the default one for None. Raises EngineError, which says what to install, if it cannot be used."""
    found = ENGINES.get(name)
    return EngineInfo(found.name, found.version(), found.path, found.math, found.arch)


def version(engine: str | None = None) -> str:
    """The library's version and the MuJoCo version whose bits it reproduces."""
    return ENGINES.get(engine).version()


def ids(engine: str | None = None) -> tuple[str, ...]:
    """The environment ids, sorted: those of the built-in robots and of the loaded tasks.

    The list does not contain "Model-v0", which steps the model of the option xml_file or xml_string without a task.
    """
    return handle.ids(ENGINES.get(engine))


def options(id: str, engine: str | None = None) -> dict[str, Option]:
    """The constructor options of an id by name: first Gymnasium's, in its order, then those that only mjenv has."""
    schema = handle.Options(ENGINES.get(engine), own_id(id)).schema()
    return schema | {name: replace(schema[name], vector_default=value) for name, value in VECTOR_DEFAULTS.items()}


def spec(id: str, engine: str | None = None) -> EnvSpec:
    """The EnvSpec of gymnasium.spec(id), with this package's entry points.

    Environments that are made from the spec use the engine, if one is given.
    """
    id = own_id(id)
    description = namespace.description(ENGINES.get(engine), id)
    return EnvSpec(id=id, **description, kwargs={} if engine is None else {"engine": engine})


def model_xml(id: str, engine: str | None = None) -> str:
    """The text (MJCF) of an id's default model, from which you can make your own."""
    id = own_id(id)
    text = handle.spec_of(ENGINES.get(engine), id).model_xml
    if text is not None:
        return str(text.decode())
    file = options(id, engine)["xml_file"].default
    if not file:
        raise errors.InvalidValueError(f"{id} has no default model: its options xml_file and xml_string choose one")
    return Path(file).expanduser().read_text()


def load_tasks(path: str | os.PathLike[str] | None = None) -> None:
    """Loads tasks of your own: a plug-in, which is a shared object, or a Python file (.py) that calls mjenv.register.

    Their ids then work like the built-in ones, on every engine: in make, make_vec and the other functions, and as
    "mjenv/ID" in Gymnasium's.

    Tasks stay loaded until the process ends, and loading a file again does nothing. A child process that was not forked
    does not have the tasks: call this function there, too, or list the plug-ins in the environment variable
    MJENV_TASKS, separated by ":". path=None loads the plug-ins in this variable, and raises an error if one of them
    cannot be loaded.
    """
    if path is None:
        _load_plugin(None)
        return
    if not isinstance(path, (str, os.PathLike)):
        raise errors.OptionError(f"tasks are given by the path of their file, not {path!r}", Status.E_TYPE)
    # An absolute path, because engines that are loaded later load the plug-in then.
    file = os.path.abspath(os.fspath(path))
    encoded = handle.encoded(file, "the path of tasks")
    if not file.endswith(".py"):
        _load_plugin(encoded)
    elif file not in _TASKS:
        _import(Path(file))
    _TASKS[file] = None


def _load_plugin(file: bytes | None) -> None:
    ENGINES.register(lambda engine: engine.check(engine.mjenv_load_tasks(file)))
    namespace.register_ids()


def _import(file: Path) -> None:
    spec = spec_from_file_location(file.stem, file)
    assert spec
    assert spec.loader
    module = module_from_spec(spec)
    sys.modules[file.stem] = module  # so that objects of its classes can be pickled
    sys.path.insert(0, str(file.parent))  # so that it can import modules of its folder
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # a stranger's module can raise anything
        raise errors.TaskError(f"{file} cannot be imported: {type(error).__name__}: {error}") from error


def loaded_tasks() -> list[str]:
    """The files of tasks that this process has loaded, without those in MJENV_TASKS."""
    return [*_TASKS]


def own_id(id: Any) -> str:
    """The library's name of an id: "Ant-v5" for Gymnasium's "mjenv/Ant-v5"."""
    if not isinstance(id, str):
        hint = "; this is an environment, and make needs its id" if hasattr(id, "step") else ""
        raise errors.OptionError(
            f"the id is a str, 'Ant-v5' for example, or an EnvSpec, not {id!r}{hint}", Status.E_TYPE
        )
    return id.removeprefix(f"{namespace.NAMESPACE}/")


def register(id: str, task: type[Task]) -> None:
    """Gives a task an id, "Reach-v0" for example, until the process ends.

    mjenv's functions know the id on every engine, and Gymnasium's functions know it as "mjenv/Reach-v0".

    A child process that was not forked has to import the module that calls this function.
    """
    if not isinstance(task, type) or not issubclass(task, Task):
        raise errors.OptionError(f"a task is a class derived from mjenv.Task, not {task!r}", Status.E_TYPE)
    if is_code(task):
        registered = Registered(id, task)
    elif "NumpyRegistered" in listed("NAMES"):
        registered = value_of("NumpyRegistered")(id, task)
    else:
        raise errors.OptionError(
            f"{task.__name__} has no machine code, and the program that computes NumPy tasks is not installed: "
            "install mjenv with the programs of its folder extras",
            Status.E_TYPE,
        )

    def registration(engine: Engine) -> None:
        registered.register(engine)
        handle.OPENERS[id] = registered.open

    ENGINES.register(registration)
    namespace.register_ids()
