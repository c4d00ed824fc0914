"""Type checkers accept the Python code of the READMEs: runs mypy over each page's blocks, which are one program.

Other pages use one name for objects of several types, which mypy refuses.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import blocks

PAGES = ("README.md", "bindings/python/README.md")
SOURCE = blocks.ROOT / "bindings" / "python" / "src"
OPTIONS = ("--config-file=", "--no-error-summary")


def write_program(page: str, folder: Path) -> Path:
    """A page's code, in which each line has the number that it has on the page."""
    lines: list[str] = []
    for block in blocks.blocks_of(page):
        if block.language == "python":
            lines += [""] * (block.line - len(lines)) + block.text.splitlines()
    if not lines:
        raise ValueError(f"{page} has no block of Python")
    program = folder / f"{page.replace('/', '_')}.py"
    program.write_text("\n".join(lines) + "\n")
    return program


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        programs = [str(write_program(page, Path(folder))) for page in PAGES]
        command = [sys.executable, "-m", "mypy", *OPTIONS, *programs]
        return subprocess.run(command, cwd=folder, env={"MYPYPATH": str(SOURCE)}, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
