"""make, and the functions that describe ids and engines."""

from __future__ import annotations

import copy
import math
import os
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec

from mjenv import _handle
from mjenv._abi import Status
from mjenv._engine import ENGINES, Engine
from mjenv._numpy_rows import NumpyRows
from mjenv._pictures import RENDER_MODES
from mjenv._registered import Registered
from mjenv._schema import EngineInfo, Option
from mjenv.env import MujocoEnv
from mjenv.errors import EngineError, InvalidValueError, OptionError
from mjenv.task import Task

NAMESPACE = "mjenv"
SUITE = "dm_control/"  # how the ids of dm_control's suite begin
UNLISTED = "Model-v0"  # an id that ids() leaves out, because it needs the option xml_file or xml_string
# Where make_vec has another default than the library.
VECTOR_DEFAULTS: dict[str, Any] = {"num_threads": 0, "autoreset_mode": "next_step"}


def engines(usable: bool = True) -> tuple[str, ...]:
    """The names of the engines that can be used here: "2.2.2", and "4.0" if MuJoCo 4.0 is installed.

    An engine's name is the version of MuJoCo with which it computes. usable=False also returns engines that cannot be
    used here, for example because a library is missing. This function loads the engines.
    """
    return tuple(name for name in ENGINES.names() if not usable or _is_usable(name))


def _is_usable(engine: str) -> bool:
    try:
        ENGINES.get(engine)
    except EngineError:
        return False
    return True


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
    return _handle.ids(ENGINES.get(engine))


def options(id: str, engine: str | None = None) -> dict[str, Option]:
    """The constructor options of an id by name: first Gymnasium's, in its order, then those that only mjenv has."""
    schema = _handle.Options(ENGINES.get(engine), _own(id)).schema()
    return schema | {name: replace(schema[name], vector_default=value) for name, value in VECTOR_DEFAULTS.items()}


def spec(id: str, engine: str | None = None) -> EnvSpec:
    """The EnvSpec of gymnasium.spec(id), with this package's entry points.

    Environments that are made from the spec use the engine, if one is given.
    """
    id = _own(id)
    found = _handle.spec_of(ENGINES.get(engine), id)
    return EnvSpec(
        id=id,
        entry_point=f"mjenv.entry_points:{id}",
        reward_threshold=None if math.isnan(found.reward_threshold) else found.reward_threshold,
        max_episode_steps=found.max_episode_steps or None,
        vector_entry_point=f"mjenv.entry_points:{id}/vector",
        kwargs={} if engine is None else {"engine": engine},
    )


def model_xml(id: str, engine: str | None = None) -> str:
    """The text (MJCF) of an id's default model, from which you can make your own."""
    id = _own(id)
    text = _handle.spec_of(ENGINES.get(engine), id).model_xml
    if text is not None:
        return str(text.decode())
    file = options(id, engine)["xml_file"].default
    if not file:
        raise InvalidValueError(f"{id} has no default model: its options xml_file and xml_string choose one")
    return Path(file).expanduser().read_text()


def load_tasks(path: str | os.PathLike[str] | None = None) -> None:
    """Loads a plug-in, a shared object with tasks of your own. Its ids then work like the built-in ones, on every
    engine: in make, make_vec and the other functions, and as "mjenv/ID" in Gymnasium's.

    Tasks stay loaded until the process ends, and loading a plug-in again does nothing. A child process that was not
    forked does not have the tasks: call this function there, too, or list the plug-ins in the environment variable
    MJENV_TASKS, separated by ":". path=None loads the plug-ins in this variable, and raises an error if one of them
    cannot be loaded.
    """
    if path is None:
        file = None
    else:
        if not isinstance(path, (str, os.PathLike)):
            raise OptionError(f"a plug-in is given by the path of its file, not {path!r}", Status.E_TYPE)
        # An absolute path, because engines that are loaded later load the plug-in then.
        file = _handle.encoded(os.path.abspath(os.fspath(path)), "the path of a plug-in")
    ENGINES.register(lambda engine: engine.check(engine.mjenv_load_tasks(file)))
    register_ids()


