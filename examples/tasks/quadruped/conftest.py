"""Builds the plug-in against an installed mjenv, in a folder of its own, and loads it."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

import mjenv

HERE = Path(__file__).resolve().parent


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--engine", default="2.2.2", help="the version of MuJoCo for the policy and the twin")


@pytest.fixture(scope="session")
def engine(request: pytest.FixtureRequest) -> str:
    return str(request.config.getoption("--engine", "2.2.2"))


@pytest.fixture(scope="session", autouse=True)
def plugin(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, prefix = tmp_path_factory.mktemp("tasks") / "quadruped", tmp_path_factory.mktemp("prefix")
    shutil.copytree(HERE, folder)
    for command in (
        ["cmake", "--install", Path(os.environ["MJENV_LIBRARY"]).resolve().parent, "--prefix", prefix],
        ["cmake", "-S", folder, "-B", folder / "build", f"-DCMAKE_PREFIX_PATH={prefix}"],
        ["cmake", "--build", folder / "build"],
    ):
        done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    mjenv.load_tasks(folder / "build" / "libquadruped.so")
    return folder / "build" / "libquadruped.so"
