"""Modules that are imported when they are first used.

Importing NumPy and Gymnasium takes longer than everything else that `mjenv train` does before its first update. What
runs before that update therefore imports them, and what needs them, by this function. So does `lazy import`, which
Python has from version 3.15 on.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any


class _Lazy(ModuleType):
    """Stands for the module of its name."""

    def __getattr__(self, name: str) -> Any:
        value = getattr(import_module(self.__name__), name)
        setattr(self, name, value)  # so that only the first use of a name takes this way
        return value


def lazy(name: str) -> Any:
    """The module of this name, which is imported when an attribute of it is first used."""
    return _Lazy(name)
