"""Finds the programs beside the wrapper: the packages mjenv_NAME that are installed, such as a viewer.

The wrapper names none of them. A program whose package has a module `beside` adds to mjenv what that module lists:
NAMES, which mjenv then has, too, and COMMANDS of the command line, each with the module that has it.
"""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any


@cache
def listed(kind: str) -> dict[str, str]:
    """All names of a kind, NAMES or COMMANDS, with their modules."""
    programs = sorted(found.name for found in pkgutil.iter_modules() if found.ispkg and found.name.startswith("mjenv_"))
    lists = [import_module(f"{program}.beside") for program in programs if _has_list(program)]
    return {name: module for found in lists for name, module in getattr(found, kind, {}).items()}


def _has_list(program: str) -> bool:
    """Without importing the program."""
    spec = find_spec(program)
    folders = spec.submodule_search_locations if spec else None
    return any(found.name == "beside" for found in pkgutil.iter_modules(folders))


def value_of(name: str) -> Any:
    """What a program has by this name. Raises AttributeError if none has it."""
    if name not in listed("NAMES"):
        raise AttributeError(f"module 'mjenv' has no attribute {name!r}")
    return getattr(import_module(listed("NAMES")[name]), name)
