"""Owners of the library's handles, which do not lose a handle when KeyboardInterrupt comes.

    handle = c_void_p()
    self._owned = Owned(engine.mjenv_destroy, handle)
    engine.check(engine.mjenv_create(..., byref(handle)))

The owner exists before the handle does. So if KeyboardInterrupt comes when mjenv_create returns, dropping the owner
destroys the handle. To destroy it earlier, drop the owner: self._owned = None.
"""

from __future__ import annotations

import weakref
from functools import partial


class Owned(partial[None]):
    """Destroys a handle when the last reference to the owner is gone. Destroying NULL does nothing.

    The destruction is one call of a function in C, which no interrupt can divide.
    """

    __slots__ = ()
    __del__ = partial.__call__


# At exit handles stay, because a daemon thread may still be inside.
weakref.finalize(Owned, delattr, Owned, "__del__")
