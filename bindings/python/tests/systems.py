"""Marks for tests of what not every system has. pytest prints the reasons of those that it leaves out."""

import sys

import pytest

WINDOWS = sys.platform == "win32"


def not_on_windows(reason: str) -> pytest.MarkDecorator:
    return pytest.mark.skipif(WINDOWS, reason=f"not on Windows: {reason}")


needs_fork = not_on_windows("it has no fork")
needs_bash = not_on_windows("it has no bash")
needs_terminal = not_on_windows("it has no pseudo-terminals of POSIX")
needs_alarms = not_on_windows("it has no timers that interrupt a process")
needs_signals = not_on_windows("os.kill ends the process there")
