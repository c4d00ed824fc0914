#!/usr/bin/env python3
"""Writes the inputs that a fuzz target starts from, beside its committed corpus: tests/fuzz/seeds.py FOLDER.

FOLDER/models, FOLDER/files and FOLDER/models.dict are made of the hostile models and the names in MJCF.
"""

from __future__ import annotations

import hashlib
import pathlib
import re
import sys

sys.path.append(str(pathlib.Path(__file__).parents[1] / "hostile"))
import models

# In the order of files.cpp.
KINDS = ("a.obj", "a.stl", "a.msh", "a.skn", "a.png", "a.bin", "h.png", "h.bin")
EXTENSIONS = {"obj": 0, "stl": 1, "msh": 2, "skn": 3, "png": 4, "bin": 5}
LARGEST = 20_000


def write(folder: pathlib.Path, content: bytes) -> None:
    if len(content) <= LARGEST:
        (folder / hashlib.sha1(content).hexdigest()[:16]).write_bytes(content)


def kind_of(name: str) -> int | None:
    name = name.lower()
    return KINDS.index(name) if name in KINDS else EXTENSIONS.get(name.rpartition(".")[2])


def main(folder: pathlib.Path) -> None:
    for name in ("models", "files"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for case in models.cases():
        xml = case.xml.encode() if isinstance(case.xml, str) else case.xml
        if not case.name.startswith("swept"):
            write(folder / "models", xml)
        for name, content in case.files.items():
            kind = kind_of(name)
            if kind is not None and isinstance(content, bytes):
                write(folder / "files", bytes([kind]) + content)
    texts = [models.RICH, *(path.read_text() for path in models.ASSETS.glob("*.xml"))]
    words = set(re.findall(r"[\w.-]+", " ".join(texts))) | set(models.NASTY)
    words |= {"include", "frame", "replicate", "<!--", "-->", "<![CDATA[", "&lt;", "&#x41;", "composite", "particle"}
    lines = [f'"{word}"' for word in sorted(words) if word and len(word) < 24]
    (folder / "models.dict").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
