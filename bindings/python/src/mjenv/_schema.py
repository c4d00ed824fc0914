"""What the library tells about itself, and about an id: its options, and the fields of its arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mjenv._abi import Dtype, Kind


@dataclass(frozen=True)
class EngineInfo:
    """An engine that can be used."""

    name: str  # its version of MuJoCo
    version: str  # of the library, and of its MuJoCo
    file: str  # the library
    math: str  # "system" or "portable": where sines and the like come from
    instructions: str  # the instruction set that the library was built for; "" for the usual one of the platform


@dataclass(frozen=True)
class Option:
    """A constructor option of an id."""

    name: str
    kind: Kind
    default: Any  # of make: a bool, int, float, a tuple of floats, or a str
    low: float  # of each number, both ends included
    high: float
    choices: tuple[str, ...]  # the valid texts; empty when any text may be tried
    doc: str
    vector_default: Any  # of make_vec


@dataclass(frozen=True)
class Field:
    """A named part of an observation, an action or an info, or a readable array."""

    name: str
    shape: tuple[int, ...]
    offset: int  # of the first element within one row's record
    count: int
    type: Dtype
    doc: str
