"""Which modules importing the package imports."""

import ast
import subprocess
import sys
from pathlib import Path

import mjenv

FOLDER = Path(mjenv.__file__).parent


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
    command = [sys.executable, "-c", "import sys, mjenv; print(*sys.modules); mjenv.errors.Error; mjenv.Kind"]
    imported = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert "mjenv.capi.engine" in imported
    assert not {"numpy", "gymnasium"} & set(imported)
