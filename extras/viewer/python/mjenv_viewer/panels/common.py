"""Functions that several tabs use."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def on_user(handle: Any, function: Callable[..., None], *first: Any) -> None:
    """Calls function(*first, value) when a user, and not the program, changes the value of an input."""

    async def updated(event: Any) -> None:  # viser awaits them one after the other
        if event.client is not None:
            function(*first, event.target.value)

    handle.on_update(updated)


def on_click(handle: Any, function: Callable[[], None]) -> None:
    async def clicked(event: Any) -> None:
        function()

    handle.on_click(clicked)
