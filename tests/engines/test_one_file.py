"""The default build is one small file that needs only the C and C++ runtimes and exports only its own functions."""

import os
import shutil
import subprocess
from pathlib import Path

LIBRARY = Path(os.environ["MJENV_LIBRARY"]).resolve()
RUNTIMES = {
    "libc.so.6",
    "libm.so.6",
    "libdl.so.2",
    "libpthread.so.0",
    "libstdc++.so.6",
    "libgcc_s.so.1",
    "ld-linux-x86-64.so.2",
}
MOST_BYTES = 6_000_000


def output(*command: str | Path) -> list[str]:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()


def test_needs_the_runtimes_alone() -> None:
    dynamic = output("readelf", "--dynamic", "--wide", LIBRARY)
    needed = {line.split("[")[1].rstrip("]") for line in dynamic if "(NEEDED)" in line}
    assert "libc.so.6" in needed
    assert needed <= RUNTIMES


def test_shows_its_own_functions_alone() -> None:
    names = [line.split()[-1].split("@")[0] for line in output("nm", "--dynamic", "--defined-only", LIBRARY)]
    assert "mjenv_step" in names
    assert [name for name in names if not name.startswith("mjenv_")] == []


def test_is_small(tmp_path: Path) -> None:
    stripped = shutil.copy(LIBRARY, tmp_path / "stripped.so")
    subprocess.run(["strip", "--strip-unneeded", stripped], check=True)
    assert stripped.stat().st_size < MOST_BYTES
