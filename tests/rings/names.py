"""Fails if a program of extras/ uses what is private to the library, its wrapper or another program.

names.py [EXTRAS]: the folder of programs. Looked at are

- attributes `x._name`, where the wrapper or another program defines `_name`: of `self` and `cls` only those that the
  program itself defines may be used, of other objects none,
- imports of modules and names that begin with an underscore, unless they are the program's own,
- #include of headers that are neither the program's own nor public, nor what a second library compiles once more
  (mjenv_base in CMakeLists.txt), nor, in tests, those of tests/.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WRAPPER = ROOT / "bindings/python/src/mjenv"
PUBLIC = ("capi/include", "extras/*/include")
BASE = ("core/*.hpp", "core/system/*.hpp", "capi/handles.hpp", "capi/reasons.hpp")


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__") and not name.endswith("_")  # as ctypes has _fields_


def trees(folder: Path) -> dict[Path, ast.Module]:
    return {file: ast.parse(file.read_text("utf-8")) for file in sorted(folder.rglob("*.py"))}


def defined(modules: dict[Path, ast.Module]) -> set[str]:
    """The private names that modules define: functions, classes, variables, and attributes of self."""
    found = {file.stem for file in modules}
    for node in (node for module in modules.values() for node in ast.walk(module)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
            found.add(node.id if isinstance(node, ast.Name) else node.attr)
    return {name for name in found if is_private(name)}


def python_uses(folder: Path, others: set[str]) -> Iterator[str]:
    """others: the private names of the wrapper and of other programs."""
    modules = trees(folder)
    own = defined(modules)
    for file, module in modules.items():
        for node in ast.walk(module):
            used = []
            if isinstance(node, ast.Attribute) and node.attr in others:
                of_self = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")
                used = [] if of_self and node.attr in own else [ast.unparse(node)]
            elif isinstance(node, ast.Import):
                used = [one.name for one in node.names if any(map(is_private, one.name.split(".")))]
            elif isinstance(node, ast.ImportFrom) and not (node.module or "").startswith(folder.name):
                names = [*(node.module or "").split("."), *(one.name for one in node.names)]
                used = [f"{node.module}: {name}" for name in names if is_private(name)]
            yield from (f"{file.relative_to(folder.parents[2])}:{node.lineno}: {one}" for one in used)


def include_uses(guest: Path) -> Iterator[str]:
    public = [folder for pattern in PUBLIC for folder in ROOT.glob(pattern)]
    base = {str(file.relative_to(ROOT)).split("/", 1)[1] for pattern in BASE for file in ROOT.glob(pattern)}
    own = [guest, *(folder for folder in guest.rglob("*") if folder.is_dir())]
    of_tests = [folder for folder in ROOT.glob("tests/*") if folder.is_dir()]
    for file in sorted(guest.rglob("*.[ch]*")):
        if file.suffix not in (".c", ".h", ".cpp", ".hpp"):
            continue
        folders = [*own, *public, *(of_tests if "tests" in file.relative_to(guest).parts else [])]
        text = file.read_text("utf-8", "replace")
        for name in re.findall(r'^\s*#\s*include\s*"([^"]+)"', text, re.MULTILINE):
            if name not in base and (".." in name or not any((one / name).exists() for one in folders)):
                yield f"{file.relative_to(guest.parent)}: {name}"


def main() -> None:
    extras = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "extras"
    packages = sorted(folder for folder in extras.glob("*/python/*") if folder.is_dir())
    names = {package: defined(trees(package)) for package in packages}
    wrapper = defined(trees(WRAPPER))
    found = [
        use
        for package in packages
        for use in python_uses(package, wrapper.union(*(names[other] for other in packages if other != package)))
    ]
    found += [use for guest in sorted(extras.iterdir()) if guest.is_dir() for use in include_uses(guest)]
    if found:
        sys.exit("programs use private names:\n" + "\n".join(found))


main()
