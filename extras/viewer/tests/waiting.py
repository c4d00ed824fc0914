"""Waits for what other threads and the browser do."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

# After so many seconds something hangs. A busy machine may take long, so no test is decided by less.
HANGS = 300


def wait_until(condition: Callable[[], Any], what: str) -> None:
    end = time.monotonic() + HANGS
    while not condition():
        assert time.monotonic() < end, f"not within {HANGS} s: {what}"
        time.sleep(0.02)
