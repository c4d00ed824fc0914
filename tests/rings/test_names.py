"""names.py finds each kind of use of a private name, and nothing in the programs as they are."""

import subprocess
import sys
from pathlib import Path

import pytest

CHECK = [sys.executable, str(Path(__file__).with_name("names.py"))]
OWN = "class A:\n    def __init__(self):\n        self._rows = 3\n\n    def rows(self):\n        return self._rows\n"


def found(extras: Path) -> str:
    return subprocess.run([*CHECK, extras], text=True, capture_output=True, check=False).stderr


def test_the_programs() -> None:
    subprocess.run(CHECK, check=True)


@pytest.mark.parametrize(
    ("file", "line", "use"),
    [
        ("python/mjenv_a/__init__.py", "print(envs._pool.rows)", "envs._pool"),
        ("python/mjenv_a/__init__.py", "print(env._rows)", "env._rows"),
        ("python/mjenv_a/__init__.py", "class A(Env):\n    def f(self):\n        return self._pool", "self._pool"),
        ("python/mjenv_a/__init__.py", "print(other._of_b)", "other._of_b"),
        ("python/mjenv_a/__init__.py", "from mjenv.capi.engine import _load", "mjenv.capi.engine: _load"),
        ("python/mjenv_a/__init__.py", "from mjenv_b._inner import name", "mjenv_b._inner: _inner"),
        ("python/mjenv_a/__init__.py", "import mjenv_b._inner", "mjenv_b._inner"),
        ("a.cpp", '#include "env/rows.hpp"', "env/rows.hpp"),
        ("a.cpp", '#include "../../capi/held.hpp"', "../../capi/held.hpp"),
        ("tests/a.c", '#include "b_own.h"', "b_own.h"),
    ],
)
def test_planted(tmp_path: Path, file: str, line: str, use: str) -> None:
    for name, text in (("a/own.hpp", ""), ("b/b_own.h", ""), ("b/python/mjenv_b/_inner.py", "_of_b = name = 1\n")):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    planted = tmp_path / "a" / file
    planted.parent.mkdir(parents=True, exist_ok=True)
    allowed = OWN if file.endswith(".py") else '#include "mjenv/mjenv.h"\n#include "error.hpp"\n#include "own.hpp"\n'
    planted.write_text(allowed)
    assert found(tmp_path) == ""
    planted.write_text(f"{allowed}\n{line}\n")
    number = (allowed + "\n" + line).count("\n") + 1
    assert found(tmp_path).splitlines()[1:] == [f"a/{file}{f':{number}' if file.endswith('.py') else ''}: {use}"]
