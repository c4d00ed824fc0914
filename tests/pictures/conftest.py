"""Options of the comparison of pictures."""

from __future__ import annotations

import os

# Gymnasium and the library read it when they first draw.
os.environ.setdefault("MUJOCO_GL", "egl")

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="both sizes with each camera, and a thousand pictures")


def pytest_report_header() -> str:
    return f"pictures by {os.environ['MUJOCO_GL']}"


@pytest.fixture
def long(request: pytest.FixtureRequest) -> bool:
    return request.config.getoption("--long")


@pytest.fixture(autouse=True)
def in_quiet(tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo's log goes to a folder of the test's own."""
    monkeypatch.chdir(str(tmp_path))
