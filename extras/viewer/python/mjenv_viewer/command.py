"""mjenv view: shows an environment in a browser, and lets the user act on it."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import mjenv
from mjenv_command.arguments import (
    Commands,
    add_options,
    add_randomize,
    known_engine,
    not_negative,
    positive,
)
from mjenv_command.policies import environment_of, policy_of


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "view",
        help="show an environment in a browser, live",
        description='Steps an environment in real time and shows it in a browser. Needs pip install "mjenv[view]". '
        "Prints the address, and opens it where there is a display. Over ssh, forward the port: ssh -L 8080:localhost:"
        "8080 HOST. Ctrl-C ends it.",
    )
    command.add_argument(
        "id", nargs="?", help="an id (default: that of the learner's policy); Model-v0 with --xml shows a model alone"
    )
    command.add_argument("--engine", type=known_engine, default=argparse.SUPPRESS, metavar="NAME", help="2.2.2 or 4.0")
    command.add_argument("--rows", type=positive, default=1, help="the number of rows, shown in a grid (default: 1)")
    command.add_argument("--seed", type=not_negative, default=0, help="row i is reset with this seed + i (default: 0)")
    command.add_argument(
        "--policy",
        type=Path,
        metavar="FILE",
        help="the policy that acts: FILE.zip that Stable-Baselines3 saved, or FILE.txt that mjenv_learn.policy saved",
    )
    command.add_argument("--algorithm", default="PPO", help="the class of FILE.zip in stable_baselines3 (default: PPO)")
    command.add_argument(
        "--normalizer",
        type=Path,
        metavar="FILE",
        help="the VecNormalize that was saved with FILE.zip. Like FILE.zip, it can run any code: take both only from "
        "people whom you trust",
    )
    command.add_argument("--xml", metavar="FILE", help="another model: the option xml_file")
    command.add_argument(
        "--port", type=not_negative, help="the port of the page (default: the first free from 8080 on)"
    )
    command.add_argument(
        "--host",
        default="127.0.0.1",
        help="the address at which the page is served (default: 127.0.0.1, for this computer alone). Everybody who can "
        "open the page can act on the environment",
    )
    command.add_argument("--no-browser", action="store_true", help="do not open a browser")
    add_options(command)
    add_randomize(command)
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    from mjenv_viewer.controls import Page
    from mjenv_viewer.server import open_browser, viser_module

    viser_module()
    id, options = environment_of(arguments, **({} if arguments.xml is None else {"xml_file": arguments.xml}))
    policy = acting(arguments, id, options) if arguments.policy else None
    session = Page(
        id,
        arguments.rows,
        options,
        policy=policy,
        seed=arguments.seed,
        port=arguments.port,
        host=arguments.host,
    )
    try:
        print(session.address, flush=True)
        if not arguments.no_browser:
            open_browser(session.address)
        session.run()
    except KeyboardInterrupt:
        print("closed", file=sys.stderr)
    finally:
        session.close()
    return 0


def acting(arguments: argparse.Namespace, id: str, options: dict[str, Any]) -> Any:
    """The function that gives all rows' actions."""
    with mjenv.make(id, **options) as env:
        return policy_of(arguments.policy, env, arguments.algorithm, arguments.normalizer)
