#!/usr/bin/env python3
"""Writes sbom.cdx.json, what is compiled into the library, from THIRD_PARTY_NOTICES.md and cmake/engine/sources.sha256.

sbom.py          write it (CycloneDX 1.5)
sbom.py --check  exit 1 if it is not what would be written
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BOM = ROOT / "sbom.cdx.json"


def rows() -> list[tuple[str, str, str, str]]:
    """Component, version, licence and copyright of each third party."""
    found = []
    for line in (ROOT / "THIRD_PARTY_NOTICES.md").read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("|") and len(cells) == 4 and cells[0] != "component" and not cells[0].startswith("--"):
            found.append((cells[0].partition(",")[0], cells[1], cells[2], cells[3]))
    return found


def archives() -> dict[str, tuple[str, str]]:
    """The archive and its SHA-256 by the name of what is in it: letters alone, in lower case."""
    found = {}
    for line in (ROOT / "cmake/engine/sources.sha256").read_text().splitlines():
        digest, name = line.split()
        found[letters(name.partition("_")[0])] = (name, digest)
    return found


def letters(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def component(name: str, version: str, licence: str, copyright: str) -> dict[str, object]:
    made: dict[str, object] = {
        "type": "library",
        "bom-ref": letters(name),
        "name": name,
        "version": version,
        "licenses": [{"expression": licence}],
        "copyright": copyright,
    }
    archive = archives().get(letters(name))
    if archive:
        hashes = [{"alg": "SHA-256", "content": archive[1]}]
        made["externalReferences"] = [{"type": "distribution", "url": archive[0], "hashes": hashes}]
    return made


def text() -> str:
    version = re.search(r"^project\(mjenv VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)
    assert version
    components = [component(*row) for row in rows()]
    bom = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": {
                "type": "library",
                "bom-ref": "mjenv",
                "name": "mjenv",
                "version": version[1],
                "licenses": [{"expression": "Apache-2.0"}],
            }
        },
        "components": components,
        "dependencies": [{"ref": "mjenv", "dependsOn": [made["bom-ref"] for made in components]}],
    }
    return json.dumps(bom, indent=2) + "\n"


def main() -> int:
    if sys.argv[1:] == ["--check"]:
        if BOM.exists() and BOM.read_text() == text():
            return 0
        print(f"{BOM.name} is out of date: run tools/sbom.py", file=sys.stderr)
        return 1
    BOM.write_text(text())
    return 0


if __name__ == "__main__":
    sys.exit(main())
