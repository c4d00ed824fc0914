"""The recordings of dm_control's episodes, for machines without it, are what dm_control gives."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

GOLDEN = Path(__file__).resolve().parent / "golden"


def test_recordings() -> None:
    subprocess.run([sys.executable, GOLDEN / "record.py", "--check"], check=True, cwd=GOLDEN)
