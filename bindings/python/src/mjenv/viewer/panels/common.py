"""What the tabs have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def on_user(handle: Any, function: Callable[..., None], *first: Any) -> None:
    """Calls function(*first, value) with the value that a user gives an input, and not with those that the program
    gives it."""

    async def updated(event: Any) -> None:  # awaited one after the other, unlike other functions
        if event.client is not None:
            function(*first, event.target.value)

    handle.on_update(updated)


def on_click(handle: Any, function: Callable[[], None]) -> None:
    async def clicked(event: Any) -> None:
        function()

    handle.on_click(clicked)
