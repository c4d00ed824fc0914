"""Lets one thread at a time call the library with a handle, also if KeyboardInterrupt comes at any moment.

A caller takes the handle's turn, calls the library, and gives the turn back:

    turn = [turns.take()]
    try:
        ...
    finally:
        turns.give_back(turn.pop())

KeyboardInterrupt can come when any function returns, also when `take` returns, before its result is assigned and the
try statement begins. A lock would then stay locked for ever. Not even `with lock:` prevents this: since Python 3.14, an
interrupt can come after `with` has taken the lock and before the first line of its body.

So a turn is an object. If an interrupt comes before the try statement, Python drops the object, as it drops every
result that is not assigned, and Turn.__del__ appends to a list, from which the next turn is made. Taking, giving back,
dropping and making a turn are one call of a function in C each, which no interrupt can divide.

The turn is in a list and leaves it when it is given back, because Python would not drop a turn that a variable of an
earlier caller still refers to: whoever keeps an exception keeps the variables of all functions that it went through.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from itertools import repeat


class Turn(partial[None]):
    """Calls its function when the last reference to the turn is gone."""

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
        """Returns the turn. Raises IndexError if another caller has it."""
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
