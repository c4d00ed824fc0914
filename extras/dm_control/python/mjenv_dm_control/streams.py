"""Rows' streams of NumPy's RandomState."""

from __future__ import annotations

from ctypes import c_uint64
from typing import Any

import numpy as np

from mjenv.capi.handle import Rows, pointer_to

_WORDS = 627  # of what mjenv_get_stream reads


def random_state(rows: Rows) -> tuple[tuple[Any, ...], bool]:
    """The stream of row 0, as RandomState.get_state returns it, and whether nothing was drawn since it was seeded."""
    words = np.empty(_WORDS, np.uint64)
    rows.call(rows.engine.mjenv_get_stream, 0, pointer_to(words, c_uint64), words.size)
    position, flags = int(words[624]), int(words[625])
    gauss = float(words[626:].view(np.float64)[0])
    return ("MT19937", words[:624].astype(np.uint32), position, flags & 1, gauss), bool(flags & 2)


def set_random_state(rows: Rows, state: Any, is_new: bool) -> None:
    """Sets the stream of row 0. is_new: whether nothing was drawn since it was seeded."""
    _, key, position, has_gauss, gauss = state
    words = np.empty(_WORDS, np.uint64)
    words[:624], words[624], words[625] = key, position, has_gauss + 2 * is_new
    words[626:] = np.array([gauss]).view(np.uint64)
    rows.call(rows.engine.mjenv_set_stream, 0, pointer_to(words, c_uint64), words.size)
