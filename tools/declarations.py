#!/usr/bin/env python3
"""Writes the declarations of the C interface that each binding needs from capi/include/mjenv.

    declarations.py [LANGUAGE...]            writes the files of these languages, or of all
    declarations.py --check [LANGUAGE...]    names each file that is stale, and then exits with 1

LANGUAGES has one entry for each language, and for each language with a header of extras/: its file, and the function
that makes its text.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import header

ROOT = Path(__file__).resolve().parent.parent

# ---- Python ----

PYTHON_TYPES = {
    "uint8_t": "c_uint8",
    "int32_t": "c_int32",
    "uint32_t": "c_uint32",
    "int64_t": "c_int64",
    "uint64_t": "c_uint64",
    "float": "c_float",
    "double": "c_double",
}


def python_type(api: header.Header, ctype: header.CType) -> str:
    """The ctypes expression of a type."""
    kind, pointers = api.kind(ctype.base), ctype.pointers
    if ctype.callback:
        return "c_void_p"
    if (ctype.base in ("void", "char") or kind == "opaque") and pointers:
        text, pointers = ("c_char_p" if ctype.base == "char" else "c_void_p"), pointers - 1
    elif ctype.base == "void":
        return "None"
    elif kind == "enum":
        text = "c_int32"
    else:
        text = ctype.base if kind == "struct" else PYTHON_TYPES[ctype.base]
    for _ in range(pointers):
        text = f"POINTER({text})"
    return text if ctype.length is None else f"{text} * {ctype.length}"


# The functions of task.h that Python calls.
PYTHON_TASK_FUNCTIONS = ("mjenv_load_tasks",)


def python_module(api: header.Header) -> str:
    """The text of declarations.py."""
    task_functions = header.parse(header.PATH, header.TASK).functions
    functions = [*api.functions, *(one for one in task_functions if one.name in PYTHON_TASK_FUNCTIONS)]
    lines = [
        '"""The C interface in ctypes. Written by tools/declarations.py from mjenv.h and task.h: do not edit."""',
        "# ruff: noqa: N801",
        "",
        "from ctypes import (",
        "    CDLL,",
        "    Structure,",
        *(f"    {name}," for name in ("c_char_p", "c_double", "c_float", "c_int32", "c_int64")),
        *(f"    {name}," for name in ("c_uint8", "c_uint32", "c_uint64", "c_void_p")),
        ")",
        "from enum import IntEnum",
        "",
        "from mjenv.capi.pointers import POINTER",
        "",
        *(f"{name.removeprefix('MJENV_')} = {value}" for name, value in api.constants),
    ]
    lines += [*python_enums(api), *python_structs(api, api.structs), *python_library(api, functions)]
    return "\n".join(lines) + "\n"


def python_enums(api: header.Header) -> Iterator[str]:
    for enum in api.enums:
        name = "".join(part.capitalize() for part in enum.name.split("_")[1:])
        yield from ("", "", f"class {name}(IntEnum):")
        yield from (f"    {enum.short(value)} = {number}" for value, number in enum.values)


def python_structs(api: header.Header, structs: Sequence[header.Struct]) -> Iterator[str]:
    for struct in structs:
        yield from ("", "", f"class {struct.name}(Structure):", "    _fields_ = (")
        yield from (f'        ("{field.name}", {python_type(api, field.type)}),' for field in struct.fields)
        yield "    )"


def python_library(api: header.Header, functions: Sequence[header.Function]) -> Iterator[str]:
    yield from ("", "", "class Library(CDLL):", "    def __init__(self, path: str) -> None:")
    yield "        super().__init__(path)"
    for function in functions:
        types = [python_type(api, parameter.type) for parameter in function.parameters]
        arguments = f"({types[0]},)" if len(types) == 1 else f"({', '.join(types)})"
        line = f"        self.{function.name}.argtypes = {arguments}"
        if len(line) > 120:
            line = "\n".join([line.partition("(")[0] + "(", *(f"            {name}," for name in types), "        )"])
        yield from (line, f"        self.{function.name}.restype = {python_type(api, function.result)}")


def python_task_type(ctype: header.CType, known: Sequence[str], is_called: bool) -> str:
    """An address is enough, but for text and for structs that stand before. is_called: Python calls the functions."""
    if ctype.callback and is_called:
        types = [ctype.callback.result, *(one.type for one in ctype.callback.parameters)]
        return f"CFUNCTYPE({', '.join(python_task_type(one, known, is_called) for one in types)})"
    if ctype.base == "char":
        return "c_char_p"
    if ctype.pointers:
        text = ctype.base if ctype.base in known else "c_void_p"
        return f"POINTER({text})" if ctype.base in known or ctype.pointers > 1 else text
    if ctype.base == "void":
        return "None"
    text = PYTHON_TYPES.get(ctype.base, "c_int32")
    return text if ctype.length is None else f"{text} * {ctype.length}"


def python_task_module(api: header.Header) -> str:
    """The text of task_declarations.py."""
    structs = [one for one in header.parse(header.PATH, header.TASK).structs if one not in api.structs]
    known = [one.name for one in api.structs]
    used = set(known)
    lines: list[str] = []
    for struct in structs:
        lines += ["", "", f"class {struct.name}(Structure):", "    _fields_ = ("]
        for field in struct.fields:
            kind = python_task_type(field.type, known, is_called=struct.name == "mjenv_task_api")
            lines.append(f'        ("{field.name}", {kind}),')
        lines.append("    )")
        known.append(struct.name)
    task = next(one for one in structs if one.name == "mjenv_task")
    callbacks = [one.name for one in task.fields if one.type.callback and one.name not in ("build", "destroy")]
    head = [
        '"""The structs of mjenv/task.h in ctypes. Written by tools/declarations.py: do not edit."""',
        "# ruff: noqa: N801",
        "",
        "from ctypes import (",
        *(f"    {name}," for name in ("CFUNCTYPE", "Structure", *ctypes_in(lines))),
        ")",
        "",
        f"from mjenv.capi.declarations import {', '.join(sorted(used & words_of(lines)))}",
        "from mjenv.capi.pointers import POINTER",
        "",
        "# Those of mjenv_task, but build and destroy",
        "CALLBACKS = (",
        *(f'    "{name}",' for name in callbacks),
        ")",
    ]
    return "\n".join(head + lines) + "\n"


def guest_parts(path: Path, api: header.Header) -> tuple[header.Header, header.Header]:
    """What mjenv.h and a header of extras/ declare together, and what the latter alone declares."""
    both = header.parse(header.PATH, path)
    own = header.Header(
        tuple(one for one in both.constants if one not in api.constants),
        tuple(one for one in both.opaques if one not in api.opaques),
        tuple(one for one in both.enums if one not in api.enums),
        tuple(one for one in both.structs if one not in api.structs),
        tuple(one for one in both.functions if one not in api.functions),
    )
    return both, own


def python_guest_module(path: Path, api: header.Header) -> str:
    """The declarations of a header of extras/."""
    both, own = guest_parts(path, api)
    known = replace(own, opaques=both.opaques, enums=both.enums, structs=both.structs)
    used = {one.type.base for function in own.functions for one in function.parameters}
    lines = [
        *(f"{name.removeprefix(f'MJENV_{path.stem.upper()}_')} = {value}" for name, value in own.constants),
        *python_enums(own),
        *python_structs(known, own.structs),
        *python_library(known, own.functions),
    ]
    head = [
        f'"""{path.name} in ctypes. Written by tools/declarations.py: do not edit."""',
        "# ruff: noqa: N801",
        "",
        "from ctypes import (",
        *(f"    {name}," for name in ("CDLL", "Structure", *ctypes_in(lines))),
        ")",
        "from enum import IntEnum",
        "",
        f"from mjenv.capi.declarations import {', '.join(sorted(used & {one.name for one in api.structs}))}",
        "from mjenv.capi.pointers import POINTER",
        "",
    ]
    return "\n".join(head + lines) + "\n"


def words_of(lines: Sequence[str]) -> set[str]:
    return set(re.findall(r"\w+", "\n".join(lines)))


def ctypes_in(lines: Sequence[str]) -> list[str]:
    """The types of ctypes that these lines name."""
    return sorted({"c_char_p", "c_void_p", *PYTHON_TYPES.values()} & words_of(lines), key=natural)


def natural(name: str) -> tuple[str, int]:
    """Sorts c_uint8 before c_uint32, as ruff does."""
    return re.sub(r"\d+", "", name), int("0" + re.sub(r"\D+", "", name))


# ---- Julia ----

JULIA_TYPES = {
    "void": "Cvoid",
    "char": "Cchar",
    "uint8_t": "UInt8",
    "int32_t": "Int32",
    "uint32_t": "UInt32",
    "int64_t": "Int64",
    "uint64_t": "UInt64",
    "float": "Float32",
    "double": "Float64",
}


def julia_type(ctype: header.CType) -> str:
    """Cstring for `const char *`, NTuple for an array, Ptr for every other pointer."""
    name = "Cvoid" if ctype.callback else JULIA_TYPES.get(ctype.base, ctype.base)
    pointers = ctype.pointers
    if ctype.base == "char" and ctype.const and pointers > 0:
        name = "Cstring"
        pointers -= 1
    name = "Ptr{" * pointers + name + "}" * pointers
    return name if ctype.length is None else f"NTuple{{{ctype.length}, {name}}}"


def julia_enum(enum: header.Enum) -> Iterator[str]:
    yield f"@enum {enum.name}::Int32 begin"
    for name, value in enum.values:
        yield f"    {name} = {value}"
    yield "end"


def julia_default(struct: header.Struct, field: header.Member, kind: str) -> str:
    if field.name == "struct_size":
        return f"sizeof({struct.name})"
    if field.type.length is not None:
        return "(" + "0, " * (field.type.length - 1) + "0)"
    if field.type.pointers == 0:
        return "0" if kind in ("scalar", "enum") else f"{julia_type(field.type)}(0)"
    return f"{julia_type(field.type)}(C_NULL)"


def julia_struct(api: header.Header, struct: header.Struct) -> Iterator[str]:
    # With keywords, because structs grow.
    yield f"Base.@kwdef struct {struct.name}"
    for field in struct.fields:
        kind = api.kind(field.type.base)
        # Int32 for an enum, of which a newer library may have more values.
        name = "Int32" if kind == "enum" else julia_type(field.type)
        yield f"    {field.name}::{name} = {julia_default(struct, field, kind)}"
    yield "end"


def julia_structs(api: header.Header) -> Iterator[header.Struct]:
    """The structs, each behind those that it contains or points to, because Julia reads from top to bottom."""
    waiting = list(api.structs)
    while waiting:
        names = {struct.name for struct in waiting}
        ready = next(one for one in waiting if not names & {f.type.base for f in one.fields if f.type.base != one.name})
        waiting.remove(ready)
        yield ready


def julia_handle(api: header.Header, function: header.Function) -> str | None:
    """The name of the first parameter, if it is a handle."""
    first = function.parameters[0] if function.parameters else None
    return first.name if first and first.type.base in api.opaques and first.type.pointers == 1 else None


def julia_function(function: header.Function, address: str, *first: str) -> Iterator[str]:
    """first: a parameter of the Julia function that the C function does not have."""
    names = [parameter.name for parameter in function.parameters]
    types = [julia_type(parameter.type) for parameter in function.parameters]
    yield f"{function.name}({', '.join((*first, *names))}) ="
    tuple_of_types = f"({', '.join(types)}{',' if len(types) == 1 else ''})"
    yield f"    ccall({', '.join((address, julia_type(function.result), tuple_of_types, *names))})"


def julia_names(name: str, functions: Sequence[header.Function]) -> Iterator[str]:
    """A constant with the names of functions."""
    names = textwrap.fill(", ".join(f":{function.name}" for function in functions), 116)
    yield from (f"const {name} = (", textwrap.indent(names, "    "), ")")


def julia_module(_: header.Header) -> str:
    """The text of capi.jl."""
    api = header.parse(header.PATH, header.TASK)
    lines = ["# Written by tools/declarations.py from mjenv.h and task.h in capi/include/mjenv: do not edit."]
    lines.append("")
    lines.extend(f"const {name} = {value}" for name, value in api.constants)
    lines.append("")
    lines.extend(f"struct {name} end" for name in api.opaques)
    for enum in api.enums:
        lines.extend(["", *julia_enum(enum)])
    for struct in julia_structs(api):
        lines.extend(["", *julia_struct(api, struct)])
    lines.extend(
        [
            "",
            "# address(of, index) is the function at this index in FUNCTIONS, in the library of an engine or a handle.",
        ]
    )
    lines.extend(julia_names("FUNCTIONS", api.functions))
    for index, function in enumerate(api.functions, start=1):
        handle = julia_handle(api, function)
        first = () if handle else ("engine",)
        lines.extend(julia_function(function, f"address({handle or 'engine'}, {index})", *first))
    lines.extend(["", "# The library's functions for callbacks; api is a Ptr{mjenv_task_api}."])
    (task_api,) = (struct for struct in api.structs if struct.name == "mjenv_task_api")
    for field in task_api.fields:
        if callback := field.type.callback:
            function = replace(callback, name=f"task_{callback.name}")
            lines.extend(julia_function(function, f"unsafe_load(api).{callback.name}", "api"))
    return "\n".join(lines) + "\n"


def julia_guest_module(path: Path, api: header.Header) -> str:
    """The declarations of a header of extras/."""
    both, own = guest_parts(path, api)
    name, list_name = path.stem, f"{path.stem.upper()}_FUNCTIONS"
    folder = path.parent.relative_to(ROOT)
    lines = [f"# Written by tools/declarations.py from {path.name} in {folder}: do not edit.", ""]
    lines.extend(f"const {constant} = {value}" for constant, value in own.constants)
    lines.append("")
    lines.extend(f"struct {opaque} end" for opaque in own.opaques)
    for enum in own.enums:
        lines.extend(["", *julia_enum(enum)])
    for struct in own.structs:
        lines.extend(["", *julia_struct(both, struct)])
    lines.extend(["", f"# {name}_address(index) is the function at this index in {list_name}."])
    lines.extend(julia_names(list_name, own.functions))
    for index, function in enumerate(own.functions, start=1):
        lines.extend(julia_function(function, f"{name}_address({index})"))
    return "\n".join(lines) + "\n"


# ---- Rust ----

BINDGEN_OPTIONS = (
    *("--rust-target", "1.47", "--size_t-is-usize", "--default-enum-style", "consts", "--no-prepend-enum-name"),
    # Sizes and offsets are those of the header; tests/abi has them, and repr(C) keeps them.
    *("--no-layout-tests", "--with-derive-default", "--blocklist-type", "__.*"),
    # The header has the comments.
    "--no-doc-comments",
    # An empty configuration, so that a user's own settings of rustfmt do not change the file.
    *("--rustfmt-configuration-file", "/dev/null"),
)
RUST_ALLOWED = ("--allowlist-function", "mjenv_.*", "--allowlist-type", "mjenv_.*", "--allowlist-var", "MJENV_.*")


def in_one_line(found: re.Match[str]) -> str:
    text = " ".join(found[0].split())
    for loose, dense in (("( ", "("), ("< ", "<"), (", )", ")"), (",)", ")"), (", >", ">"), (" >", ">")):
        text = text.replace(loose, dense)
    return f"    {text}"


def bindgen(path: Path, *options: str) -> str:
    """What bindgen writes from a header and those that it includes."""
    setup = [str(ROOT / "tools" / "setup"), "bindgen"]
    bindgen = subprocess.run(setup, check=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "bindings.rs")
        arguments = [str(path.relative_to(ROOT)), "--output", str(output), *BINDGEN_OPTIONS, *options]
        clang = ["-std=c99", "-Icapi/include"]
        subprocess.run([bindgen, *arguments, "--", *clang], check=True, cwd=ROOT)
        text = output.read_text(encoding="utf-8")
    # The values of an enum get the type that the header gives the enum.
    text = re.sub(r": (mjenv_[a-z]+)_value = ", r": \1 = ", text)
    text = re.sub(r"(?m)^pub type mjenv_[a-z]+_value = .*\n", "", text)
    # A line for each function, pointer to a function, opaque struct, and default of a struct.
    text = re.sub(
        r"(?m)^    pub (?:fn [^;]*;|\w+:\n.*,|\w+: ::std::option::Option<\n(?:.*\n)*?    >,)", in_one_line, text
    )
    text = re.sub(r';\n\}\nextern "C" \{\n', ";\n", text).replace("#[repr(C)]\n#[derive", "#[repr(C)] #[derive")
    text = re.sub(r" \{\n    _unused: \[u8; 0\],\n\}", " { _unused: [u8; 0] }", text)
    default = r"impl Default for \1 { fn default() -> Self { unsafe { ::std::mem::zeroed() } } }"
    return re.sub(r"impl Default for (\w+) \{\n(?:    .*\n)*\}", default, text)


def rust_module(_: header.Header) -> str:
    """The text of bindings.rs, from task.h and mjenv.h."""
    return bindgen(header.TASK, *RUST_ALLOWED)


def rust_guest_module(path: Path, _: header.Header) -> str:
    """The declarations of a header of extras/ alone."""
    allowed = ("--allowlist-file", f".*/{re.escape(path.name)}", "--no-recursive-allowlist")
    return bindgen(path, *allowed, "--raw-line", "use mjenv_sys::*;")


# ---- JavaScript ----

# Of WebAssembly: how many bytes, and what JavaScript calls it in calls and in memory. Pointers have 32 bits.
JAVASCRIPT_TYPES = {
    "uint8_t": (1, "number", "uint8"),
    "int32_t": (4, "number", "int32"),
    "uint32_t": (4, "number", "uint32"),
    "int64_t": (8, "bigint", "int64"),
    "uint64_t": (8, "bigint", "uint64"),
    "float": (4, "number", "float32"),
    "double": (8, "number", "float64"),
}
JAVASCRIPT_POINTER = (4, "number", "uint32")

# The library draws no pictures in WebAssembly.
JAVASCRIPT_LACKS = re.compile("mjenv_(render|window|gl$|visual$)|MJENV_CAMERA")


def javascript_type(api: header.Header, ctype: header.CType) -> tuple[int, str, str]:
    if ctype.pointers:
        return JAVASCRIPT_POINTER
    return JAVASCRIPT_TYPES["int32_t" if api.kind(ctype.base) == "enum" else ctype.base]


def javascript_struct(api: header.Header, struct: header.Struct) -> Iterator[str]:
    """The size of a struct, and for each field its offset, its type and its length: 0 unless it is an array."""
    fields, offset, alignment = [], 0, 1
    for field in struct.fields:
        size, _, name = javascript_type(api, field.type)
        alignment = max(alignment, size)
        offset += -offset % size
        fields.append(f'    {field.name}: {{ offset: {offset}, type: "{name}", length: {field.type.length or 0} }},')
        offset += size * (field.type.length or 1)
    yield f"export const {struct.name} = struct({offset + -offset % alignment}, {{"
    yield from (field[2:] for field in fields)
    yield "});"


def javascript_function(api: header.Header, function: header.Function) -> str:
    types = [f"{one.name}: {javascript_type(api, one.type)[1]}" for one in function.parameters]
    void = function.result.base == "void" and not function.result.pointers
    result = "void" if void else javascript_type(api, function.result)[1]
    return f" * @property {{({', '.join(types)}) => {result}}} {function.name}"


def javascript_module(api: header.Header) -> str:
    """The text of abi.js."""
    lines = [
        "// The C interface in WebAssembly. Written by tools/declarations.py from mjenv.h: do not edit.",
        "",
        "/**",
        ' * @typedef {"uint8" | "int32" | "uint32" | "int64" | "uint64" | "float32" | "float64"} Scalar',
        " * @typedef {{ readonly offset: number; readonly type: Scalar; readonly length: number }} Member",
        " */",
        "",
        "/**",
        " * @template {Record<string, Member>} const Members",
        " * @param {number} size",
        " * @param {Members} members",
        " */",
        "function struct(size, members) {",
        "  return Object.freeze({ size, members });",
        "}",
        "",
    ]
    lines += [f"export const {name} = {value};" for name, value in api.constants if not JAVASCRIPT_LACKS.match(name)]
    for enum in api.enums:
        if JAVASCRIPT_LACKS.match(enum.name):
            continue
        name = enum.name.removeprefix("mjenv_").capitalize()
        lines += ["", f"export const {name} = /** @type {{const}} */ ({{"]
        lines += [f"  {enum.short(value)}: {number}," for value, number in enum.values]
        lines += ["});"]
    for struct in api.structs:
        if not JAVASCRIPT_LACKS.match(struct.name):
            lines += ["", *javascript_struct(api, struct)]
    functions = [one for one in api.functions if not JAVASCRIPT_LACKS.match(one.name)]
    lines += ["", "/**", " * The library's functions. Pointers are addresses in the library's memory.", " *"]
    lines += [" * @typedef {object} Functions", *(javascript_function(api, one) for one in functions), " */"]
    return "\n".join(lines) + "\n"


# ---- All languages ----

LANGUAGES: dict[str, tuple[str, Callable[[header.Header], str]]] = {
    "python": ("bindings/python/src/mjenv/capi/declarations.py", python_module),
    "python-task": ("bindings/python/src/mjenv/capi/task_declarations.py", python_task_module),
    "julia": ("bindings/julia/src/capi.jl", julia_module),
    "javascript": ("bindings/javascript/src/abi.js", javascript_module),
    "rust": ("bindings/rust/mjenv-sys/src/bindings.rs", rust_module),
}
for guest in header.GUESTS:
    name = guest.stem
    LANGUAGES |= {
        f"python-{name}": (f"extras/{name}/python/mjenv_{name}/declarations.py", partial(python_guest_module, guest)),
        f"julia-{name}": (f"extras/{name}/julia/capi.jl", partial(julia_guest_module, guest)),
        f"rust-{name}": (f"extras/{name}/rust/src/sys.rs", partial(rust_guest_module, guest)),
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only compare, and exit with 1 if a file is stale")
    parser.add_argument("languages", nargs="*", metavar="LANGUAGE", help=", ".join(LANGUAGES))
    arguments = parser.parse_args()
    unknown = set(arguments.languages) - set(LANGUAGES)
    if unknown:
        parser.error(f"unknown: {', '.join(sorted(unknown))}; the languages are {', '.join(LANGUAGES)}")
    api = header.parse()
    stale = False
    for language in arguments.languages or LANGUAGES:
        name, write = LANGUAGES[language]
        path, text = ROOT / name, write(api)
        if path.exists() and path.read_text(encoding="utf-8") == text:
            continue
        stale = True
        if arguments.check:
            print(f"{name} is stale: run tools/declarations.py", file=sys.stderr)
        else:
            path.write_text(text, encoding="utf-8")
            print(f"wrote {name}")
    return int(arguments.check and stale)


if __name__ == "__main__":
    sys.exit(main())
