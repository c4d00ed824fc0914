"""Reads what tests/golden/record.py recorded from Gymnasium; the formats are described there."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

FOLDER = Path(__file__).resolve().parents[3] / "tests" / "golden"
# The recordings depend on which variants of its functions the C library chooses for the CPU.
LIBM = {float.fromhex("0x1.80869e3fad89ap-1"): "fma", float.fromhex("0x1.80869e3fad899p-1"): "sse2"}[math.sin(692)]
TYPES = {
    "numpy_float64": np.float64,
    "numpy_int64": np.int64,
    "python_float": float,
    "python_int": int,
}


@dataclass
class Golden:
    """One recorded file. info and reset_info: (name, count, type) in order."""

    id: str = ""
    seed: int = 0
    norm: str = ""
    options: dict[str, Any] = field(default_factory=dict)
    info: list[tuple[str, int, str]] = field(default_factory=list)
    reset_info: list[tuple[str, int, str]] = field(default_factory=list)
    arrays: dict[str, np.ndarray] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.arrays[name]

    @property
    def keywords(self) -> dict[str, Any]:
        """The options as mjenv.make takes them."""
        return {"norm": self.norm, **self.options}


def files(folder: str) -> list[Path]:
    found = sorted((FOLDER / LIBM / folder).glob("*.golden"))
    assert found, f"no goldens in {FOLDER / LIBM / folder}"
    return found


def option_value(kind: str, words: list[str]) -> Any:
    if kind == "integer":
        return int(words[0])
    if kind == "flag":
        return words[0] == "1"
    if kind == "reals":
        reals = tuple(float.fromhex(word) for word in words)
        return reals if len(reals) > 1 else reals[0]
    text = " ".join(words)
    return int(text) if kind == "string_or_int" and text.isdigit() else text


def load(path: Path) -> Golden:
    head, _, data = path.read_bytes().partition(b"\ndata\n")
    golden = Golden()
    shapes = []
    for line in head.decode().splitlines():
        key, *words = line.split(" ")
        if key == "option":
            golden.options[words[0]] = option_value(words[1], words[2:])
        elif key in ("info", "reset_info"):
            getattr(golden, key).append((words[0], int(words[1]), words[2]))
        elif key == "array":
            shapes.append((words[0], np.dtype(f"<{words[1]}"), tuple(map(int, words[2:]))))
        elif key in ("id", "norm"):
            setattr(golden, key, words[0])
        elif key == "seed":
            golden.seed = int(words[0])
    offset = 0
    for name, dtype, shape in shapes:
        count = int(np.prod(shape))
        golden.arrays[name] = np.frombuffer(data, dtype, count, offset).reshape(shape)
        offset += count * dtype.itemsize
    assert offset == len(data), f"{path.name} holds {len(data)} bytes of data, not {offset}"
    model = golden.options.get("xml_file", "")
    if model.startswith("."):
        golden.options["xml_file"] = str(path.parent / model)
    return golden


def same(values: Any, recorded: np.ndarray) -> bool:
    """Whether all bits of a row's numbers are the recorded ones, or have the recorded hash."""
    values = np.float64(values)
    if recorded.dtype != np.uint64:
        return values.tobytes() == recorded.tobytes()
    hash = 0xCBF29CE484222325
    for word in values.ravel().view(np.uint64).tolist():
        hash = (hash ^ word) * 0x100000001B3 % 2**64
        hash ^= hash >> 32
    return [hash] == recorded.ravel().tolist()


def check_info(info: dict[str, Any], fields: list[tuple[str, int, str]], record: np.ndarray, dtype: np.dtype) -> None:
    """Compares names, order, types and bits with one recorded row."""
    assert list(info) == [name for name, _, _ in fields]
    offset = 0
    for name, count, kind in fields:
        value, expected = info[name], record[offset : offset + count]
        offset += count
        if isinstance(value, np.ndarray):
            assert value.dtype == np.float64, name
            assert value.tobytes() == expected.tobytes(), name
        else:
            assert type(value) is (dtype.type if kind == "action_dtype" else TYPES[kind]), name
            assert np.float64(value).tobytes() == expected.tobytes(), name
    assert offset == len(record)
