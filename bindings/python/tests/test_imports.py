"""Which modules of the package import which, also inside of functions, but not for types alone."""

import ast
import graphlib
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
    """The nodes below a node, without what type checkers alone read, and without the viewer where a function imports
    it: it needs viser, so it is imported when it is used."""
    for child in ast.iter_child_nodes(node):
        is_lazy = isinstance(child, ast.ImportFrom) and isinstance(node, ast.FunctionDef | ast.Try)
        if is_lazy and str(getattr(child, "module", "")).startswith("mjenv.viewer"):
            continue
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
    assert "mjenv._handle" in known
    # Raises CycleError, which names the modules of the circle.
    graphlib.TopologicalSorter({name: set(imports(file, known)) for name, file in known.items()}).prepare()


def test_the_command_line_uses_the_public_package() -> None:
    """Nothing private of mjenv, and importing mjenv does not import it."""
    known = modules()
    command_line = {name: file for name, file in known.items() if f"{name}.".startswith("mjenv.cli.")}
    assert len(command_line) > 10
    for name, file in known.items():
        of_command_line = [used for used in imports(file, known) if used in command_line]
        if name in command_line:
            assert not [used for used in imports(file, known) if used.startswith("mjenv._")], name
            attributes = {node.attr for node in ast.walk(ast.parse(file.read_text("utf-8"))) if is_foreign(node)}
            assert not attributes & {"_rows", "_pool"}, name
        else:
            assert not of_command_line or name == "mjenv.__main__", name


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
    homes.update(make="_make", make_vec="_make_vec")  # type checkers read _overloads.pyi
    assert homes == mjenv._MODULES
    assert sorted(homes) == mjenv.__all__
    assert set(mjenv.__all__) <= set(dir(mjenv))
    assert all(getattr(mjenv, name) is getattr(mjenv, name) for name in mjenv.__all__)
    assert not hasattr(mjenv, "nothing")
    command = [sys.executable, "-c", "import sys, mjenv; print(*sys.modules); mjenv.errors.Error; mjenv.policy.Policy"]
    imported = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert "mjenv._engine" in imported
    assert not {"numpy", "gymnasium"} & set(imported)


def is_foreign(node: ast.AST) -> bool:
    """Whether a node is an attribute of something else than self."""
    return isinstance(node, ast.Attribute) and not (isinstance(node.value, ast.Name) and node.value.id == "self")
