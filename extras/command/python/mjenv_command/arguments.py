"""Arguments that several commands take."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mjenv
from mjenv import Kind
from mjenv.registration import own_id

GROUPS = tuple(f"{kind}group" for kind in ("geom", "site", "joint", "tendon", "actuator", "skin"))
GROUP_COUNT = 6  # mjNGROUP
SHOWN_GROUPS = (0, 1, 2)  # MuJoCo's default

Commands = Any  # the type that add_subparsers returns, which has no public name


def known_id(text: str) -> str:
    """Accepts ids that any engine knows. The command later refuses an id that its engine lacks."""
    try:
        mjenv.options(text)
    except mjenv.UnknownIdError as error:
        if not any(_knows(engine, text) for engine in mjenv.engines()):
            raise argparse.ArgumentTypeError(str(error)) from None
    return own_id(text)


def _knows(engine: str, id: str) -> bool:
    try:
        mjenv.options(id, engine)
    except mjenv.UnknownIdError:
        return False
    return True


def known_engine(text: str) -> str:
    try:
        mjenv.engine(text)
    except mjenv.EngineError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def tasks_file(text: str) -> str:
    """Loads the file's tasks while arguments are parsed, so that later arguments can be their ids."""
    try:
        mjenv.load_tasks(text)
    except mjenv.Error as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number} is less than 1")
    return number


def not_negative(text: str) -> int:
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"{number} is less than 0")
    return number


def seconds(text: str) -> float:
    number = float(text)
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"{text} is no positive number of seconds")
    return number


def add_json(command: argparse.ArgumentParser) -> None:
    command.add_argument("--json", action="store_true", help="print JSON")


def add_options(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--option",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="set a constructor option, one of those that mjenv info lists; commas separate the numbers of a range; "
        "can be repeated",
    )


def add_randomize(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--randomize",
        type=document,
        default={},
        metavar="FILE",
        help="a JSON document of draws, noise, delays and pushes (docs/randomisation.md)",
    )


def document(file: str) -> dict[str, Any]:
    """The parts of a document of draws, as keyword arguments of make."""
    from mjenv.capi.draw_document import parts_of  # imports Gymnasium

    try:
        return parts_of(Path(file).read_bytes())
    except (OSError, mjenv.Error) as error:
        raise argparse.ArgumentTypeError(f"{file}: {error}") from None


def add_groups(command: argparse.ArgumentParser) -> None:
    for name in GROUPS:
        command.add_argument(
            f"--{name}",
            type=groups,
            metavar="GROUPS",
            help=f"the groups of {name.removesuffix('group')}s that are drawn, such as 0,1,3 (default: 0,1,2)",
        )


def groups(text: str) -> dict[int, bool]:
    """Whether each group is drawn."""
    chosen = {not_negative(word) for word in text.split(",") if word}
    if chosen and max(chosen) >= GROUP_COUNT:
        raise argparse.ArgumentTypeError(f"there is no group {max(chosen)}; there are 0 to {GROUP_COUNT - 1}")
    return {group: group in chosen for group in range(GROUP_COUNT)}


def groups_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """The keywords of make that choose the groups."""
    return {name: getattr(arguments, name) for name in GROUPS if getattr(arguments, name) is not None}


def options_of(id: str, assignments: Sequence[str], engine: str | None = None) -> dict[str, Any]:
    """NAME=VALUE texts as keyword arguments of make."""
    schema = mjenv.options(id, engine)
    found: dict[str, Any] = {}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        if not equals:
            raise mjenv.OptionError(f"{assignment!r} is not NAME=VALUE")
        if name not in schema:
            raise mjenv.OptionError(f"{id} has no option {name!r}; it has {', '.join(schema)}")
        found[name] = _value(schema[name], text)
    return found


def _value(option: mjenv.Option, text: str) -> Any:
    try:
        if option.kind == Kind.FLAG:
            return {"true": True, "1": True, "false": False, "0": False}[text.lower()]
        if option.kind == Kind.INTEGER:
            return int(text)
        if option.kind == Kind.REALS:
            numbers = [_number(part) for part in text.split(",")]
            return numbers[0] if not isinstance(option.default, tuple) and len(numbers) == 1 else numbers
    except (KeyError, ValueError):
        kind = option.kind.name.lower()
        raise mjenv.OptionError(f"option {option.name!r} is of the kind {kind}, not {text!r}") from None
    if option.kind == Kind.STRING_OR_INT and text.isdigit():
        return int(text)
    return text


def _number(text: str) -> int | float:
    """Keeps ints as ints, because Gymnasium's infos show whether a weight was an int."""
    try:
        return int(text)
    except ValueError:
        return float(text)


def print_json(value: Any) -> None:
    print(json.dumps(_plain(value), indent=2, allow_nan=False))


def _plain(value: Any) -> Any:
    """The value with strings in place of the floats that JSON cannot express."""
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    return value
