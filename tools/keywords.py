#!/usr/bin/env python3
"""Writes make and make_vec with the keywords of each id, which the library lists, for type checkers and editors.

    keywords.py FILE

The build of the Python package writes them as mjenv/_overloads.pyi. Needs Gymnasium and the library.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

# Only the ids of the library itself.
os.environ.pop("MJENV_ENGINE", None)
os.environ.pop("MJENV_TASKS", None)

sys.path.insert(0, str(Path(__file__).parents[1] / "bindings/python/src"))  # PYTHONPATH may be that of a build by pip

import mjenv
from mjenv import Kind, Option
from mjenv.gym.namespace import UNLISTED

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


def type_of(option: Option) -> str:
    if option.kind == Kind.REALS:
        return "Sequence[float]" if isinstance(option.default, tuple) else "float"
    if option.choices:
        choices = ", ".join(f'"{choice}"' for choice in option.choices)
        return f"Literal[{choices}]" + (" | int" if option.kind == Kind.STRING_OR_INT else "")
    if option.name == "xml_file":
        return "str | PathLike[str]"
    return {Kind.FLAG: "bool", Kind.INTEGER: "int", Kind.STRING: "str", Kind.STRING_OR_INT: "str | int"}[option.kind]


def lines() -> Iterator[str]:
    options = {
        id: [f"    {name}: {type_of(option)}" for name, option in mjenv.options(id).items() if name not in NAMED]
        for id in (*mjenv.ids(), UNLISTED)
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
