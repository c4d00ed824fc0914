"""The pointer types of ctypes.

ctypes.POINTER gives one type for each type pointed to, from a table that all interpreters of a process share in Python
3.10 and 3.11. A subinterpreter that imports ctypes empties the table. Then ctypes.POINTER gives another type, which
structs and functions that were declared before refuse.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

POINTER: Callable[[Any], Any] = cache(ctypes.POINTER)
