#!/usr/bin/env python3
"""Runs clang-tidy on the sources in core/, capi/ and the libraries of extras/, after they were compiled by Ninja.

    tidy.py BUILD CACHE [--deep]

With --deep, clang's static analyzer follows calls into larger functions and more ways through each of them, which takes
four times as long.

A file that passed is checked again when a file that it reads, its compiler options or clang-tidy's settings change.
The folder CACHE has an empty file for each check that passed, named by a hash of all that the check depends on. Clones
on the same machine can share it.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Options of gcc that clang does not know.
GCC_OPTIONS = re.compile(r" (-fno-gnu-unique|--param=\S+)")
SHALLOW = ("-Xclang", "-analyzer-config", "-Xclang", "mode=shallow")


@cache
def digest(path: Path) -> bytes:
    return hashlib.sha256(path.read_bytes()).digest()


def inputs(build: Path) -> dict[str, list[Path]]:
    """The files that the compiler read for each object, by the object's path."""
    text = subprocess.run(["ninja", "-C", build, "-t", "deps"], check=True, capture_output=True, text=True).stdout
    found = {}
    for block in text.split("\n\n"):
        head, *files = block.splitlines() or [""]
        found[head.partition(":")[0]] = [build / file.strip() for file in files]
    return found


def main() -> int:
    build = Path(sys.argv[1]).resolve()
    depth = [] if "--deep" in sys.argv[3:] else [f"--extra-arg={word}" for word in SHALLOW]
    folder = build / "lint"
    passed = Path(sys.argv[2])
    folder.mkdir(exist_ok=True)
    passed.mkdir(parents=True, exist_ok=True)
    commands = json.loads(GCC_OPTIONS.sub("", (build / "compile_commands.json").read_text()))
    (folder / "compile_commands.json").write_text(json.dumps(commands))
    version = subprocess.run(["clang-tidy", "--version"], check=True, capture_output=True).stdout
    settings = version + (ROOT / ".clang-tidy").read_bytes() + " ".join(depth).encode()
    read = inputs(build)

    def stamp(command: dict[str, str]) -> Path:
        """The file that exists if this check has passed."""
        target = re.search(r" -o (\S+)", command["command"])
        files = read.get(target[1], []) if target else []
        if not files:
            raise SystemExit(f"tidy.py: {command['file']} is not compiled: run cmake --build {build}")
        contents = b"".join(digest(file) for file in files)
        # Without the paths of this clone and of this build.
        options = command["command"].replace(str(build), "BUILD").replace(str(ROOT), "ROOT")
        return passed / hashlib.sha256(settings + options.encode() + contents).hexdigest()

    def check(command: dict[str, str]) -> bool:
        done = subprocess.run(
            ["clang-tidy", "-p", folder, "--quiet", *depth, command["file"]], capture_output=True, text=True, cwd=ROOT
        )
        if done.returncode:
            print(done.stdout + done.stderr, flush=True)
        else:
            stamp(command).touch()
        return done.returncode == 0

    folders = {ROOT / "core", ROOT / "capi", *(include.parent for include in ROOT.glob("extras/*/include"))}
    ours = [c for c in commands if folders & set(Path(c["file"]).parents) and "/tests/" not in c["file"]]
    changed = [command for command in ours if not stamp(command).exists()]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        fine = list(pool.map(check, changed))
    print(f"clang-tidy: {len(ours)} files, of which {len(ours) - len(changed)} passed before; {fine.count(False)} fail")
    return int(not all(fine))


if __name__ == "__main__":
    sys.exit(main())
