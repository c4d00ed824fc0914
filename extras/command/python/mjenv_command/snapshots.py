"""mjenv snapshot: shows what a snapshot holds, and where two snapshots differ."""

from __future__ import annotations

import argparse
import contextlib
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mjenv
from mjenv.errors import SnapshotError
from mjenv_command import terminal
from mjenv_command.arguments import Commands, add_json, add_options, known_id, options_of, print_json

# A snapshot begins with the stamp. Then comes an entry for each part of a row, and one for each array of which rows
# have their own values. Then come the rows, each with its parts one after the other; the head is the first part.
# magic, version, engine, rounding of norms, math, identity, rows, randomisation, perturbation, the numbers of entries
# for parts and for arrays, checksum
STAMP = struct.Struct("<8sHHHHQQQQIIQ")
# name, the bit of the head's `kept` that says whether a row has the part (0: all rows have it), bytes
ENTRY = struct.Struct("<36sIQ")
# PCG64 state and increment, high word first; the buffered half of a draw, and whether there is one; steps; flags; the
# kinds of MuJoCo's warnings in the last step, as bits; kept
HEAD = struct.Struct("<4Q2Iq6BH")
VERSION = 6
FLAGS = ("origin", "seeded", "ready", "ended", "written", "warnings", "kept")
# The prefix of the names of the fields of a part.
PREFIXES = {
    "state": "",
    "values": "own.",
    "first_state": "first.",
    "first_values": "first.own.",
    "set_state_state": "set_state.",
    "set_state_values": "set_state.own.",
    "set_constants_rest": "set_constants.",
    "set_constants_values": "set_constants.own.",
}

Row = dict[str, Any]  # an int, or an array of float64, by name


@dataclass(frozen=True)
class Image:
    """A snapshot that the library accepted."""

    engine: str
    id: str
    rows: list[Row]


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "snapshot",
        help="show a snapshot, or compare two",
        description="A snapshot is a file with the bytes that env.snapshot() (Python) or mjenv_snapshot (C) returned.",
    )
    actions = command.add_subparsers(dest="action", required=True, metavar="ACTION")
    show = actions.add_parser("show", help="print what a snapshot holds", description="Prints what a snapshot holds.")
    show.add_argument("file", type=Path, help="a snapshot")
    show.set_defaults(run=run_show)
    diff = actions.add_parser(
        "diff",
        help="compare two snapshots field by field",
        description="Compares two snapshots of one environment field by field and bit for bit; exit status 1 if they "
        'differ. Fields that begin with "first." or "set_state." are the state and own values from which derived '
        'arrays are computed again, and those with "set_constants." are what mj_setConst was called with.',
    )
    diff.add_argument("file", type=Path, help="a snapshot")
    diff.add_argument("other", type=Path, help="another snapshot")
    diff.set_defaults(run=run_diff)
    for action in (show, diff):
        action.add_argument(
            "--id", type=known_id, help="the id of its environment (default: tries all ids with their default options)"
        )
        add_options(action)
        add_json(action)


def read(path: Path, arguments: argparse.Namespace) -> Image:
    """Reads a snapshot. The library checks that it is whole and fits the id."""
    # Pipes and devices may have no end.
    if not path.is_file() and path.exists():
        raise SnapshotError(f"{path} is not a regular file")
    with path.open("rb") as file:
        data = file.read(STAMP.size)
        if len(data) < STAMP.size:
            raise SnapshotError(f"{path}: {len(data)} bytes are too few for a snapshot")
        if not data.startswith(b"mjenvrow"):
            raise SnapshotError(f"{path} is no snapshot of rows")
        data += file.read()
    _, version, engine, _, _, _, count, _, _, part_count, array_count, _ = STAMP.unpack_from(data)
    if version != VERSION:
        raise SnapshotError(f"{path} has the version {version}; this command reads {VERSION}")
    # The library would first allocate so many rows, and then refuse the image.
    start = STAMP.size + (part_count + array_count) * ENTRY.size
    if not 1 <= count <= (len(data) - start) // HEAD.size:
        raise SnapshotError(f"{path} is damaged: {len(data)} bytes cannot be {count} rows")
    mujoco = f"{engine // 10000}.{engine // 100 % 100}.{engine % 100}"
    names = (name for name in mjenv.engines(usable=False) if f"{mujoco}.".startswith(f"{name}."))
    library = mjenv.engine(arguments.engine or next(names, mujoco))
    with contextlib.closing(_owner(library.name, path, data, count, arguments)) as envs:
        entries = [_entry(data, index) for index in range(part_count + array_count)]
        parts, arrays = entries[:part_count], entries[part_count:]
        contents = _contents(envs.envs[0], [name for name, _, _ in arrays])
        found = []
        for _ in range(count):
            row, start = _row(data, start, parts, contents)
            found.append(row)
        assert envs.spec
        return Image(library.name, envs.spec.id, found)


