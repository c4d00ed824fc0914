"""python -m mjenv_jax.build: compiles the handlers with the headers of jaxlib and of mjenv."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import jax.ffi

import mjenv

HERE = Path(__file__).resolve().parent


def library() -> Path:
    """The compiled handlers, which it compiles if they are missing or older than their source."""
    # An older jaxlib refuses what the headers of a newer one compile to.
    source, made = HERE / "handlers.cpp", HERE / f"libmjenv-jax-{jax.lib.__version__}.so"
    if not made.exists() or made.stat().st_mtime < source.stat().st_mtime:
        partial = made.with_suffix(f".{os.getpid()}.so")
        command = [os.environ.get("CXX", "c++"), "-std=c++17", "-O2", "-fPIC", "-shared"]
        includes = [f"-I{_headers()}", "-isystem", jax.ffi.include_dir()]
        subprocess.run([*command, *includes, str(source), "-o", str(partial)], check=True)
        partial.replace(made)
    return made


def _headers() -> Path:
    """The folder of mjenv/mjenv.h: MJENV_INCLUDE, that of the installed package, or that of the source tree."""
    places = Path(mjenv.__file__).parent / "include", HERE.parents[3] / "capi" / "include"
    given = os.environ.get("MJENV_INCLUDE")
    return Path(given) if given else next((folder for folder in places if folder.exists()), places[-1])


if __name__ == "__main__":
    print(library())
