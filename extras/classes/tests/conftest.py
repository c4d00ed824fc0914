"""The option of the comparison, and quiet for it."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from mjenv import verify


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="ten times as many steps")


@pytest.fixture(autouse=True)
def in_quiet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """MuJoCo's warnings off, and what it writes goes to a folder of the test's own."""
    monkeypatch.chdir(tmp_path)
    with verify.quiet():
        yield
