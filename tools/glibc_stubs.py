#!/usr/bin/env python3
"""Makes libraries to link with in place of a newer glibc: glibc_stubs.py VERSION TARGET OUTPUT LIBRARY...

For each LIBRARY of glibc, OUTPUT gets one of the same name and soname that contains no code. It has the symbols of
VERSION and older, each in its newest version among those. So what is linked with it needs no newer glibc: exp of 2.29,
for instance, is not there, and exp of 2.2.5 is.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

# Compilers make one call of sincos of a sin and a cos, but Gymnasium's MuJoCo calls sin and cos. In older versions of
# glibc, 2.31 for one, these compute with FMA where the CPU has it, and sincos never does, so its bits differ.
# tools/setup adds a sincos that calls the C library's where its bits are equal.
LEFT_OUT = {"sincos"}


class Symbol(NamedTuple):
    name: str
    version: str
    kind: str
    size: int


def number(version: str) -> tuple[int, ...]:
    """Of GLIBC_2.2.5, for instance: (2, 2, 5)."""
    return tuple(int(part) for part in version.removeprefix("GLIBC_").split("."))


def symbols(library: Path, limit: tuple[int, ...]) -> list[Symbol]:
    """What a program can be linked with in a library of that version."""
    lines = subprocess.run(
        ["readelf", "--dyn-syms", "--wide", library], check=True, capture_output=True, text=True
    ).stdout.splitlines()
    newest: dict[str, Symbol] = {}
    linkable = set()  # the others are there for old programs alone
    for line in lines:
        found = re.match(r" *\d+: \w+ +(\w+) +(\w+) +\w+ +\w+ +(\w+) +(\w+)(@@?)(GLIBC_[\d.]+)$", line)
        if not found or found[3] == "UND":
            continue
        size, kind, _, name, default, version = found.groups()
        if default == "@@":
            linkable.add(name)
        known = newest.get(name)
        if name in LEFT_OUT or number(version) > limit:
            continue
        if known is None or number(known.version) < number(version):
            newest[name] = Symbol(name, version, kind, int(size, 0))
    return [symbol for name, symbol in sorted(newest.items()) if name in linkable]


def assembly(found: list[Symbol]) -> str:
    lines = []
    for i, symbol in enumerate(found):
        variable = symbol.kind == "OBJECT"
        lines += [
            f".section {'.bss' if variable else '.text'}",
            f".globl stub{i}",
            f".type stub{i}, %{'object' if variable else 'function'}",
            f".symver stub{i}, {symbol.name}@@{symbol.version}, remove",
            f"stub{i}: .skip {max(symbol.size, 1) if variable else 1}",
            f".size stub{i}, . - stub{i}",
        ]
    return "\n".join(lines) + "\n"


def main() -> None:
    version, target, output = sys.argv[1:4]
    for library in map(Path, sys.argv[4:]):
        found = symbols(library, number(version))
        assert found, f"{library} has no symbols of glibc {version}"
        stub = Path(output, library.name)
        code, versions = stub.with_suffix(".s"), stub.with_suffix(".map")
        code.write_text(assembly(found))
        names = sorted({symbol.version for symbol in found}, key=number)
        versions.write_text("".join(f"{name} {{}};\n" for name in names))
        command = ["clang-19", f"--target={target}", "-fuse-ld=lld", "-shared", "-nostdlib"]
        command += [f"-Wl,-soname,{library.name}", f"-Wl,--version-script={versions}"]
        subprocess.run([*command, "-o", stub, code], check=True)
        code.unlink()
        versions.unlink()


if __name__ == "__main__":
    main()
