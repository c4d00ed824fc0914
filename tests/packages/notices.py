#!/usr/bin/env python3
"""Compares the notices with the files that the compiler read: notices.py NINJA BUILD SOURCES

Every third party is in THIRD_PARTY_NOTICES.md and nothing else is, with its version, licences and holders of copyright.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "tools"))
import sbom

# What a licence's text says, and by which of its names here it may go.
LICENCES = {
    "Mozilla Public": ("MPL-2.0",),
    "Apache License": ("Apache-2.0",),
    "Redistribution and use in source and binary": ("BSD-2-Clause", "BSD-3-Clause"),
    "Neither the name": ("BSD-3-Clause",),
    "altered source versions must be plainly marked": ("Zlib",),
    "Permission is hereby granted, free of charge": ("MIT",),
    "General Public License": (),
}
# Among the first lines of a file, where licences are.
HEAD = 4000
COPYRIGHT = re.compile(
    r"copyright (?:\(c\) ?)?(\d{4})(?:-(?:\d{4}|present))?(?:, ?\d{4})*,? *(?:by )?([^\n<(]+)", re.IGNORECASE
)


def compiled(ninja: str, build: str) -> set[Path]:
    """The files that the library's objects were compiled from."""
    lines = subprocess.run([ninja, "-C", build, "-t", "deps"], check=True, capture_output=True, text=True).stdout
    found: set[Path] = set()
    wanted = False
    for line in lines.splitlines():
        if line and not line.startswith(" "):
            wanted = re.match(r"CMakeFiles/mjenv(_core|_engine|_math)?\.dir/", line) is not None
        elif wanted and line.strip():
            found.add((Path(build) / line.strip()).resolve())
    return found


def component_of(path: Path, sources: Path) -> str | None:
    """The third party that a file is of; None for this project, the compiler and the system's C and C++ headers."""
    if path.is_relative_to(sources):
        parts = path.relative_to(sources).parts
        return "glad" if "glad" in parts else sbom.letters(parts[0])
    if "eigen3" in path.parts:
        return "eigen"
    if "nlohmann" in path.parts:
        return sbom.letters("JSON for Modern C++")
    ours = path.is_relative_to(sbom.ROOT)
    system = re.match(
        r"/usr/(lib(/llvm-\d+)?/(gcc|clang|lib/clang)|include/(c\+\+|\w+-linux-gnu|linux|asm-generic|[\w-]+\.h$))",
        str(path),
    )
    return None if ours or system else f"unknown: {path}"


def versions(files: set[Path], sources: Path) -> dict[str, str]:
    """As the sources tell them."""
    found = {}
    for name, (archive, _) in sbom.archives().items():
        version = re.sub(r"\.orig\..*|\+dfsg", "", archive.partition("_")[2])
        snapshot = re.search(r"git(\d{8})", version)
        found[name] = snapshot[1] if snapshot else version.replace("~", "")
    macros = next(path for path in files if path.name == "Macros.h" and "eigen3" in path.parts).read_text()
    numbers = (re.search(rf"#define EIGEN_{part}_VERSION (\d+)", macros) for part in ("WORLD", "MAJOR", "MINOR"))
    found["eigen"] = ".".join(number[1] for number in numbers if number)
    return found


def wrong(files: set[Path], sources: Path) -> list[str]:
    parts: dict[str, set[Path]] = defaultdict(set)
    for path in files:
        name = component_of(path, sources)
        if name:
            parts[name].add(path)
    noted = {sbom.letters(row[0]): row for row in sbom.rows()}
    says = [f"{name} is compiled in, and not noted" for name in parts if name not in noted]
    says += [f"{name} is noted, and not compiled in" for name in noted if name not in parts]
    for name, version in versions(files, sources).items():
        if name in noted and noted[name][1] != version:
            says.append(f"{name}: {version} is compiled in, {noted[name][1]} is noted")
    for name in parts.keys() & noted.keys():
        _, _, licence, holders = noted[name]
        for path in sorted(parts[name]):
            head = path.read_text(errors="replace")[:HEAD]
            for words, names in LICENCES.items():
                if words in head and not any(known in licence for known in names):
                    says.append(f"{name}: {path} says {words!r}, noted is {licence}")
            for _, holder in COPYRIGHT.findall(head):
                holder = re.sub(r"[\s.*/]+$|All [Rr]ights.*| <.*", "", holder).strip(" .,")
                if holder not in holders and "and others" not in holders:
                    says.append(f"{name}: {path} is of {holder!r}, noted are {holders}")
    return says


def main() -> int:
    ninja, build, sources = sys.argv[1:]
    files = compiled(ninja, build)
    assert len(files) > 200, f"{len(files)} files: is {build} built by ninja?"
    says = wrong(files, Path(sources).resolve())
    print("\n".join(says))
    return int(bool(says))


if __name__ == "__main__":
    sys.exit(main())
