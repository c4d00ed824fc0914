"""The declarations are those of the header."""

import ctypes
import re
import subprocess
import sys
from pathlib import Path

from mjenv.capi import declarations
from mjenv.capi.engine import ENGINES

ROOT = Path(__file__).resolve().parents[3]
HEADER = (ROOT / "capi/include/mjenv/mjenv.h").read_text()


def test_the_committed_files_are_fresh() -> None:
    subprocess.run([sys.executable, str(ROOT / "tools/declarations.py"), "--check", "python"], check=True)


def test_every_function_and_struct_of_the_header_is_declared() -> None:
    library = ENGINES.get()
    functions = set(re.findall(r"^MJENV_API .*?(mjenv_\w+)\(", HEADER, re.M))
    assert len(functions) > 30
    for name in functions:
        assert getattr(library, name).argtypes is not None, name
    structs = set(re.findall(r"^\} (mjenv_\w+);", HEADER, re.M)) - set(re.findall(r"typedef enum (mjenv_\w+)", HEADER))
    assert {"mjenv_batch", "mjenv_option", "mjenv_field", "mjenv_space", "mjenv_spec"} <= structs
    for name in structs:
        assert issubclass(getattr(declarations, name), ctypes.Structure)


def test_status_names() -> None:
    for status in declarations.Status:
        assert ENGINES.get().mjenv_status_name(status) == f"MJENV_{status.name}".encode()
