"""The entry points of EnvSpecs, two for each id: "Ant-v5" for gymnasium.make, "Ant-v5/vector" for make_vec."""

import functools
from collections.abc import Callable
from typing import Any

from mjenv.errors import UnknownIdError
from mjenv.gym.env import Environment
from mjenv.gym.vector import VectorEnv
from mjenv.registration import spec


def _single(id: str, **options: Any) -> Environment:
    """Without a limit of steps, because gymnasium.make adds its own, but does not say which. The time that the option
    time_aware adds needs one: the id's own, unless options has another."""
    limit = None if options.get("time_aware") else -1
    return Environment(id, **{"max_episode_steps": limit, **options})


def __getattr__(name: str) -> Callable[..., Any]:
    id = name.removesuffix("/vector")
    try:
        spec(id)
    except UnknownIdError as error:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}: {error}") from None
    if name != id:
        return functools.partial(VectorEnv, id)
    creator = functools.partial(_single, id)
    # By these, gymnasium.make adds wrappers for other render modes.
    creator.metadata = Environment.metadata  # type: ignore[attr-defined]
    return creator
