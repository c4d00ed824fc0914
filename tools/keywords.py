#!/usr/bin/env python3
"""Writes the keywords that make and make_vec take for each id, from the library's own description of its options.

    keywords.py            writes bindings/python/src/mjenv/_overloads.pyi
    keywords.py --check    exits with 1 if that file is stale

Type checkers and editors read the file; the running program does not. Needs the package mjenv and its library.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

# Only the ids of the library itself.
os.environ.pop("MJENV_TASKS", None)

import mjenv
from mjenv import Kind, Option
from mjenv.gym.namespace import UNLISTED

FILE = Path(__file__).resolve().parent.parent / "bindings" / "python" / "src" / "mjenv" / "_overloads.pyi"
WIDTH = 120

# Keywords that make or make_vec name themselves.
NAMED = ("max_episode_steps", "num_threads", "autoreset_mode")

HEAD = '''\
"""make and make_vec with the keywords of each id. Written by tools/keywords.py from the library: do not edit."""

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
'''

VECTOR = """\
class Vector(TypedDict, total=False):
    max_episode_steps: int | None
    num_threads: int
    autoreset_mode: AutoresetMode | str
    dtype: DTypeLike
    copy: bool
    pixels: tuple[int, int] | None
    camera: int | str | None
    action_repeat: int
    frame_stack: int
"""


def type_of(option: Option) -> str:
    if option.kind == Kind.REALS:
        return "Sequence[float]" if isinstance(option.default, tuple) else "float"
    if option.choices:
        choices = ", ".join(f'"{choice}"' for choice in option.choices)
        return f"Literal[{choices}]" + (" | int" if option.kind == Kind.STRING_OR_INT else "")
    if option.name == "xml_file":
        return "str | PathLike[str]"
    return {Kind.FLAG: "bool", Kind.INTEGER: "int", Kind.STRING: "str", Kind.STRING_OR_INT: "str | int"}[option.kind]


def class_of(name: str, bases: str, options: dict[str, str]) -> str:
    head = f"class {name}({bases}, total=False):"
    if not options:
        return f"{head} ...\n"
    return "\n".join([head, *(f"    {option}: {kind}" for option, kind in options.items())]) + "\n"


def overload(function: str, parameters: list[str], result: str) -> str:
    inside = ", ".join(parameters)
    line = f"def {function}({inside}) -> {result}: ..."
    if len(line) > WIDTH:
        inside = f"    {inside}"
        if len(inside) > WIDTH:
            inside = "\n".join(f"    {parameter}," for parameter in parameters)
        line = f"def {function}(\n{inside}\n) -> {result}: ..."
    return f"@overload\n{line}\n"


def parts() -> Iterator[str]:
    """The classes and functions of the file."""
    options = {
        id: {name: type_of(option) for name, option in mjenv.options(id).items() if name not in NAMED}
        for id in (*mjenv.ids(), UNLISTED)
    }
    first, *others = options.values()
    common = {name: kind for name, kind in first.items() if all(name in other for other in others)}
    yield class_of(
        "Common", "Rendering, Randomizing", {**common, "engine": "str | None", "disable_env_checker": "bool | None"}
    )
    yield VECTOR
    names = {id: re.sub(r"-v(\d+)$", r"V\1", id) for id in options}
    for id, own in options.items():
        yield class_of(names[id], "Common", {name: kind for name, kind in own.items() if name not in common})
        yield class_of(f"{names[id]}Vector", f"{names[id]}, Vector", {})
    limit = "max_episode_steps: int | None = None"
    for id, name in names.items():
        yield overload("make", [f'id: Literal["{id}"]', limit, f"**options: Unpack[{name}]"], "Environment")
    yield overload(
        "make",
        ["id: str | EnvSpec", limit, "disable_env_checker: bool | None = None", "**options: Any"],
        "Environment",
    )
    count = "num_envs: int = 1"
    for id, name in names.items():
        parameters = [f'id: Literal["{id}"]', count, f"**options: Unpack[{name}Vector]"]
        yield overload("make_vec", parameters, "VectorEnv")
    yield overload("make_vec", ["id: str | EnvSpec", count, "**options: Any"], "VectorEnv")


def text() -> str:
    """The file, laid out as ruff formats it: blank lines stand around classes with a body alone."""
    written = ""
    before = HEAD
    for part in (HEAD, *parts()):
        together = before[0] == part[0] and all(p.endswith(": ...\n") for p in (before, part))
        written += part if part is HEAD or together else f"\n{part}"
        before = part
    return written


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only compare, and exit with 1 if the file is stale")
    check = parser.parse_args().check
    fresh = text()
    if FILE.exists() and FILE.read_text(encoding="utf-8") == fresh:
        return 0
    if check:
        print(f"{FILE.name} is stale: run tools/keywords.py", file=sys.stderr)
        return 1
    FILE.write_text(fresh, encoding="utf-8")
    print(f"wrote {FILE.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
