"""Tasks that are compared with those of tests/live, in its quiet."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from mjenv import verify

sys.path.append(str(Path(__file__).parents[4] / "tests/live"))  # test_tasks.py, test_walk.py


@pytest.fixture(autouse=True)
def in_quiet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """MuJoCo's warnings off, and anything written goes to a folder of the test's own."""
    monkeypatch.chdir(tmp_path)
    with verify.quiet():
        yield
