"""The entry points of EnvSpecs, two for each id: "Ant-v5" for gymnasium.make, "Ant-v5/vector" for make_vec."""

import functools
from collections.abc import Callable
from typing import Any

from mjenv.env import MujocoEnv
from mjenv.errors import UnknownIdError
from mjenv.registration import spec
from mjenv.vector import VectorEnv


def __getattr__(name: str) -> Callable[..., Any]:
    id = name.removesuffix("/vector")
    try:
        spec(id)
    except UnknownIdError as error:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}: {error}") from None
    if name != id:
        return functools.partial(VectorEnv, id)
    # Without a limit: gymnasium.make adds its own.
    creator = functools.partial(MujocoEnv, id, -1)
    # By these, gymnasium.make adds wrappers for other render modes.
    creator.metadata = MujocoEnv.metadata  # type: ignore[attr-defined]
    return creator
