#!/usr/bin/env python3
"""Every constant, enumerator and field of a struct in the headers is in the table: complete.py TABLE."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent.parent / "tools"))

import header


def main() -> int:
    api = header.parse(header.PATH, header.TASK)
    table = Path(sys.argv[1]).read_text(encoding="utf-8").splitlines()
    wanted = [f"value {name} {value}" for enum in api.enums for name, value in enum.values]
    wanted += [f"{name} {value}" for name, value in api.constants]
    missing = [line for line in wanted if line not in table]
    for struct in api.structs:
        names = [f"struct {struct.name} ", *(f"field {struct.name} {field.name} at " for field in struct.fields)]
        missing += [name for name in names if not any(line.startswith(name) for line in table)]
    for line in missing:
        print(f"layout.c does not print: {line}", file=sys.stderr)
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
