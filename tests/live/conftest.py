"""Options of the live comparison, and quiet for it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import mjenv
from mjenv import verify

# The ids of Gymnasium, listed before the tests register tasks of their own.
IDS = mjenv.ids()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--option-sets", type=int, default=6, help="option sets an id, the defaults included")
    parser.addoption("--seeds", type=int, default=2, help="runs an option set")
    parser.addoption("--steps", type=int, default=250, help="steps a run")
    parser.addoption("--draw", type=int, default=0, help="seed of the drawing of options")
    parser.addoption("--long", action="store_true", help="20 option sets an id, two seeds, 1000 steps")


def pytest_report_header() -> str:
    return verify.versions()


@pytest.fixture(autouse=True)
def in_quiet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """MuJoCo's warnings off, and anything written goes to a folder of the test's own."""
    monkeypatch.chdir(tmp_path)
    with verify.quiet():
        yield