def spec_asked(id: str | EnvSpec, engine: str | None) -> EnvSpec:
    """The spec for the arguments of make and make_vec."""
    return id if isinstance(id, EnvSpec) else spec(id, engine)


def _own(id: Any) -> str:
    """The library's name of an id: "Ant-v5" for Gymnasium's "mjenv/Ant-v5"."""
    if not isinstance(id, str):
        hint = "; this is an environment, and make needs its id" if hasattr(id, "step") else ""
        raise OptionError(f"the id is a str, 'Ant-v5' for example, or an EnvSpec, not {id!r}{hint}", Status.E_TYPE)
    return id.removeprefix(f"{NAMESPACE}/")


def register(id: str, task: type[Task]) -> None:
    """Gives a task an id, "Reach-v0" for example, until the process ends.

    mjenv's functions know the id on every engine, and Gymnasium's functions know it as "mjenv/Reach-v0".

    A child process that was not forked has to import the module that calls this function.
    """
    if not isinstance(task, type) or not issubclass(task, Task):
        raise OptionError(f"a task is a class derived from mjenv.Task, not {task!r}", Status.E_TYPE)
    registered = Registered(id, task)

    def registration(engine: Engine) -> None:
        registered.register(engine)
        _handle.OPENERS[id] = registered.open if registered.is_code else partial(NumpyRows, registered)

    ENGINES.register(registration)
    register_ids()


def register_ids() -> None:
    """Makes gymnasium.make("mjenv/Ant-v5"), gymnasium.make_vec and gymnasium.spec know all ids. An id that has a
    namespace of its own, such as "lab/Reach-v0", keeps it. mjenv.dm_control registers those of dm_control's suite."""
    for id in (*ids(), UNLISTED):
        if id.startswith(SUITE):
            continue
        name = id if "/" in id else f"{NAMESPACE}/{id}"
        if name in gymnasium.registry:
            continue
        found = spec(id)
        gymnasium.register(
            name,
            found.entry_point,
            found.reward_threshold,
            max_episode_steps=found.max_episode_steps,
            vector_entry_point=found.vector_entry_point,
        )


def make(
    id: str | EnvSpec,
    max_episode_steps: int | None = None,
    disable_env_checker: bool | None = None,
    **options: Any,
) -> MujocoEnv:
    """Builds an environment as gymnasium.make does, with the same keywords.

    id: one of ids(), or an EnvSpec. max_episode_steps: None for the id's own limit, -1 for none. disable_env_checker:
    has no effect, because there is no checking wrapper. options: see options(id), and Gymnasium's keywords for
    rendering; with "rgb_array_list" and the like the environment comes inside Gymnasium's wrapper RenderCollection.
    render_fast=True draws without multisampling and shadows. engine="4.0" computes with MuJoCo 4.0; see engines().
    randomize, noise, delay and push: draws at resets and in steps, for instance {"body_mass": mjenv.Scale(0.5, 1.5)}.
    """
    asked = spec_asked(id, options.get("engine"))
    chosen = {**copy.deepcopy(asked.kwargs), **options}
    own = spec(asked.id, chosen.get("engine"))
    limit = asked.max_episode_steps if max_episode_steps is None else max_episode_steps
    mode = chosen.get("render_mode")
    single = mode.removesuffix("_list") if isinstance(mode, str) else mode
    listed = single != mode and single in RENDER_MODES
    given = {**chosen, "render_mode": single} if listed else chosen
    env = MujocoEnv(own.id, -1 if limit is None else limit, **given)
    own.max_episode_steps = None if limit == -1 else limit
    own.disable_env_checker = asked.disable_env_checker if disable_env_checker is None else disable_env_checker
    own.kwargs = given
    env.spec = own
    if listed:
        return gymnasium.wrappers.RenderCollection(env)  # type: ignore[return-value]
    return env
