"""Reads capi/include/mjenv/mjenv.h into plain Python objects, from which tools/declarations.py writes declarations.

The header keeps to a regular subset of C: enums (a typedef of int32_t and an enum of its values), structs of scalars,
pointers and arrays of a literal length, opaque structs and functions marked MJENV_API. The parser raises ValueError for
anything else, so that it misses nothing.

    import header
    api = header.parse()
    for function in api.functions:
        print(function.result, function.name, function.parameters)
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

PATH = Path(__file__).resolve().parent.parent / "capi" / "include" / "mjenv" / "mjenv.h"

SCALARS = ("void", "char", "uint8_t", "int32_t", "uint32_t", "int64_t", "uint64_t", "size_t", "float", "double")


@dataclass(frozen=True)
class CType:
    """`const char **` is CType("char", True, 2); a struct field `int64_t shape[4]` has length 4."""

    base: str  # a scalar of SCALARS, or the name of an enum, a struct or an opaque struct
    const: bool = False  # of the base
    pointers: int = 0
    length: int | None = None

    def __str__(self) -> str:
        stars = " " + "*" * self.pointers if self.pointers else ""
        array = f"[{self.length}]" if self.length is not None else ""
        return ("const " if self.const else "") + self.base + stars + array


@dataclass(frozen=True)
class Member:
    """A field of a struct or a parameter of a function."""

    name: str
    type: CType


@dataclass(frozen=True)
class Enum:
    name: str
    values: tuple[tuple[str, int], ...]

    def short(self, value: str) -> str:
        """The name of a value within the enum: OBSERVATION for mjenv_role's MJENV_ROLE_OBSERVATION."""
        return value.removeprefix(f"{self.name.upper()}_").removeprefix("MJENV_")


@dataclass(frozen=True)
class Struct:
    name: str
    fields: tuple[Member, ...]


@dataclass(frozen=True)
class Function:
    name: str
    result: CType
    parameters: tuple[Member, ...]


@dataclass(frozen=True)
class Header:
    """All declarations, each kind in the order of the header."""

    constants: tuple[tuple[str, int], ...]  # integer macros
    opaques: tuple[str, ...]
    enums: tuple[Enum, ...]
    structs: tuple[Struct, ...]
    functions: tuple[Function, ...]

    def kind(self, base: str) -> str:
        """What a CType's base is: "scalar", "enum", "struct" or "opaque"."""
        if base in SCALARS:
            return "scalar"
        if any(base == enum.name for enum in self.enums):
            return "enum"
        if any(base == struct.name for struct in self.structs):
            return "struct"
        if base in self.opaques:
            return "opaque"
        raise ValueError(f"unknown type {base}")


_MEMBER = re.compile(r"(const )?(\w+) (\**)(\w+)(?:\[(\d+)\])?")
_DECLARATION = re.compile(
    r"(?:typedef struct (?P<opaque>\w+) \w+;"
    r"|typedef int32_t (?P<enum>\w+); enum (?P=enum)_value \{(?P<values>[^}]*)\};"
    r"|typedef struct (?P<struct>\w+) \{(?P<fields>[^}]*)\} \w+;"
    r"|MJENV_API (?P<result>[\w ]+ \**)(?P<function>\w+)\((?P<parameters>[^)]*)\);) ?"
)


def _member(text: str) -> tuple[str, CType]:
    match = _MEMBER.fullmatch(text.strip())
    if not match:
        raise ValueError(f"cannot read the declaration: {text}")
    const, base, stars, name, length = match.groups()
    return name, CType(base, bool(const), len(stars), int(length) if length else None)


def _fields(text: str) -> Iterable[Member]:
    for line in filter(None, (part.strip() for part in text.split(";"))):
        first, *others = line.split(",")
        name, ctype = _member(first)
        yield Member(name, ctype)
        for other in others:
            yield Member(other.strip(), ctype)


def _parameters(text: str) -> Iterable[Member]:
    if text.strip() != "void":
        for part in text.split(","):
            yield Member(*_member(part))


def _enum(name: str, text: str) -> Enum:
    values = []
    for part in text.split(","):
        key, _, value = part.partition("=")
        values.append((key.strip(), int(value)))
    return Enum(name, tuple(values))


def parse(path: Path = PATH) -> Header:
    """Reads the header. Raises ValueError for a declaration that it does not understand."""
    text = re.sub(r"/\*.*?\*/", "", path.read_text(encoding="utf-8"), flags=re.S)
    constants = tuple((name, int(value)) for name, value in re.findall(r"#define (\w+) \(?(-?\d+)\)?\s", text))
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.S)
    text = " ".join(line for line in text.splitlines() if not line.startswith("#"))
    text = re.sub(r"\s+", " ", text).strip()

    opaques, enums, structs, functions = [], [], [], []
    position = 0
    while position < len(text):
        match = _DECLARATION.match(text, position)
        if not match:
            raise ValueError(f"cannot read the header from: {text[position : position + 80]}")
        if match["opaque"]:
            opaques.append(match["opaque"])
        elif match["enum"]:
            enums.append(_enum(match["enum"], match["values"]))
        elif match["struct"]:
            structs.append(Struct(match["struct"], tuple(_fields(match["fields"]))))
        else:
            _, result = _member(match["result"] + "result")
            functions.append(Function(match["function"], result, tuple(_parameters(match["parameters"]))))
        position = match.end()

    header = Header(constants, tuple(opaques), tuple(enums), tuple(structs), tuple(functions))
    for struct in header.structs:
        for field in struct.fields:
            header.kind(field.type.base)
    for function in header.functions:
        for ctype in (function.result, *(parameter.type for parameter in function.parameters)):
            header.kind(ctype.base)
    return header
