#!/usr/bin/env python3
"""Writes the declarations of the C interface that the bindings need, from capi/include/mjenv/mjenv.h.

    tools/declarations.py            write the files
    tools/declarations.py --check    say which file is stale, and exit 1

A language is one entry of TARGETS: the file and the function that makes its text from a header.Header.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import header

ROOT = Path(__file__).resolve().parent.parent

CTYPES = {
    "uint8_t": "c_uint8",
    "int32_t": "c_int32",
    "uint32_t": "c_uint32",
    "int64_t": "c_int64",
    "uint64_t": "c_uint64",
    "size_t": "c_size_t",
    "float": "c_float",
    "double": "c_double",
}


def python_type(api: header.Header, ctype: header.CType) -> str:
    """The ctypes expression of a type."""
    kind, pointers = api.kind(ctype.base), ctype.pointers
    if (ctype.base in ("void", "char") or kind == "opaque") and pointers:
        text, pointers = ("c_char_p" if ctype.base == "char" else "c_void_p"), pointers - 1
    elif ctype.base == "void":
        return "None"
    elif kind == "enum":
        text = "c_int32"
    else:
        text = ctype.base if kind == "struct" else CTYPES[ctype.base]
    for _ in range(pointers):
        text = f"POINTER({text})"
    return text if ctype.length is None else f"{text} * {ctype.length}"


def python_module(api: header.Header) -> str:
    """The text of _abi.py."""
    lines = [
        '"""The C interface in ctypes. Written by tools/declarations.py from mjenv.h: do not edit."""',
        "# ruff: noqa: N801",
        "",
        "from ctypes import (",
        "    CDLL,",
        "    POINTER,",
        "    Structure,",
        *(f"    {name}," for name in ("c_char_p", "c_double", "c_float", "c_int32", "c_int64", "c_size_t")),
        *(f"    {name}," for name in ("c_uint8", "c_uint32", "c_uint64", "c_void_p")),
        ")",
        "from enum import IntEnum",
        "",
        *(f"{name.removeprefix('MJENV_')} = {value}" for name, value in api.constants),
    ]
    for enum in api.enums:
        lines += ["", "", f"class {enum.name.removeprefix('mjenv_').capitalize()}(IntEnum):"]
        lines += [f"    {enum.short(name)} = {value}" for name, value in enum.values]
    for struct in api.structs:
        lines += ["", "", f"class {struct.name}(Structure):", "    _fields_ = ("]
        lines += [f'        ("{field.name}", {python_type(api, field.type)}),' for field in struct.fields]
        lines += ["    )"]
    lines += ["", "", "class Library(CDLL):", "    def __init__(self, path: str) -> None:"]
    lines += ["        super().__init__(path)"]
    for function in api.functions:
        types = [python_type(api, parameter.type) for parameter in function.parameters]
        arguments = f"({types[0]},)" if len(types) == 1 else f"({', '.join(types)})"
        line = f"        self.{function.name}.argtypes = {arguments}"
        if len(line) > 120:
            line = "\n".join([line.partition("(")[0] + "(", *(f"            {name}," for name in types), "        )"])
        lines += [line, f"        self.{function.name}.restype = {python_type(api, function.result)}"]
    return "\n".join(lines) + "\n"


TARGETS: dict[str, Callable[[header.Header], str]] = {
    "bindings/python/src/mjenv/_abi.py": python_module,
}


def main() -> int:
    parser = argparse.ArgumentParser(description="Write the bindings' declarations from the C header.")
    parser.add_argument("--check", action="store_true", help="only compare; exit 1 when a file is stale")
    check = parser.parse_args().check
    api = header.parse()
    stale = False
    for name, write in TARGETS.items():
        path, text = ROOT / name, write(api)
        if path.exists() and path.read_text(encoding="utf-8") == text:
            continue
        stale = True
        if check:
            print(f"{name} is stale: run tools/declarations.py", file=sys.stderr)
        else:
            path.write_text(text, encoding="utf-8")
            print(f"wrote {name}")
    return int(check and stale)


if __name__ == "__main__":
    sys.exit(main())
