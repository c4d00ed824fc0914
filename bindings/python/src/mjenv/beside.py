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
    found: dict[str, str] = {}
    for program in programs:
        spec = find_spec(program)  # without importing the program
        if any(one.name == "beside" for one in pkgutil.iter_modules((spec and spec.submodule_search_locations) or ())):
            found |= getattr(import_module(f"{program}.beside"), kind, {})
    return found


def value_of(name: str) -> Any:
    """What a program has by this name. Raises AttributeError if none has it."""
    if name not in listed("NAMES"):
        raise AttributeError(f"module 'mjenv' has no attribute {name!r}")
    return getattr(import_module(listed("NAMES")[name]), name)
