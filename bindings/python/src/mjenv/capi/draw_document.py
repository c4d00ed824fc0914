"""Writes draws, noise, delays and pushes (randomization.py) as the library's JSON document."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

from mjenv.capi.declarations import Status
from mjenv.capi.keywords import RANDOMIZING
from mjenv.errors import InvalidValueError, OptionError, UnknownNameError


def _plain(value: Any) -> Any:
    """What JSON can hold of a value that it cannot hold itself."""
    if is_dataclass(value) and not isinstance(value, type):
        given = {one.name: getattr(value, one.name) for one in fields(value)}
        return {name: member for name, member in given.items() if member is not None}
    if isinstance(value, Mapping):
        return dict(value)
    if hasattr(value, "tolist"):  # numbers and arrays of NumPy
        return value.tolist()
    if isinstance(value, Sequence) and not isinstance(value, (bytes, bytearray, memoryview)):
        return list(value)
    raise OptionError(f"a document of draws cannot hold {value!r}", Status.E_TYPE)


def written(**parts: Any) -> bytes:
    """The document that replaces these parts."""
    try:
        return json.dumps(parts, default=_plain, allow_nan=False).encode()
    except (ValueError, RecursionError) as error:  # nan, infinity, circles
        raise InvalidValueError(f"{' and '.join(parts)}: {error}", Status.E_VALUE) from None


def parts_of(text: str | bytes) -> dict[str, Any]:
    """The parts of a document, which are values of the keywords of make: randomize, noise, delay and push."""

    def once(members: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(members)
        if len(found) < len(members):
            raise ValueError("an object has a name twice")
        return found

    try:
        parts = json.loads(text, object_pairs_hook=once)
    except (ValueError, RecursionError) as error:
        raise InvalidValueError(f"the document is no JSON: {error}", Status.E_VALUE) from None
    if not isinstance(parts, dict):
        raise OptionError("a document of draws is an object {...}", Status.E_TYPE)
    for name in parts.keys() - set(RANDOMIZING):
        raise UnknownNameError(f"a document of draws has no {name!r}, but {', '.join(RANDOMIZING)}", Status.E_NAME)
    return parts


def draws_of(randomize: Any) -> list[str]:
    """The arrays that resets draw, in the order of the draws."""
    several = {
        name: draws if isinstance(draws, (list, tuple)) else [draws] for name, draws in (randomize or {}).items()
    }
    return [name for name, draws in several.items() for _ in draws]
