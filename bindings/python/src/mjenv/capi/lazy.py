"""Modules that are imported when they are first used.

Importing NumPy and Gymnasium takes longer than all else that `mjenv train` does before its first update. The modules
that run before it therefore get NumPy, Gymnasium and the modules of mjenv that import one of them from the function
`lazy`. One of these is mjenv.errors, whose exceptions are derived from Gymnasium's. Python 3.15 has a statement for the
same purpose, `lazy import`.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any


class _Lazy(ModuleType):
    """Stands for the module of its name."""

    def __getattr__(self, name: str) -> Any:
        value = getattr(import_module(self.__name__), name)
        setattr(self, name, value)  # so that only the first use of a name calls this method
        return value


def lazy(name: str) -> Any:
    """The module of this name, which is imported when an attribute of it is first used."""
    return _Lazy(name)
