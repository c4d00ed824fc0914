"""Prints tables and progress as plain text."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence


def heading(text: str) -> None:
    print(f"\n{text}")


def table(columns: Sequence[str], rows: Sequence[Sequence[str]], right: str = "") -> None:
    """Prints a table. right: the names of the columns that are aligned to the right, separated by blanks."""
    at_right = [column in right.split() for column in columns]
    widths = [max(map(len, cells)) for cells in zip(columns, *rows, strict=True)]
    for cells in (columns, *rows):
        aligned = (
            cell.rjust(width) if end else cell.ljust(width)
            for cell, width, end in zip(cells, widths, at_right, strict=True)
        )
        print("  ".join(aligned).rstrip())


@contextlib.contextmanager
def progress(total: int, text: str) -> Iterator[Callable[[], None]]:
    """Shows on stderr how many of `total` parts are done, if it is a terminal. Yields what to call after each part."""
    done = 0

    def show(line: str) -> None:
        if sys.stderr.isatty():
            print(f"\r\033[K{line}", end="", file=sys.stderr, flush=True)

    def advance() -> None:
        nonlocal done
        done += 1
        show(f"{text} {done}/{total}")

    try:
        yield advance
    finally:
        show("")


def lanes_text(together: int, reason: str) -> str:
    """How many rows step together, and if not all do, why."""
    text = f"{together} rows step together" if together else "rows step one after the other"
    return f"{text} ({reason})" if reason else text
