"""mjenv list, mjenv info, mjenv model: describe the environments. mjenv engines: lists the engines."""

from __future__ import annotations

import argparse
import math
import platform
import sys
import sysconfig
from pathlib import Path
from typing import Any

import mjenv
from mjenv import Kind
from mjenv_command import terminal
from mjenv_command.arguments import Commands, add_json, add_options, known_id, options_of, print_json

LANES = (2, 4, 8)  # SSE2 or NEON, AVX2, AVX-512
LANE_ROWS = 8  # the rows of the vector with which mjenv info finds out whether rows step together
SIZES = ("nq", "nv", "nu", "nbody", "njnt", "ngeom", "nsite", "ncam")
KINDS = ("observation", "action", "info", "reset_info")
TYPES = {"action": "float of the action's dtype", "native_float": "Python float", "native_int": "Python int"}


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "list", help="list the environments", description="Lists the environments with their sizes and limits."
    )
    add_json(command)
    command.set_defaults(run=run_list)

    command = commands.add_parser(
        "engines",
        help="list the engines",
        description="Lists the engines with the files of their libraries, or why one cannot be used.",
    )
    add_json(command)
    command.set_defaults(run=run_engines)

    command = commands.add_parser(
        "info",
        help="describe an environment",
        description="Describes an environment: spaces, the parts of observation, action and info, constructor options "
        "with their bounds and their defaults in make (and in make_vec if they differ), and sizes of its model.",
    )
    described = command.add_mutually_exclusive_group(required=True)
    described.add_argument("id", nargs="?", type=known_id, help="an id, Ant-v5 for instance")
    described.add_argument("--xml", metavar="FILE", help="a model of your own, which Model-v0 steps")
    add_options(command)
    add_json(command)
    command.set_defaults(run=run_info)

    command = commands.add_parser(
        "model",
        help="print the model of an environment",
        description="Prints the MJCF text of the environment's default model. Write it to a file, change it, "
        "and pass the path of the file as the option xml_file.",
    )
    command.add_argument("id", type=known_id, help="an id, Ant-v5 for instance")
    command.set_defaults(run=run_model)


def run_engines(arguments: argparse.Namespace) -> int:
    found = [_engine(name) for name in mjenv.engines(usable=False)]
    if arguments.json:
        print_json(found)
        return 0
    rows = [[one["name"], "yes" if one["default"] else "", one["file"] or one["problem"]] for one in found]
    terminal.table(["engine", "default", "library"], rows)
    return 0


def _engine(name: str) -> dict[str, Any]:
    """What mjenv engines prints of an engine: the file of its library, or why it cannot be used."""
    found: dict[str, Any] = {"name": name, "default": name == mjenv.engine().name, "file": None, "problem": None}
    try:
        found["file"] = mjenv.engine(name).file
    except mjenv.EngineError as error:
        found["problem"] = str(error)
    return found


def run_list(arguments: argparse.Namespace) -> int:
    found = [_summary(id, arguments.engine) for id in mjenv.ids(arguments.engine)]
    if arguments.json:
        print_json(found)
        return 0
    names = {
        "id": "id",
        "observation": "observation",
        "action": "action",
        "dt": "dt/s",
        "max_episode_steps": "step limit",
        "reward_threshold": "solved at",
    }
    rows = [[_short(entry[key]) for key in names] for entry in found]
    terminal.table([*names.values()], rows, right="observation action dt/s")
    return 0


def _summary(id: str, engine: str | None) -> dict[str, Any]:
    from gymnasium.spaces import flatdim

    spec = mjenv.spec(id, engine)
    env = mjenv.make(id, engine=engine)
    summary = {
        "id": id,
        "observation": flatdim(env.observation_space),
        "action": env.action_space.shape[0],
        "dt": float(f"{env.dt:.12g}"),
        "max_episode_steps": spec.max_episode_steps,
        "reward_threshold": spec.reward_threshold,
    }
    env.close()
    return summary


