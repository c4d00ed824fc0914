from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def in_own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The commands write their files, and look for others, where they run."""
    monkeypatch.chdir(tmp_path)
