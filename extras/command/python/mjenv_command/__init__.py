"""The command line: python -m mjenv, or mjenv where the package is installed.

Each module has add(commands), which declares a command and its arguments, and a function that runs it and returns the
exit status: 0 for success, 1 if a comparison found a difference, 2 if the request cannot be met.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module

import mjenv
from mjenv.beside import listed
from mjenv_command.arguments import known_engine, tasks_file

EPILOG = """\
With --json a command prints one JSON document, which writes numbers that are not finite as the strings "inf", "-inf"
and "nan".
Exit status: 0 success, 1 a comparison found a difference, 2 the request cannot be met."""


def modules_for(words: Sequence[str]) -> list[str]:
    """The modules of the commands that a command line names, because importing the others would take longer than many
    a command. All modules, if it names none or asks for help on all."""
    commands = listed("COMMANDS")
    named = [module for name, module in commands.items() if name in words]
    wanted = [*commands.values()] if not named or words[0] in ("-h", "--help") else named
    return [*dict.fromkeys(wanted)]


def parser(modules: Sequence[str]) -> argparse.ArgumentParser:
    """The commands of these modules and their arguments."""
    made = argparse.ArgumentParser(
        prog="mjenv",
        description="Gymnasium's MuJoCo environments, bit for bit, from a native library.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument("--version", action="version", version=f"mjenv {mjenv.version()}")
    add_tasks(made)
    made.add_argument(
        "--engine",
        type=known_engine,
        metavar="NAME",
        help="the engine, 2.2.2 or 4.0: its version of MuJoCo (default: $MJENV_ENGINE, or else 2.2.2); mjenv engines "
        "tells which can be used",
    )
    commands = made.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for module in modules:
        import_module(module).add(commands)
    for command in commands.choices.values():
        add_tasks(command)
    return made


def add_tasks(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--tasks",
        action="append",
        type=tasks_file,
        metavar="FILE",
        help="a plug-in or Python file with tasks of your own, whose ids the command then knows; repeatable",
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command line, sys.argv's by default, and returns the exit status."""
    tasks = argparse.ArgumentParser(prog="mjenv", add_help=False, allow_abbrev=False)
    add_tasks(tasks)  # which are loaded first, wherever they stand, because other arguments can be their ids
    words = tasks.parse_known_args(arguments)[1]
    given = parser(modules_for(words)).parse_args(words)
    try:
        status = int(given.run(given))
        sys.stdout.flush()  # because an error of Python's own flush at exit could not be caught
        return status
    except KeyboardInterrupt:
        return 130
    except (mjenv.Error, OSError) as error:
        if isinstance(error, BrokenPipeError):
            # The program at the other end of the pipe has ended, as `head` does. Python flushes stdout once more at
            # exit, which must not fail either.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0
        print(f"mjenv: {error}", file=sys.stderr)
        return 2
