#!/usr/bin/env python3
"""Writes make and make_vec with the keywords of each id, which the library lists, for type checkers and editors.

    keywords.py FILE

The build of the Python package writes them as mjenv/_overloads.pyi. MJENV_LIBRARY names the library.
"""

from __future__ import annotations

import ctypes
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

# The package without its __init__.py, which imports NumPy and Gymnasium: a build needs neither.
package = sys.modules["mjenv"] = ModuleType("mjenv")
package.__path__ = [str(Path(__file__).parents[1] / "bindings/python/src/mjenv")]

from mjenv.capi.declarations import Kind, Library, mjenv_option  # noqa: E402

# Only the ids of the library itself.
os.environ.pop("MJENV_TASKS", None)
LIBRARY = Library(os.environ["MJENV_LIBRARY"])
UNLISTED = b"Model-v0"

# Keywords that make or make_vec name themselves.
NAMED = ("max_episode_steps", "num_threads", "autoreset_mode")

HEAD = '''\
"""make and make_vec with the keywords of each id."""

from collections.abc import Sequence
from os import PathLike
from typing import Any, Literal, TypedDict, overload

from gymnasium.envs.registration import EnvSpec
from numpy.typing import DTypeLike
from typing_extensions import Unpack

from mjenv.capi.keywords import Randomizing, Rendering
from mjenv.gym.env import Environment
from mjenv.gym.vector import VectorEnv
from mjenv.rows.arguments import AutoresetMode

class Vector(TypedDict, total=False):
    max_episode_steps: int | None
    num_threads: int
    autoreset_mode: AutoresetMode | str
    dtype: DTypeLike
    copy: bool

class Common(Rendering, Randomizing, total=False):
    engine: str | None
    disable_env_checker: bool | None
'''


def options_of(id: bytes) -> Iterator[tuple[str, Any]]:
    """The options of an id: their names, and the library's descriptions, each until the next is asked for."""
    options, option = ctypes.c_void_p(), mjenv_option(ctypes.sizeof(mjenv_option))
    assert not LIBRARY.mjenv_options_create(id, options), LIBRARY.mjenv_last_error()
    for i in range(LIBRARY.mjenv_options_count(options)):
        assert not LIBRARY.mjenv_options_at(options, i, option), LIBRARY.mjenv_last_error()
        yield option.name.decode(), option
    LIBRARY.mjenv_options_destroy(options)


def type_of(name: str, option: Any) -> str:
    if option.kind == Kind.REALS:
        return "float" if option.count == 1 else "Sequence[float]"
    if option.choices:
        choices = ", ".join(f'"{choice}"' for choice in option.choices.decode().split())
        return f"Literal[{choices}]" + (" | int" if option.kind == Kind.STRING_OR_INT else "")
    if name == "xml_file":
        return "str | PathLike[str]"
    return {Kind.FLAG: "bool", Kind.INTEGER: "int", Kind.STRING: "str", Kind.STRING_OR_INT: "str | int"}[option.kind]


def lines() -> Iterator[str]:
    options = {
        id.decode(): [f"    {name}: {type_of(name, option)}" for name, option in options_of(id) if name not in NAMED]
        for id in (*map(LIBRARY.mjenv_id_at, range(LIBRARY.mjenv_id_count())), UNLISTED)
    }
    first, *others = options.values()
    common = [line for line in first if all(line in other for other in others)]
    yield from common  # the rest of the class Common
    names = {id: re.sub(r"-v(\d+)$", r"V\1", id) for id in options}
    for id, name in names.items():
        yield f"class {name}(Common, total=False):"
        yield from [line for line in options[id] if line not in common] or ["    ..."]
        yield f"class {name}Vector({name}, Vector, total=False): ..."
    limit, count = "max_episode_steps: int | None = None", "num_envs: int = 1"
    for id, name in names.items():
        yield f'@overload\ndef make(id: Literal["{id}"], {limit}, **options: Unpack[{name}]) -> Environment: ...'
    any_id, checker = "id: str | EnvSpec", "disable_env_checker: bool | None = None"
    yield f"@overload\ndef make({any_id}, {limit}, {checker}, **options: Any) -> Environment: ..."
    for id, name in names.items():
        keywords = f"{count}, **options: Unpack[{name}Vector]"
        yield f'@overload\ndef make_vec(id: Literal["{id}"], {keywords}) -> VectorEnv: ...'
    yield f"@overload\ndef make_vec({any_id}, {count}, **options: Any) -> VectorEnv: ..."


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(HEAD + "\n".join(lines()) + "\n", encoding="utf-8")
