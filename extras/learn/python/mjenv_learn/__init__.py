"""Trains policies by PPO without PyTorch, and plays them: train("HalfCheetah-v5").

Imports the modules when they are first used, because `mjenv train` needs neither NumPy nor Gymnasium.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mjenv_learn.policy import Policy
    from mjenv_learn.training import evaluate, train

__all__ = ["Policy", "evaluate", "train"]


if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module("mjenv_learn.policy" if name == "Policy" else "mjenv_learn.training"), name)
