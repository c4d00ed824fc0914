"""A compiled MuJoCo model as named fields: taken from an mjModel, stored as JSON, compared bit by bit."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeAlias

import mujoco
import numpy as np

TESTS = Path(__file__).resolve().parent.parent
ASSETS = TESTS.parent / "assets"
GOLDEN = TESTS / "golden" / "models"
MODELS = (
    "ant",
    "half_cheetah",
    "hopper",
    "humanoid",
    "humanoidstandup",
    "inverted_double_pendulum",
    "inverted_pendulum",
    "pusher",
    "pusher_v5",
    "reacher",
    "swimmer",
    "walker2d",
    "walker2d_v5",
)
VISUAL = ("global_", "quality", "headlight", "map", "scale", "rgba")

Field: TypeAlias = np.ndarray | list[str]


def fields(model: mujoco.MjModel) -> dict[str, Field]:
    """Everything the model holds: sizes, arrays, opt, stat, vis, names per kind, texture hashes, hash of the whole."""
    out = dict(numbers(model))
    for part in ("opt", "stat"):
        out |= {f"{part}.{name}": value for name, value in numbers(getattr(model, part))}
    for part in VISUAL:
        out |= {f"vis.{part.rstrip('_')}.{name}": value for name, value in numbers(getattr(model.vis, part))}

    names: bytes = model.names

    def text(address: int) -> str:
        return names[address : names.index(0, address)].decode()

    named: dict[str, Field] = {"names.model": [text(0)]}
    for name, value in out.items():
        if kind := re.fullmatch("name_(.*)adr", name):
            named[f"names.{kind[1]}"] = [text(int(address)) for address in value]

    # Pixels are too many to list. The saved model has what the bindings do not show; it does not fill its buffer.
    data = "tex_rgb" if "tex_rgb" in out else "tex_data"  # as MuJoCo 2.2.2 and 4.0 call it
    pixels = np.split(np.asarray(out.pop(data)), np.asarray(out["tex_adr"])[1:])
    saved = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, saved)
    hashes: dict[str, Field] = {
        f"{data}.sha256": [sha256(texture) for texture in pixels if texture.size],
        "mj_saveModel.sha256": [sha256(saved)],
    }
    return {**named, **out, **hashes}


def numbers(struct: Any) -> Iterator[tuple[str, np.ndarray]]:
    """The numeric members of a struct of the bindings, in alphabetic order."""
    for name in sorted(dir(struct)):
        value = getattr(struct, name)
        if name == "text_data":
            value = np.frombuffer(value, np.uint8)
        if not name.startswith("_") and isinstance(value, int | float | np.ndarray):
            yield name, packed(np.asarray(value))


def packed(array: np.ndarray) -> np.ndarray:
    """A copy of an array. Under NumPy 2, mujoco 2.2.2 gives small ones a stride of 0: only the first element shows."""
    if array.size > 1 and 0 in array.strides:
        strides = np.empty(array.shape, array.dtype).strides
        array = np.lib.stride_tricks.as_strided(array, strides=strides)
    return array.copy()


def sha256(array: np.ndarray) -> str:
    return hashlib.sha256(array.tobytes()).hexdigest()


def differences(got: dict[str, Field], want: dict[str, Field]) -> list[str]:
    """One line per differing element, with field, index and both values."""
    lines = [f"{name}: only in one of the two" for name in got.keys() ^ want.keys()]
    for name in (name for name in want if name in got):
        a, b = (f if isinstance(f, np.ndarray) else np.array(f, object) for f in (got[name], want[name]))
        if a.shape != b.shape or a.dtype != b.dtype:
            lines.append(f"{name}: is {a.dtype}{list(a.shape)}, wanted {b.dtype}{list(b.shape)}")
            continue
        lines += [
            f"{name}{list(index) or ''}: is {a[index]}, wanted {b[index]}"
            for index in np.ndindex(a.shape)
            if bits(a[index]) != bits(b[index])
        ]
    return lines


def bits(value: Any) -> Any:
    """Equal for two numbers only if all their bits are: 0.0 and -0.0 differ, NaN equals itself."""
    return value.tobytes() if isinstance(value, np.generic) else value


def write(path: Path, versions: dict[str, str], model: dict[str, Field]) -> None:
    """One field per line; an array as [dtype, shape, data], its data shortened to one number if all are the same."""

    def encoded(field: Field) -> Any:
        if isinstance(field, list):
            return field
        # Text first: it is the shortest that reads back to the same bits, for float32 too.
        data = [json.loads(str(value)) for value in field.ravel()]
        if field.ndim == 0:
            return data[0]
        alike = len({bits(value) for value in field.ravel()}) == 1
        return [str(field.dtype), list(field.shape), data[:1] if alike else data]

    lines = [f"{json.dumps(name)}:{json.dumps(encoded(field), separators=(',', ':'))}" for name, field in model.items()]
    path.write_text(f'{{"versions":{json.dumps(versions)},\n"fields":{{\n' + ",\n".join(lines) + "\n}}\n")


def read(path: Path) -> tuple[dict[str, str], dict[str, Field]]:
    """The versions and fields written by write()."""

    def decoded(value: Any) -> Field:
        if not isinstance(value, list):
            return np.asarray(value)
        if len(value) != 3 or not isinstance(value[1], list):
            return value
        dtype, shape, data = value
        return np.full(shape, data[0], dtype) if len(data) == 1 else np.array(data, dtype).reshape(shape)

    stored = json.loads(path.read_text())
    return stored["versions"], {name: decoded(value) for name, value in stored["fields"].items()}
