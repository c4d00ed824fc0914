"""Prints tables, bars and progress: with rich on a terminal if rich is installed, else as plain text."""

from __future__ import annotations

import contextlib
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

BAR_WIDTH = 40


def _rich(stream: Any) -> Any:
    """A rich console on the stream, or None."""
    if not stream.isatty():
        return None
    try:
        from rich.console import Console  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        return None
    return Console(file=stream, highlight=False)


def heading(text: str) -> None:
    console = _rich(sys.stdout)
    if console:
        console.print(f"\n{text}", style="bold", markup=False)
    else:
        print(f"\n{text}")


def table(columns: Sequence[str], rows: Sequence[Sequence[str]], right: str = "") -> None:
    """Prints a table. right: the names of the columns that are aligned to the right, separated by blanks."""
    at_right = [column in right.split() for column in columns]
    console = _rich(sys.stdout)
    if console:
        _rich_table(console, columns, rows, at_right)
        return
    widths = [max(map(len, cells)) for cells in zip(columns, *rows, strict=True)]
    widths[-1] = 0 if not at_right[-1] else widths[-1]
    for cells in (columns, *rows):
        aligned = (
            cell.rjust(width) if end else cell.ljust(width)
            for cell, width, end in zip(cells, widths, at_right, strict=True)
        )
        print("  ".join(aligned).rstrip())


def _rich_table(console: Any, columns: Sequence[str], rows: Sequence[Sequence[str]], at_right: Sequence[bool]) -> None:
    from rich import box  # type: ignore[import-not-found, unused-ignore]
    from rich.table import Table  # type: ignore[import-not-found, unused-ignore]
    from rich.text import Text  # type: ignore[import-not-found, unused-ignore]

    made = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for index, (column, end) in enumerate(zip(columns, at_right, strict=True)):
        made.add_column(column, justify="right" if end else "left", style="cyan" if index == 0 else None)
    for row in rows:
        made.add_row(*map(Text, row))
    console.print(made)


def bars(items: Sequence[tuple[str, float, str]]) -> None:
    """Prints a horizontal bar for each (label, value, text after the bar), all on one scale that begins at 0."""
    console = _rich(sys.stdout)
    label_width = max(len(label) for label, _, _ in items)
    text_width = max(len(text) for _, _, text in items)
    room = shutil.get_terminal_size().columns - label_width - text_width - 4
    width = max(8, min(BAR_WIDTH, room))
    largest = max(value for _, value, _ in items) or 1.0
    block = "█" if _encodes("█") else "#"
    for label, value, text in items:
        bar = block * max(1, round(width * value / largest))
        if console:
            from rich.text import Text

            console.print(Text(f"{label:{label_width}}  ") + Text(bar, style="green") + Text(f" {text}"))
        else:
            print(f"{label:{label_width}}  {bar} {text}")


def _encodes(text: str) -> bool:
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True


@contextlib.contextmanager
def progress(total: int, text: str) -> Iterator[Callable[[], None]]:
    """Shows on stderr how many of `total` parts are done, if it is a terminal. Yields what to call after each part."""
    if not sys.stderr.isatty():
        yield lambda: None
        return
    console = _rich(sys.stderr)
    if console:
        from rich.progress import (  # type: ignore[import-not-found, unused-ignore]
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeRemainingColumn,
        )

        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        with Progress(*columns, console=console, transient=True) as shown:
            task = shown.add_task(text, total=total)
            yield lambda: shown.advance(task)
        return
    done = 0

    def advance() -> None:
        nonlocal done
        done += 1
        filled = BAR_WIDTH * done // total
        print(f"\r{text} [{'#' * filled}{'.' * (BAR_WIDTH - filled)}] {done}/{total}", end="", file=sys.stderr)
        sys.stderr.flush()

    try:
        yield advance
    finally:
        print("\r\033[K", end="", file=sys.stderr)


def lanes_text(together: int, reason: str) -> str:
    """How many rows step together, and if not all do, why."""
    text = f"{together} rows step together" if together else "rows step one after the other"
    return f"{text} ({reason})" if reason else text
