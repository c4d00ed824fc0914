"""Which modules of the package import which, also inside of functions, but not for types alone."""

import ast
import graphlib
import re
import subprocess
import sys
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


def executed(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes below a node, without what type checkers alone read."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and isinstance(child.test, ast.Name) and child.test.id == "TYPE_CHECKING":
            continue
        yield child
        yield from executed(child)


def imports(file: Path, known: dict[str, Path]) -> Iterator[str]:
    """The modules of the package that a module imports."""
    for node in executed(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module in known:
            of_package = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name if name in known else node.module for name in of_package)


def test_no_circles() -> None:
    known = modules()
    assert "mjenv.capi.handle" in known
    # Raises CycleError, which names the modules of the circle.
    graphlib.TopologicalSorter({name: set(imports(file, known)) for name, file in known.items()}).prepare()


def test_names_are_imported_when_they_are_used() -> None:
    """mjenv imports each name from the module from which type checkers do, and Python lists all names."""
    tree = ast.parse((FOLDER / "__init__.py").read_text("utf-8"))
    checked = next(node for node in tree.body if isinstance(node, ast.If))
    assert ast.unparse(checked.test) == "TYPE_CHECKING"
    homes = {
        alias.name: str(node.module).removeprefix("mjenv.")
        for node in checked.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    homes.update(make="gym.make", make_vec="gym.make_vec")  # type checkers read _overloads.pyi
    assert homes == mjenv._MODULES
    assert sorted(homes) == mjenv.__all__
    assert set(mjenv.__all__) <= set(dir(mjenv))
    assert all(getattr(mjenv, name) is getattr(mjenv, name) for name in mjenv.__all__)
    assert not hasattr(mjenv, "nothing")
    # Each of these modules is there, or says what it needs.
    for load in (lambda: mjenv.task.jit, lambda: mjenv.jit, lambda: mjenv.task.locomotion, lambda: mjenv.sb3):
        try:
            assert load().__doc__
        except ImportError as error:
            assert re.search(r"mjenv\.(task\.jit|sb3) needs .*pip install", str(error))  # noqa: PT017
    command = [sys.executable, "-c", "import sys, mjenv; print(*sys.modules); mjenv.errors.Error; mjenv.Kind"]
    imported = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert "mjenv.capi.engine" in imported
    assert not {"numpy", "gymnasium"} & set(imported)
