"""Loads the plug-in of this folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--engine", default="2.2.2", help="the version of MuJoCo for the policy and the twin")


@pytest.fixture(scope="session")
def engine(request: pytest.FixtureRequest) -> str:
    return str(request.config.getoption("--engine", "2.2.2"))


@pytest.fixture(scope="session", autouse=True)
def plugin(load_plugin: Callable[[str], Path]) -> Path:
    return load_plugin("quadruped")
