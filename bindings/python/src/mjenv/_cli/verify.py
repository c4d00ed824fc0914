"""mjenv verify: compare with the Gymnasium that is installed."""

from __future__ import annotations

import argparse
import sys
from typing import Any

import mjenv
from mjenv._cli import terminal
from mjenv._cli.arguments import Commands, add_json, known_id, not_negative, positive, print_json


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "verify",
        help="compare every bit with the Gymnasium that is installed",
        description="Plays each id here and in the installed Gymnasium with random options, seeds and actions, and "
        'compares every bit of every output. Needs "gymnasium[mujoco]"; equal bits are promised for gymnasium 1.3.0, '
        "mujoco 2.2.2, numpy 2.",
    )
    command.add_argument("id", nargs="*", type=known_id, help="ids to compare; all when none is given")
    command.add_argument(
        "--option-sets", type=positive, default=5, help="option sets an id, the defaults included (default: 5)"
    )
    command.add_argument("--seeds", type=positive, default=2, help="runs an option set (default: 2)")
    command.add_argument("--steps", type=positive, default=300, help="steps a run (default: 300)")
    command.add_argument("--draw", type=not_negative, default=0, help="seed of the drawing of options (default: 0)")
    add_json(command)
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    try:
        from mjenv import verify as compare
    except ImportError as error:
        print(f'{error}: install "gymnasium[mujoco]" to compare with it', file=sys.stderr)
        return 2
    ids = arguments.id or mjenv.ids()
    if not arguments.json:
        print(compare.versions())
    results = []
    with terminal.progress(len(ids) * arguments.option_sets * arguments.seeds, "comparing") as advance:
        for id in ids:
            results.append(_compare(compare, id, arguments, advance))
            if not arguments.json:
                print(_line(results[-1], arguments.steps), flush=True)
    failed = sum(result["equal"] is False for result in results)
    if arguments.json:
        print_json({"versions": compare.versions(), "steps": arguments.steps, "results": results})
    elif failed:
        print(f"{failed} of {len(ids)} ids differ. Equal bits are promised for gymnasium 1.3.0, mujoco 2.2.2, numpy 2.")
    return int(failed > 0)


def _compare(compare: Any, id: str, arguments: argparse.Namespace, advance: Any) -> dict[str, Any]:
    result: dict[str, Any] = {"id": id, "equal": True, "runs": 0, "episodes": 0, "message": ""}
    try:
        with compare.quiet():
            for one in compare.draw_runs(id, arguments.option_sets, arguments.seeds, arguments.steps, arguments.draw):
                result["episodes"] += compare.play(one)
                result["runs"] += 1
                advance()
    except compare.DifferenceError as difference:
        result.update(equal=False, message=str(difference))
    except ImportError as error:  # Pusher-v4 with a new mujoco
        result.update(equal=None, message=str(error))
    return result


def _line(result: dict[str, Any], steps: int) -> str:
    id, runs = result["id"], result["runs"]
    if result["equal"]:
        return f"{id}: {runs} runs of {steps} steps, {result['episodes']} episodes: every bit equal"
    if result["equal"] is None:
        return f"{id}: not compared, as Gymnasium refuses it: {result['message']}"
    return f"{id}: DIFFERS after {runs} equal runs: {result['message']}"
