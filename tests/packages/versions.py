#!/usr/bin/env python3
"""Compares every version number with the one in CMakeLists.txt.

versions.py          compare; exit 1 when one differs
versions.py --write  change them all after a change of CMakeLists.txt
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Each file and what stands around its version.
PLACES = (
    ("bindings/rust/mjenv/Cargo.toml", r'(?m)^version = "(.+)"$'),
    ("bindings/rust/mjenv/Cargo.toml", r'mjenv-sys = \{ path = "../mjenv-sys", version = "(.+?)"'),
    ("bindings/rust/mjenv-sys/Cargo.toml", r'(?m)^version = "(.+)"$'),
    ("bindings/rust/mjenv-ndarray/Cargo.toml", r'(?m)^version = "(.+)"$'),
    ("bindings/rust/mjenv-ndarray/Cargo.toml", r'mjenv = \{ path = "../mjenv", version = "(.+)" \}'),
    *(
        (str(file.relative_to(ROOT)), pattern)
        for file in sorted(ROOT.glob("extras/*/rust/Cargo.toml"))
        for pattern in (r'(?m)^version = "(.+)"$', r'/mjenv", version = "(.+)"', r'/mjenv-sys", version = "(.+)"')
    ),
    ("bindings/rust/Cargo.lock", r'name = "mjenv"\nversion = "(.+)"'),
    ("bindings/rust/Cargo.lock", r'name = "mjenv-sys"\nversion = "(.+)"'),
    ("examples/rust/Cargo.lock", r'name = "mjenv"\nversion = "(.+)"'),
    ("examples/rust/Cargo.lock", r'name = "mjenv-sys"\nversion = "(.+)"'),
    ("bindings/julia/Project.toml", r'(?m)^version = "(.+)"$'),
    ("bindings/javascript/package.json", r'"version": "(.+)"'),
    ("CHANGELOG.md", r"\A# Changelog\n\n## (\S+)"),
)


def main() -> int:
    text = (ROOT / "CMakeLists.txt").read_text()
    found = re.search(r"^project\(mjenv VERSION (\S+)", text, re.MULTILINE)
    assert found
    version = found[1]
    wrong = 0
    for name, pattern in PLACES:
        path = ROOT / name
        text = path.read_text()
        found = re.search(pattern, text)
        if found and found[1] == version:
            continue
        if found and "--write" in sys.argv and name != "CHANGELOG.md":
            path.write_text(text[: found.start(1)] + version + text[found.end(1) :])
            continue
        print(f"{name}: {found[1] if found else 'no version'}, but CMakeLists.txt has {version}")
        wrong += 1
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
