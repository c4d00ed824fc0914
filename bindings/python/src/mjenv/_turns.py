"""Lets one thread at a time call the library with a handle, whenever KeyboardInterrupt comes.

Who has the handle's turn may call the library, and gives the turn back afterwards:

    turn = turns.take()
    try:
        ...
    finally:
        turns.give_back(turn)

KeyboardInterrupt can come as any function returns: also as `take` does, before its result is assigned and the try
statement begins. A lock would then stay taken for ever. Not even `with lock:` prevents that: since Python 3.14, an
interrupt can come between the moment in which it takes the lock and the first line of its body.

A turn is an object instead. An interrupt that comes before the try statement drops it, as it drops every result that is
not assigned, and from then on it can be taken again: Turn.__del__ appends to a list, from which the next turn is made.
Taking, giving back, dropping and making a turn are one call of a function in C each, within which no interrupt comes.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from itertools import repeat


class Turn(partial[None]):
    """Calls the function that it was made with when nobody has it any more."""

    __slots__ = ()
    __del__ = partial.__call__


class Turns:
    """The turn of one handle. The hot path calls take_free, which raises IndexError where `take` has more to do."""

    def __init__(self) -> None:
        free: list[Turn] = []
        dropped = [True]  # there is no turn until the first is taken, as if it had been dropped
        self.take_free: Callable[[], Turn] = free.pop
        self.give_back: Callable[[Turn], None] = free.append
        # The next item is Turn(dropped.append, dropped.pop()). Who drops it calls dropped.append(True).
        self._made = map(Turn, repeat(dropped.append), iter(dropped.pop, None))

    def take(self) -> Turn:
        """The turn. Raises IndexError if somebody has it."""
        try:
            return self.take_free()
        except IndexError:
            return next(self._made)


class Lock:
    """A lock that one thread can take several times. `take` waits for a turn, and dropping the turn gives it back:

    turn = lock.take()
    try:
        ...
    finally:
        del turn
    """

    def __init__(self) -> None:
        lock = threading.RLock()
        # __exit__ because it accepts an argument, unlike release: what acquire has returned.
        self.take: Callable[[], Turn] = map(Turn, repeat(lock.__exit__), iter(lock.acquire, None)).__next__
