"""The package's modules do not import one another in circles, also not for types alone or inside of functions."""

import ast
import graphlib
from collections.abc import Iterator
from pathlib import Path

import mjenv

FOLDER = Path(mjenv.__file__).parent


def modules() -> dict[str, Path]:
    """All modules of the package by name."""
    found = {}
    for file in FOLDER.rglob("*.py"):
        parts = file.relative_to(FOLDER.parent).with_suffix("").parts
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


def test_no_circles() -> None:
    known = modules()
    assert "mjenv._handle" in known
    # Raises CycleError, which names the modules of the circle.
    graphlib.TopologicalSorter({name: set(imports(file, known)) for name, file in known.items()}).prepare()
