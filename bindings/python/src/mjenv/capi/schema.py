"""Descriptions that the library gives: of an engine, and of an id's options and the fields of its arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mjenv.capi.declarations import Dtype, Kind


@dataclass(frozen=True)
class EngineInfo:
    """An engine that can be used."""

    name: str  # its version of MuJoCo
    version: str  # of the library and of its MuJoCo
    file: str  # the path of the library
    math: str  # the source of sin, exp and so on: "system" (the C library) or "portable"
    instructions: str  # the instruction set for which the library was built; "" for the platform's default


@dataclass(frozen=True)
class Option:
    """A constructor option of an id."""

    name: str
    kind: Kind
    default: Any  # in make: a bool, int, float, a tuple of floats, or a str
    low: float  # the least and the greatest valid number
    high: float
    choices: tuple[str, ...]  # the valid texts; empty if there is no list of them
    doc: str
    vector_default: Any  # in make_vec


@dataclass(frozen=True)
class Field:
    """A named part of an observation, an action or an info, or a readable array."""

    name: str
    shape: tuple[int, ...]
    offset: int  # of the first element within one row's record
    count: int
    type: Dtype | np.dtype[np.bool_]  # bool in infos of NumPy tasks alone: the library has no type for it
    doc: str
