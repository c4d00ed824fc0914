"""mjenv verify: compare with the Gymnasium that is installed."""

from __future__ import annotations

import argparse
import sys
from typing import Any

import gymnasium

import mjenv
from mjenv.capi.engine import FILES, name_of
from mjenv_command import terminal
from mjenv_command.arguments import Commands, add_json, known_id, not_negative, positive, print_json

PROMISE = "Equal bits are promised for gymnasium 1.4.0, mujoco 2.2.2 or 4.0.0, numpy 2."
INSTALL = 'To compare with Gymnasium: pip install "gymnasium[mujoco]"'


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "verify",
        help="compare every bit with the Gymnasium that is installed",
        description="Plays each id here and in the installed Gymnasium with random options, seeds and actions, and "
        f'compares every bit of every output. Needs pip install "gymnasium[mujoco]". The engine is that of the '
        f"installed MuJoCo, unless --engine chooses one. {PROMISE} An id that Gymnasium cannot build is named and left "
        "out; exit status 2 if that leaves none, or if the installed MuJoCo fits no engine.",
    )
    command.add_argument("id", nargs="*", type=known_id, help="ids to compare (default: all)")
    command.add_argument(
        "--option-sets",
        type=positive,
        default=5,
        help="sets of options for each id, the defaults being the first (default: 5)",
    )
    command.add_argument("--seeds", type=positive, default=2, help="runs of each set of options (default: 2)")
    command.add_argument("--steps", type=positive, default=300, help="steps of a run (default: 300)")
    command.add_argument("--draw", type=not_negative, default=0, help="seed with which options are drawn (default: 0)")
    add_json(command)
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    try:
        import mujoco  # type: ignore[import-not-found, unused-ignore]

        from mjenv import verify as compare
    except ImportError as error:
        print(f"{error}: {INSTALL}", file=sys.stderr)
        return 2
    engine = arguments.engine or fitting_engine(mujoco.__version__)
    ids = arguments.id or mjenv.ids(engine)
    if not arguments.json:
        print(compare.versions(engine))
    results = []
    with terminal.progress(len(ids) * arguments.option_sets * arguments.seeds, "comparing") as advance:
        for id in ids:
            results.append(_compare(compare, id, engine, arguments, advance))
            if not arguments.json:
                print(_line(results[-1], arguments.steps), flush=True)
    outcomes = [result["equal"] for result in results]
    if arguments.json:
        print_json({"versions": compare.versions(engine), "steps": arguments.steps, "results": results})
    elif False in outcomes:
        print(f"{outcomes.count(False)} of {len(ids)} ids differ. {PROMISE}")
    if outcomes.count(None) == len(ids):
        print(f"mjenv: nothing was compared: {results[0]['message']}. {INSTALL}", file=sys.stderr)
        return 2
    return int(False in outcomes)


def fitting_engine(mujoco: str) -> str:
    """The engine that computes as the installed MuJoCo does. Raises EngineError if there is none."""
    found = name_of(mujoco)
    if found not in FILES:
        raise mjenv.EngineError(
            f"MuJoCo {found} is installed, and mjenv computes as MuJoCo {' and '.join(FILES)} do: install one of these "
            "(pip install mujoco==2.2.2, or pip install 'mujoco>=4.0,<4.1')"
        )
    return found


def _compare(compare: Any, id: str, engine: str, arguments: argparse.Namespace, advance: Any) -> dict[str, Any]:
    """Compares an id. "equal" in the result is None if Gymnasium cannot build its environment of this id."""
    result: dict[str, Any] = {"id": id, "equal": True, "runs": 0, "episodes": 0, "message": ""}
    try:
        with compare.quiet():
            chosen = arguments.option_sets, arguments.seeds, arguments.steps, arguments.draw, engine
            for one in compare.draw_runs(id, *chosen):
                result["episodes"] += compare.play(one)
                result["runs"] += 1
                advance()
    except (compare.DifferenceError, mjenv.Error) as difference:
        result.update(equal=False, message=str(difference))
    except (ImportError, gymnasium.error.Error) as error:
        # A package is missing, the mujoco is too new for an old id, or Gymnasium has no such id.
        result.update(equal=None, message=str(error))
    return result


def _line(result: dict[str, Any], steps: int) -> str:
    id, runs = result["id"], result["runs"]
    if result["equal"]:
        return f"{id}: {runs} runs of {steps} steps, {result['episodes']} episodes: every bit equal"
    if result["equal"] is None:
        return f"{id}: not compared, because Gymnasium cannot build it: {result['message']}"
    return f"{id}: DIFFERS after {runs} equal runs: {result['message']}"
