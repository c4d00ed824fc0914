"""Lets mjenv find the libraries of both engines: build/libmjenv.so and build/mujoco4/libmjenv-mujoco4.so."""

import os
from pathlib import Path

BUILD = Path(__file__).resolve().parents[2] / "build"
FOLDER = BUILD / "mujoco4" / "both"

FOLDER.mkdir(parents=True, exist_ok=True)
for library in (BUILD / "libmjenv.so", BUILD / "mujoco4" / "libmjenv-mujoco4.so"):
    assert library.exists(), f"{library} is missing"
    link = FOLDER / library.name
    link.unlink(missing_ok=True)
    link.symlink_to(library)
# These are read when mjenv and MuJoCo are imported.
os.environ["MJENV_LIBRARY"] = str(FOLDER / "libmjenv.so")
os.environ.setdefault("MUJOCO_GL", "egl")