def _entry(data: bytes, index: int) -> tuple[str, int, int]:
    name, kept, size = ENTRY.unpack_from(data, STAMP.size + index * ENTRY.size)
    return name.rstrip(b"\0").decode(), kept, size


def _owner(engine: str, path: Path, data: bytes, count: int, arguments: argparse.Namespace) -> mjenv.VectorEnv:
    """Environments of the id and the options that the image fits, restored from it."""
    last: SnapshotError | None = None
    id = arguments.id
    for candidate in mjenv.ids(engine) if id is None else (id,):
        given = options_of(candidate, arguments.option, engine) if id is not None else {}
        modes = [given["autoreset_mode"]] if "autoreset_mode" in given else ["disabled", "next_step", "same_step"]
        for mode in modes:
            options = {"num_threads": 1, **given, "autoreset_mode": mode}
            envs = mjenv.make_vec(candidate, count, engine=engine, **options)
            try:
                envs.restore(data)
                return envs
            except SnapshotError as error:
                last = error
                envs.close()
    if id is not None:
        raise SnapshotError(f"{path}: {last}")
    raise SnapshotError(
        f"{path} is damaged, or its environment has other than default options: name its id and options with --id and "
        "--option"
    )


# The parts of a state that not all models have: histories and plasticity on MuJoCo 4.0, mocap_quat on 2.2.2.
REST = ("history", "plastic", "mocap_quat")


Fields = list[tuple[str, int, str]]  # the names, lengths and dtypes of the fields of a part


def _contents(env: Any, arrays: list[str]) -> dict[str, Fields]:
    """The fields of each part whose fields have names. env: a row."""
    fields = {field.name: field for kind in ("data", "model") for field in env.fields(kind)}
    nq, nv, na, nu = (int(getattr(env.model, name)) for name in ("nq", "nv", "na", "nu"))
    state = [("time", 1), ("qpos", nq), ("qvel", nv), ("act", na), ("qacc_warmstart", nv), ("ctrl", nu)]
    rest = []
    for name in REST:
        if name == "mocap_quat":
            count = 0 if "nhistory" in fields else 4 * int(env.model.nmocap)
        else:
            count = int(getattr(env.model, f"n{name}")) if f"n{name}" in fields else 0
        if count:
            rest.append((name, count))
    own = (fields[name] for name in arrays)
    values = [(field.name, field.count, np.dtype(field.type.name.lower()).newbyteorder("<").str) for field in own]
    states = [(name, length, "<f8") for name, length in state + rest]
    found = {}
    for part in PREFIXES:
        found[part] = values if part.endswith("values") else states
    found["set_constants_rest"] = [(name, length, "<f8") for name, length in rest]
    return found


