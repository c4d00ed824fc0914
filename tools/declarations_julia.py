#!/usr/bin/env python3
"""Writes bindings/julia/src/capi.jl from the C header.

    tools/declarations_julia.py            write the file
    tools/declarations_julia.py --check    exit 1 if it is not what the header asks for

The file holds Julia's twins of the enums and structs, and a ccall for each function.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator

import header

PATH = header.PATH.parents[3] / "bindings" / "julia" / "src" / "capi.jl"

SCALARS = {
    "void": "Cvoid",
    "char": "Cchar",
    "uint8_t": "UInt8",
    "int32_t": "Int32",
    "uint32_t": "UInt32",
    "int64_t": "Int64",
    "uint64_t": "UInt64",
    "size_t": "Csize_t",
    "float": "Float32",
    "double": "Float64",
}


def julia_type(ctype: header.CType) -> str:
    """Cstring for `const char *`, NTuple for an array, Ptr for every other pointer."""
    name = SCALARS.get(ctype.base, ctype.base)
    pointers = ctype.pointers
    if ctype.base == "char" and ctype.const and pointers > 0:
        name = "Cstring"
        pointers -= 1
    name = "Ptr{" * pointers + name + "}" * pointers
    return name if ctype.length is None else f"NTuple{{{ctype.length}, {name}}}"


def _enum(enum: header.Enum) -> Iterator[str]:
    yield f"@enum {enum.name}::Int32 begin"
    for name, value in enum.values:
        yield f"    {name} = {value}"
    yield "end"


def _default(struct: header.Struct, field: header.Member, kind: str) -> str:
    if field.name == "struct_size":
        return f"sizeof({struct.name})"
    if field.type.length is not None:
        return "(" + "0, " * (field.type.length - 1) + "0)"
    if field.type.pointers == 0:
        return "0" if kind in ("scalar", "enum") else f"{julia_type(field.type)}(0)"
    return f"{julia_type(field.type)}(C_NULL)"


def _struct(api: header.Header, struct: header.Struct) -> Iterator[str]:
    # With keywords, because structs grow.
    yield f"Base.@kwdef struct {struct.name}"
    for field in struct.fields:
        kind = api.kind(field.type.base)
        # Int32 for an enum, of which a newer library may have more values.
        name = "Int32" if kind == "enum" else julia_type(field.type)
        yield f"    {field.name}::{name} = {_default(struct, field, kind)}"
    yield "end"


def _function(index: int, function: header.Function) -> Iterator[str]:
    names = [parameter.name for parameter in function.parameters]
    types = [julia_type(parameter.type) for parameter in function.parameters]
    yield f"{function.name}({', '.join(names)}) = ccall("
    yield f"    address({index}),"
    yield f"    {julia_type(function.result)},"
    yield f"    ({', '.join(types)}{',' if len(types) == 1 else ''}),"
    yield from (f"    {name}," for name in names)
    yield ")"


def generate(api: header.Header) -> str:
    """The text of capi.jl."""
    lines = ["# Written by tools/declarations_julia.py from capi/include/mjenv/mjenv.h: change those."]
    lines.append("")
    lines.extend(f"const {name} = {value}" for name, value in api.constants)
    lines.append("")
    lines.extend(f"struct {name} end" for name in api.opaques)
    for enum in api.enums:
        lines.extend(["", *_enum(enum)])
    for struct in api.structs:
        lines.extend(["", *_struct(api, struct)])
    lines.extend(["", "# In the order of the indices given to address."])
    lines.extend(["const FUNCTIONS = (", *(f"    :{function.name}," for function in api.functions), ")"])
    for index, function in enumerate(api.functions, start=1):
        lines.extend(["", *_function(index, function)])
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    text = generate(header.parse())
    if not arguments.check:
        PATH.write_text(text, encoding="utf-8")
    elif not PATH.exists() or PATH.read_text(encoding="utf-8") != text:
        print(f"{PATH} is stale: run tools/declarations_julia.py", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
