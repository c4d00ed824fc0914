"""KeyboardInterrupt at every moment at which a version of Python may let one come."""

import sys
from collections.abc import Callable
from types import CodeType
from typing import Any


def interrupted_before(use: Callable[[], Any], instruction: int, chosen: Callable[[CodeType], bool]) -> bool:
    """Interrupts a use before that instruction of the chosen functions, from 0. False if they have fewer."""
    left = instruction

    def trace(frame: Any, event: str, _: Any) -> Any:
        nonlocal left
        if not chosen(frame.f_code):
            return None
        frame.f_trace_opcodes = True
        if event == "opcode":
            if left == 0:
                raise KeyboardInterrupt
            left -= 1
        return trace

    before = sys.gettrace()
    sys._getframe().f_trace_opcodes = True  # Python 3.12 has to know it before settrace
    sys.settrace(trace)
    try:
        use()
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
    return False
