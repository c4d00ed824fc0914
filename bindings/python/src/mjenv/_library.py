"""Finds and loads libmjenv.so: the file that MJENV_LIBRARY names, else the one inside the package."""

import os
from pathlib import Path

from mjenv import _abi

VARIABLE = "MJENV_LIBRARY"


def _load() -> _abi.Library:
    bundled = Path(__file__).parent / "libmjenv.so"
    path = os.environ.get(VARIABLE) or str(bundled)
    if path == str(bundled) and not bundled.exists():
        raise ImportError(
            f"mjenv: this installation holds no {bundled.name}. Install the package with pip, which builds it, "
            f"or set the environment variable {VARIABLE} to the path of a built one."
        )
    try:
        library = _abi.Library(path)
    except OSError as error:
        raise ImportError(f"mjenv: cannot load {path}: {error}") from error
    except AttributeError as error:
        raise ImportError(f"mjenv: {path} is not the library of this package: {error}") from error
    version = library.mjenv_abi_version()
    if version != _abi.ABI_VERSION:
        raise ImportError(f"mjenv: {path} has ABI version {version}; this package needs {_abi.ABI_VERSION}")
    return library


LIBRARY = _load()
