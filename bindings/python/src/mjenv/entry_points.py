"""One attribute an id, for EnvSpec.entry_point: gymnasium.make(mjenv.spec("Ant-v5")) looks "Ant-v5" up here."""

from collections.abc import Callable

from mjenv.env import MujocoEnv
from mjenv.registration import creator, ids


def __getattr__(name: str) -> Callable[..., MujocoEnv]:
    if name not in ids():
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return creator(name)
