"""Fails if modules of a Python package import each other in a circle, also inside of functions or for types alone.

circles.py FOLDER...: the folders of packages.
"""

import ast
import graphlib
import sys
from collections.abc import Iterator
from pathlib import Path


def modules(folder: Path) -> dict[str, Path]:
    """All modules of the package by name."""
    found = {}
    for file in folder.rglob("*.py"):
        parts = file.relative_to(folder.parent).with_suffix("").parts
        found[".".join(parts).removesuffix(".__init__")] = file
    return found


def imports(file: Path, known: dict[str, Path]) -> Iterator[str]:
    """The modules of the package that a module imports."""
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module in known:
            of_package = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name if name in known else node.module for name in of_package)


def main() -> None:
    for folder in map(Path, sys.argv[1:]):
        known = modules(folder)
        try:
            graphlib.TopologicalSorter({name: set(imports(file, known)) for name, file in known.items()}).prepare()
        except graphlib.CycleError as error:
            sys.exit(f"{folder}: a circle of imports: {' <- '.join(error.args[1])}")


main()