def _row(data: bytes, start: int, parts: list[tuple[str, int, int]], contents: dict[str, Fields]) -> tuple[Row, int]:
    """The fields of the row that begins at `start`, and where the next row begins."""
    state_high, state_low, increment_high, increment_low, half, has_half, steps, *flags = HEAD.unpack_from(data, start)
    row: Row = {
        "stream.state": state_low | state_high << 64,
        "stream.increment": increment_low | increment_high << 64,
        "stream.uinteger": half,
        "stream.has_uint32": has_half,
        "steps": steps,
        **dict(zip(FLAGS, flags, strict=True)),
    }
    all_kept = row.pop("kept")
    for name, kept, size in parts:
        if kept and not all_kept & kept:
            continue
        if name in contents:
            at = start
            for field, length, dtype in contents[name]:
                values = np.frombuffer(data, dtype, length, at)
                row[PREFIXES[name] + field] = values.astype(np.float64)
                at += -(-values.nbytes // 8) * 8
        elif name != "head":
            row[name] = np.frombuffer(data, "<f8", size // 8, start)
        start += size
    return row, start


def run_show(arguments: argparse.Namespace) -> int:
    image = read(arguments.file, arguments)
    if arguments.json:
        rows = [{name: _jsonable(value) for name, value in row.items()} for row in image.rows]
        print_json({"id": image.id, "engine": image.engine, "rows": rows})
        return 0
    print(f"{image.id}: {len(image.rows)} row(s), engine {image.engine}")
    for index, row in enumerate(image.rows):
        terminal.heading(f"Row {index}")
        terminal.table(["field", "value"], [[name, _shown(value)] for name, value in row.items()])
    return 0


def run_diff(arguments: argparse.Namespace) -> int:
    first = read(arguments.file, arguments)
    second = read(arguments.other, arguments)
    if (first.engine, first.id, len(first.rows)) != (second.engine, second.id, len(second.rows)):
        raise SnapshotError(
            f"{arguments.file} is of {len(first.rows)} row(s) of {first.id} on engine {first.engine}, "
            f"{arguments.other} of {len(second.rows)} of {second.id} on engine {second.engine}: only snapshots of one "
            "engine, id and number of rows can be compared"
        )
    differences = list(compare(first, second))
    if arguments.json:
        print_json({"id": first.id, "rows": len(first.rows), "equal": not differences, "differences": differences})
    elif differences:
        columns = ["row", "field", "index", "first", "second", "differing", "greatest"]
        rows = [[_cell(difference[column]) for column in columns] for difference in differences]
        terminal.table(columns, rows, right="row index")
    else:
        print(f"{first.id}: {len(first.rows)} row(s), equal in every bit")
    return int(bool(differences))


def compare(first: Image, second: Image) -> list[dict[str, Any]]:
    """The fields that differ, each with its first different element, their number, and the greatest difference."""
    return [
        {"row": index, "field": name, **difference}
        for index, (a, b) in enumerate(zip(first.rows, second.rows, strict=True))
        for name in dict.fromkeys([*a, *b])
        if (difference := _difference(a.get(name), b.get(name)))
    ]


def _difference(a: Any, b: Any) -> dict[str, Any] | None:
    """The differences between two values of a field. None stands for a field that a row lacks."""
    if a is None or b is None:
        first, second = ("absent" if value is None else "present" for value in (a, b))
        return {"index": None, "first": first, "second": second, "differing": None, "greatest": None}
    if isinstance(a, int):
        if a == b:
            return None
        return {"index": None, "first": _jsonable(a), "second": _jsonable(b), "differing": 1, "greatest": None}
    unequal: NDArray[np.bool_] = a.view(np.uint64) != b.view(np.uint64)
    if not unequal.any():
        return None
    at = int(np.argmax(unequal))
    with np.errstate(invalid="ignore"):
        greatest = float(np.max(np.abs(a - b)))
    return {
        "index": at,
        "first": float(a[at]),
        "second": float(b[at]),
        "differing": int(unequal.sum()),
        "greatest": greatest,
    }


def _jsonable(value: Any) -> Any:
    """Arrays become lists, and integers that many readers of JSON would round become strings."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return str(value) if isinstance(value, int) and value >= 2**53 else value


def _shown(value: Any) -> str:
    return " ".join(map(repr, value.tolist())) if isinstance(value, np.ndarray) else str(value)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else str(value)
