"""Owners of the library's handles, which KeyboardInterrupt cannot make them lose.

    handle = c_void_p()
    self._owned = Owned(engine.mjenv_destroy, handle)
    engine.check(engine.mjenv_create(..., byref(handle)))

The owner is there before the handle is. So when KeyboardInterrupt comes as mjenv_create returns, dropping the owner
destroys the handle. To destroy it earlier, drop the owner: self._owned = None.
"""

from __future__ import annotations

import weakref
from functools import partial


class Owned(partial[None]):
    """Destroys a handle when nobody has the owner any more: Owned(destroy, handle). Destroying NULL does nothing.

    That is one call of a function in C, within which no interrupt comes.
    """

    __slots__ = ()
    __del__ = partial.__call__


# At exit handles stay, because a daemon thread may still be inside.
weakref.finalize(Owned, delattr, Owned, "__del__")
