"""Builds the plug-ins of the folders against an installed mjenv."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

import mjenv

HERE = Path(__file__).resolve().parent


@pytest.fixture(scope="session")
def load_plugin(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Builds the plug-in of a folder in a copy of it, and loads it. Returns its path."""

    def load(name: str) -> Path:
        folder, prefix = tmp_path_factory.mktemp("tasks") / name, tmp_path_factory.mktemp("prefix")
        shutil.copytree(HERE / name, folder)
        for command in (
            ["cmake", "--install", Path(os.environ["MJENV_LIBRARY"]).resolve().parent, "--prefix", prefix],
            ["cmake", "-S", folder, "-B", folder / "build", f"-DCMAKE_PREFIX_PATH={prefix}"],
            ["cmake", "--build", folder / "build"],
        ):
            done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stdout + done.stderr
        plugin = folder / "build" / f"lib{name}.so"
        mjenv.load_tasks(plugin)
        return plugin

    return load