def _short(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def describe(id: str, options: dict[str, Any], engine: str | None = None) -> dict[str, Any]:
    """Everything that mjenv info prints."""
    spec = mjenv.spec(id, engine)
    env = mjenv.make(id, **options, engine=engine)
    model, library = env.model, mjenv.engine(engine)
    live = {field.name.removeprefix("parameters.") for field in env.fields("parameters")}
    described: dict[str, Any] = {
        "id": id,
        "engine": env.engine,
        "max_episode_steps": spec.max_episode_steps,
        "reward_threshold": spec.reward_threshold,
        "spaces": {
            "observation": _space(env.observation_space),
            "action": _space(env.action_space),
        },
        **{kind: [_field(field) for field in env.fields(kind)] for kind in KINDS},
        "groups": [_group(group, env.fields("observation")) for group in env.fields("groups")],
        "options": [_option(option, options, live) for option in mjenv.options(id, engine).values()],
        "model": {
            **{name: int(getattr(model, name)) for name in SIZES},
            "timestep": float(model.opt.timestep),
            "frame_skip": env.frame_skip,
            "dt": env.dt,
            "mass": float(model.body_mass.sum()),
            "bodies": [model.body(index).name for index in range(model.nbody)],
            "snapshot_bytes": len(env.snapshot()),
        },
        "lanes": _lanes_of(id, options, engine),
        "library": {
            "file": library.file,
            "version": library.version,
            "math": library.math,
            "platform": sysconfig.get_platform(),
            "instructions": library.instructions or platform.machine(),
            "lanes": _lanes(engine),
        },
    }
    env.close()
    return described


def _lanes(engine: str | None) -> list[int]:
    """The numbers of lanes that this CPU and the engine's library support."""
    found = []
    for lanes in LANES:
        try:
            mjenv.make_vec("InvertedPendulum-v5", lanes, num_threads=1, lanes=lanes, engine=engine).close()
        except mjenv.InvalidValueError:
            continue
        found.append(lanes)
    return found


def _lanes_of(id: str, options: dict[str, Any], engine: str | None) -> dict[str, Any]:
    """How many of LANE_ROWS rows step together on one thread, and why not."""
    envs = mjenv.make_vec(id, LANE_ROWS, engine=engine, **{**options, "num_threads": 1})
    found = {
        "rows": LANE_ROWS,
        "together": envs.lanes,
        "reason": envs.lanes_reason,
        "stages": envs.lane_stages,
    }
    envs.close()
    return found


def _space(space: Any) -> dict[str, Any]:
    from gymnasium.spaces import Dict, flatten_space

    if isinstance(space, Dict):
        space = flatten_space(space)
    low, high = ([float(str(number)) for number in bound] for bound in (space.low, space.high))  # 0.4 as float32, too
    return {"shape": [len(low)], "dtype": str(space.dtype), "low": low, "high": high}


def _field(field: Any) -> dict[str, Any]:
    return {
        "name": field.name,
        "shape": list(field.shape),
        "offset": field.offset,
        "type": TYPES.get(field.type.name.lower(), field.type.name.lower()),
        "doc": field.doc,
    }


def _group(group: Any, terms: Any) -> dict[str, Any]:
    """A group of the observation, with the names of its terms."""
    last = group.offset + group.count
    return {**_field(group), "terms": [term.name for term in terms if group.offset <= term.offset < last]}


def _option(option: mjenv.Option, given: dict[str, Any], live: set[str]) -> dict[str, Any]:
    found = {
        "name": option.name,
        "kind": option.kind.name.lower(),
        "default": option.default,
        "vector_default": option.vector_default,
        "low": option.low,
        "high": option.high,
        "choices": list(option.choices),
        "doc": option.doc,
        "live": option.name in live,
    }
    if option.name in given:
        found["value"] = given[option.name]
    return found


def run_info(arguments: argparse.Namespace) -> int:
    id = arguments.id or "Model-v0"
    options = options_of(id, arguments.option, arguments.engine)
    if arguments.xml:
        options["xml_file"] = str(Path(arguments.xml).absolute())
    described = describe(id, options, arguments.engine)
    if arguments.json:
        print_json(described)
    else:
        _show(described)
    return 0


def run_model(arguments: argparse.Namespace) -> int:
    sys.stdout.write(mjenv.model_xml(arguments.id, arguments.engine))
    return 0


def _show(described: dict[str, Any]) -> None:
    threshold = described["reward_threshold"]
    solved = f", solved at a mean return of {_short(threshold)}" if threshold is not None else ""
    limit = described["max_episode_steps"]
    steps = f"at most {limit} steps an episode" if limit else "episodes of any length"
    print(f"{described['id']}: {steps}{solved}")

    terminal.heading("Spaces")
    spaces = described["spaces"].items()
    rows = [
        [name, f"Box({space['shape'][0]})", space["dtype"], _bounds(space["low"], space["high"])]
        for name, space in spaces
    ]
    terminal.table(["space", "shape", "dtype", "bounds"], rows)

    for kind in KINDS:
        terminal.heading(kind.replace("_", " ").capitalize())
        fields = described[kind]
        if fields:
            rows = [[field["name"], _places(field), _shape(field), field["type"], field["doc"]] for field in fields]
            terminal.table(["name", "index", "shape", "type", "meaning"], rows)
        else:
            print("nothing")

    if described["groups"]:
        terminal.heading("Groups of the observation")
        rows = [[group["name"], _places(group), ", ".join(group["terms"])] for group in described["groups"]]
        terminal.table(["name", "index", "terms"], rows)

    terminal.heading("Options")
    rows = [
        [option["name"], _defaults(option), _range(option), option["doc"] + _live(option) + _given(option)]
        for option in described["options"]
    ]
    terminal.table(["option", "default", "allowed", "meaning"], rows)

    terminal.heading("Model")
    model = described["model"]
    print(", ".join(f"{name} {model[name]}" for name in SIZES))
    print(
        f"{model['frame_skip']} mj_steps of {_short(model['timestep'])} s make a step of {model['dt']:.12g} s; "
        f"mass {model['mass']:.6g} kg"
    )
    print(f"bodies: {', '.join(name or '(unnamed)' for name in model['bodies'])}")
    print(f"a snapshot of a row takes {model['snapshot_bytes']} bytes")

    lanes = described["lanes"]
    print(f"lanes: {terminal.lanes_text(lanes['together'], lanes['reason'])}")
    if lanes["stages"]:
        terminal.heading("Stages of a step")
        terminal.table(["stage", "computed in"], [*map(list, lanes["stages"].items())])

    terminal.heading("Library")
    library = described["library"]
    print(f"mjenv {library['version']} with {library['math']} math, on {library['platform']}: {library['file']}")
    numbers = ", ".join(map(str, library["lanes"])) or "no"
    print(f"instruction set {library['instructions']}, with {numbers} lanes")


def _bounds(low: list[float], high: list[float]) -> str:
    if len(set(low)) == len(set(high)) == 1:
        return f"{_short(low[0])} to {_short(high[0])}"
    return ", ".join(f"{_short(a)} to {_short(b)}" for a, b in zip(low, high, strict=True))


def _places(field: dict[str, Any]) -> str:
    first, count = field["offset"], math.prod(field["shape"])
    return str(first) if count == 1 else f"{first}-{first + count - 1}"


def _shape(field: dict[str, Any]) -> str:
    return "x".join(map(str, field["shape"])) or "scalar"


def _text(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(_short, value))
    return repr(value) if isinstance(value, str) else _short(value)


def _defaults(option: dict[str, Any]) -> str:
    default, vector_default = (_text(option[key]) for key in ("default", "vector_default"))
    return default if default == vector_default else f"{default}; make_vec: {vector_default}"


def _live(option: dict[str, Any]) -> str:
    return " [live: a program can change it while rows go on]" if option["live"] else ""


def _given(option: dict[str, Any]) -> str:
    return f" [given: {_text(option['value'])}]" if "value" in option else ""


def _range(option: dict[str, Any]) -> str:
    kind = Kind[option["kind"].upper()]
    if option["choices"]:
        return ", ".join([*option["choices"], *(["int"] if kind == Kind.STRING_OR_INT else [])])
    if kind == Kind.FLAG:
        return "True, False"
    if kind == Kind.STRING:
        return "a text"
    what = {Kind.INTEGER: "int", Kind.STRING_OR_INT: "name or int", Kind.REALS: "float"}[kind]
    if isinstance(option["default"], tuple):
        what = f"{len(option['default'])} floats"
    low, high = option["low"], option["high"]
    if kind == Kind.STRING_OR_INT:
        return what
    # The bound of an option without a bound is the greatest number of its type.
    low_text = f" >= {_short(low)}" if math.isfinite(low) else ""
    high_text = f" <= {_short(high)}" if abs(high) < 1e15 and math.isfinite(high) else ""
    return what + low_text + ("," if low_text and high_text else "") + high_text
