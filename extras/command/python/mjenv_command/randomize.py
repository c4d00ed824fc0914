"""mjenv randomize: shows what resets draw."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

import mjenv
from mjenv.randomization import Offset, Scale, Value
from mjenv_command import terminal
from mjenv_command.arguments import (
    Commands,
    add_json,
    add_options,
    known_id,
    not_negative,
    options_of,
    positive,
    print_json,
)

KINDS: dict[str, type[Value]] = {"value": Value, "scale": Scale, "offset": Offset}
# The numbers of each distribution, in the order in which the command takes them.
NUMBERS = {
    "uniform": ("low", "high"),
    "log_uniform": ("low", "high"),
    "normal": ("mean", "std"),
    "truncated_normal": ("mean", "std", "low", "high"),
    "choice": (),
}
SELECTIONS = ("body", "geom", "joint", "actuator", "site", "tendon")


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "randomize",
        help="show what resets draw for the model",
        description="Resets the environment and prints the model's own values beside those that each row has drawn. "
        "A draw is ARRAY=KIND:NUMBER:NUMBER[:PART...]. KIND is value, scale or offset. Each PART is a distribution "
        "(uniform, log_uniform, normal, truncated_normal, choice), an object (body=torso), columns=0, shared or "
        "set_constants. The numbers are low and high; mean and std of normal; mean, std, low and high of "
        "truncated_normal; the values of choice.",
        epilog="example: mjenv randomize Hopper-v5 geom_friction=scale:0.5:1.5:columns=0 body_mass=offset:-0.5:0.5:"
        "body=torso --rows 3",
    )
    command.add_argument("id", type=known_id, help="an id, Hopper-v5 for instance")
    command.add_argument("draws", type=draw_of, nargs="+", metavar="DRAW", help="what is drawn for an array")
    command.add_argument("--rows", type=positive, default=3, help="the number of rows (default: 3)")
    command.add_argument("--seed", type=not_negative, default=0, help="the seed of the first row (default: 0)")
    add_options(command)
    add_json(command)
    command.set_defaults(run=run)


def draw_of(text: str) -> tuple[str, Value]:
    """ARRAY=KIND:NUMBER:NUMBER[:PART...] as the name of the array and the draw."""
    array, equals, rest = text.partition("=")
    kind, *parts = rest.split(":")
    if not equals or kind not in KINDS:
        raise argparse.ArgumentTypeError(f"{text!r} is not ARRAY=KIND:NUMBER:NUMBER, where KIND is {', '.join(KINDS)}")
    numbers: list[float] = []
    distribution = "uniform"
    options: dict[str, Any] = {}
    for part in parts:
        name, equals, value = part.partition("=")
        try:
            if part in NUMBERS:
                distribution = part
            elif part in ("shared", "set_constants"):
                options[part] = True
            elif equals and name in SELECTIONS:
                options[name] = value.split(",")
            elif equals and name == "columns":
                options[name] = [int(column) for column in value.split(",")]
            else:
                numbers.append(float(part))
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r}: {part!r} is no number and no part of a draw") from None
    names = NUMBERS[distribution]
    if distribution == "choice":
        options["choices"] = numbers
    elif len(numbers) != len(names):
        raise argparse.ArgumentTypeError(f"{text!r}: {distribution} takes {' and '.join(names)}")
    else:
        options |= dict(zip(names, numbers, strict=True))
    return array, KINDS[kind](distribution=distribution, **options)  # type: ignore[arg-type]


def run(arguments: argparse.Namespace) -> int:
    randomize: dict[str, list[Value]] = {}
    for array, draw in arguments.draws:
        randomize.setdefault(array, []).append(draw)
    options = options_of(arguments.id, arguments.option, arguments.engine)
    envs = mjenv.make_vec(arguments.id, arguments.rows, engine=arguments.engine, randomize=randomize, **options)
    own = {array: _values(envs, array)[0] for array in randomize}
    envs.reset(seed=arguments.seed)
    drawn = {array: _values(envs, array) for array in randomize}
    envs.close()
    if arguments.json:
        found = {
            array: {"own": own[array].tolist(), "rows": [row.tolist() for row in drawn[array]]} for array in randomize
        }
        print_json({"id": arguments.id, "seed": arguments.seed, "arrays": found})
        return 0
    columns = ["element", "own", *(f"row {row}" for row in range(arguments.rows))]
    lines = [
        [name, *(f"{value:.6g}" for value in (own[array][at], *(row[at] for row in drawn[array])))]
        for array in randomize
        for at, name in _names(array, own[array])
        if any(row[at] != own[array][at] for row in drawn[array])
    ]
    terminal.table(columns, lines, right="")
    return 0


def _values(envs: mjenv.VectorEnv, array: str) -> list[Any]:
    """The array of each row."""
    owner, _, member = array.rpartition(".")
    models = (getattr(env.model, owner) if owner else env.model for env in envs.envs)
    return [np.array(getattr(model, member), np.float64) for model in models]


def _names(array: str, values: Any) -> list[tuple[Any, str]]:
    """The index and the name of each element."""
    if values.ndim == 0:
        return [((), array)]
    return [(at, f"{array}[{', '.join(map(str, at))}]") for at in np.ndindex(values.shape)]
