#!/usr/bin/env python3
"""Compares the headers with those recorded of all versions: recorded/VERSION/mjenv/mjenv.h and task.h.

    frozen.py VERSION SONAME             compare; exit 1 when the interface is not VERSION's, or breaks an older one
    frozen.py VERSION SONAME --record    record the header as VERSION's; refused when CHANGELOG.md says it is released

Within one MJENV_ABI_VERSION an interface only grows: functions, enumerators, and fields at the end of structs, which
needs a new minor version. All else needs a new MJENV_ABI_VERSION, and that a new soname.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
RECORDED = HERE / "recorded"
sys.path.insert(0, str(ROOT / "tools"))

import header  # noqa: E402

Entries = dict[str, str]


def entries(api: header.Header) -> Entries:
    """Everything that a compiled client relies on, by name."""
    found = {f"constant {name}": str(value) for name, value in api.constants if name != "MJENV_ABI_VERSION"}
    found |= {f"opaque struct {name}": "" for name in api.opaques}
    for enum in api.enums:
        found |= {f"{enum.name} {name}": str(value) for name, value in enum.values}
    for struct in api.structs:
        found |= {f"{struct.name}[{i}]": f"{field.type} {field.name}" for i, field in enumerate(struct.fields)}
    for function in api.functions:
        parameters = ", ".join(str(parameter.type) for parameter in function.parameters)
        found[f"function {function.name}"] = f"{function.result} ({parameters})"
    return found


def abi(api: header.Header) -> int:
    return dict(api.constants)["MJENV_ABI_VERSION"]


def breaks(old: Entries, new: Entries) -> list[str]:
    """Lists the changes that break a client compiled with the old header."""
    gone = [f"{name} is gone" for name in old if name not in new]
    other = [f"{name} was {value}, is {new[name]}" for name, value in old.items() if new.get(name, value) != value]
    return gone + other


def version_of(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split("."))


def released(version: str) -> bool:
    """Whether the changelog has a heading for the version that does not call it unreleased."""
    heading = re.search(rf"^## {re.escape(version)}\b(.*)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)
    return heading is not None and "unreleased" not in heading[1]


def read(folder: Path) -> header.Header:
    """The headers of a folder. Versions of old may lack task.h."""
    return header.parse(*(folder / name for name in ("mjenv.h", "task.h") if (folder / name).is_file()))


def problems(version: str, soname: str) -> list[str]:
    api = read(header.PATH.parent)
    now = entries(api)
    found = []
    if not (RECORDED / version).is_dir():
        found.append(f"nothing is recorded of {version}: build the target abi_record")
    for folder in sorted(RECORDED.glob("*.*.*")):
        old_api = read(folder / "mjenv")
        old, old_abi = entries(old_api), abi(old_api)
        broken = breaks(old, now)
        grown = sorted(now.keys() - old.keys())
        if folder.name == version:
            found += [*broken, *(f"{name} is new" for name in grown)]
            if old_abi != abi(api):
                found.append(f"MJENV_ABI_VERSION was {old_abi}, is {abi(api)}")
            if (folder / "soname.txt").read_text(encoding="utf-8").strip() != soname:
                found.append(f"the soname is {soname}, not what is recorded")
            continue
        if version_of(folder.name) > version_of(version):
            found.append(f"{folder.name} is recorded, and newer than {version}")
        if broken and old_abi == abi(api):
            found += [f"breaks {folder.name} without a new MJENV_ABI_VERSION: {what}" for what in broken]
        if grown and version_of(folder.name)[:2] == version_of(version)[:2]:
            found += [f"new since {folder.name}, which needs a new minor version: {name}" for name in grown]
        if old_abi != abi(api) and (folder / "soname.txt").read_text(encoding="utf-8").strip() == soname:
            found.append(f"{soname} was {folder.name}'s, of another MJENV_ABI_VERSION")
    return found


def record(version: str, soname: str) -> None:
    folder = RECORDED / version
    if folder.is_dir() and released(version) and problems(version, soname):
        sys.exit(f"{version} is released, its interface stays: raise the version in CMakeLists.txt first")
    (folder / "mjenv").mkdir(parents=True, exist_ok=True)
    for path in header.PATH.parent.glob("*.h"):
        shutil.copyfile(path, folder / "mjenv" / path.name)
    (folder / "soname.txt").write_text(soname + "\n", encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description="Compare the header with the versions recorded of it.")
    parser.add_argument("version")
    parser.add_argument("soname")
    parser.add_argument("--record", action="store_true")
    arguments = parser.parse_args()
    if arguments.record:
        record(arguments.version, arguments.soname)
    found = problems(arguments.version, arguments.soname)
    for problem in found:
        print(problem, file=sys.stderr)
    if found:
        print("If this is meant: build the target abi_record; docs/abi.md has the rules", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
