"""The page where the robots run in the browser: extras/page/build makes it."""

from __future__ import annotations

import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def files() -> dict[str, Path]:
    """The files of the page, by their place in the site."""
    built = ROOT / "build" / "play"
    subprocess.run([ROOT / "extras" / "page" / "build"], check=True)
    return {f"play/{path.relative_to(built)}": path for path in sorted(built.rglob("*")) if path.is_file()}
