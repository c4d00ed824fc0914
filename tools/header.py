"""Reads the headers mjenv.h, task.h and those of extras/ into Python objects for tools/declarations.py.

The headers keep to a regular subset of C: enums (a typedef of int32_t and an enum of its values), structs of scalars,
pointers, pointers to functions and arrays of a literal length, opaque structs, and functions marked MJENV_API or,
in extras/NAME, MJENV_NAME_API. Inline functions are left out. The parser raises ValueError for anything else, so that
it misses nothing.

    import header
    api = header.parse()  # mjenv.h; header.parse(header.PATH, header.TASK) reads task.h with it
    for function in api.functions:
        print(function.result, function.name, function.parameters)
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

PATH = Path(__file__).resolve().parent.parent / "capi" / "include" / "mjenv" / "mjenv.h"
TASK = PATH.with_name("task.h")
GUESTS = sorted(PATH.parents[3].glob("extras/*/include/mjenv/*.h"))  # each has the name of its folder

SCALARS = ("void", "char", "uint8_t", "int32_t", "uint32_t", "int64_t", "uint64_t", "float", "double")


@dataclass(frozen=True)
class CType:
    """`const char **` is CType("char", True, 2); a struct field `int64_t shape[4]` has length 4."""

    base: str  # a scalar of SCALARS, or the name of an enum, a struct or an opaque struct
    const: bool = False  # of the base
    pointers: int = 0
    length: int | None = None
    callback: Function | None = None  # what a pointer to a function points to; the base is "callback"

    def __str__(self) -> str:
        if self.callback:
            return f"{self.callback.result} (*)({', '.join(str(member.type) for member in self.callback.parameters)})"
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
        """What a CType's base is: "scalar", "enum", "struct", "opaque" or "callback"."""
        if base in SCALARS:
            return "scalar"
        if base == "callback":
            return "callback"
        if any(base == enum.name for enum in self.enums):
            return "enum"
        if any(base == struct.name for struct in self.structs):
            return "struct"
        if base in self.opaques:
            return "opaque"
        raise ValueError(f"unknown type {base}")


_MEMBER = re.compile(r"(const )?(\w+) (\**)(\w+)(?:\[(\d+)\])?")
_CALLBACK = re.compile(r"([\w ]+ \**)\(\*(\w+)\)\((.*)\)")
_DECLARATION = re.compile(
    r"(?:typedef struct (?P<opaque>\w+) \w+;"
    r"|typedef int32_t (?P<enum>\w+); enum (?P=enum)_value \{(?P<values>[^}]*)\};"
    r"|(?:typedef )?struct (?P<struct>\w+) \{(?P<fields>[^}]*)\}(?: \w+)?;"
    r"|typedef (?P<entry>[\w ]+ \**\w+\([^)]*\));"
    r"|MJENV_(?:[A-Z]+_)?API (?P<result>[\w ]+ \**)(?P<function>\w+)\((?P<parameters>[^)]*)\);) ?"
)


def _member(text: str) -> tuple[str, CType]:
    match = _MEMBER.fullmatch(text.strip().replace("*const *", "**"))
    if not match:
        raise ValueError(f"cannot read the declaration: {text}")
    const, base, stars, name, length = match.groups()
    return name, CType(base, bool(const), len(stars), int(length) if length else None)


def _fields(text: str) -> Iterable[Member]:
    for line in filter(None, (part.strip() for part in text.split(";"))):
        if callback := _CALLBACK.fullmatch(line):
            _, result = _member(callback[1] + "result")
            function = Function(callback[2], result, tuple(_parameters(callback[3])))
            yield Member(callback[2], CType("callback", pointers=1, callback=function))
            continue
        first, *others = line.split(",")
        name, ctype = _member(first)
        yield Member(name, ctype)
        for other in others:
            yield Member(other.strip().lstrip("*"), ctype)


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


def _without_inline(text: str) -> str:
    """The text without static inline functions, whose bodies may hold braces."""
    while (start := text.find("static inline ")) >= 0:
        end = text.index("{", start) + 1
        depth = 1
        while depth:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        text = text[:start] + text[end:].lstrip()
    return text


def parse(*paths: Path) -> Header:
    """Reads headers, each after those it includes; raises ValueError for a declaration it does not understand."""
    text = "".join(path.read_text(encoding="utf-8") for path in paths or (PATH,))
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S).replace("\\\n", " ")
    constants = tuple((name, int(value)) for name, value in re.findall(r"#define (\w+) \(?(-?\d+)\)?\s", text))
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.S)
    text = " ".join(line for line in text.splitlines() if not line.startswith("#"))
    text = _without_inline(re.sub(r"\s+", " ", text)).strip()

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
        elif match["entry"]:
            pass  # the type of a function that a plug-in exports
        elif match["struct"]:
            opaques = [name for name in opaques if name != match["struct"]]
            structs.append(Struct(match["struct"], tuple(_fields(match["fields"]))))
        else:
            _, result = _member(match["result"] + "result")
            functions.append(Function(match["function"], result, tuple(_parameters(match["parameters"]))))
        position = match.end()

    header = Header(constants, tuple(opaques), tuple(enums), tuple(structs), tuple(functions))
    callbacks = [field.type.callback for struct in header.structs for field in struct.fields if field.type.callback]
    for struct in header.structs:
        for field in struct.fields:
            header.kind(field.type.base)
    for function in (*header.functions, *callbacks):
        for ctype in (function.result, *(parameter.type for parameter in function.parameters)):
            header.kind(ctype.base)
    return header
