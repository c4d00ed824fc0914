"""mjenv completion: what bash, zsh and fish need to complete the command line."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import mjenv
from mjenv_command.arguments import Commands

HELP = """\
Prints a completion script. To use it in this shell:

  bash   source <(mjenv completion bash)
  zsh    autoload -Uz compinit bashcompinit; compinit; bashcompinit; source <(mjenv completion zsh)
  fish   mjenv completion fish | source"""

# For bash, and for zsh with bashcompinit. `typed` becomes the commands before the cursor, " snapshot show" for example.
BASH = """\
_mjenv() {{
  local typed= word choices current=${{COMP_WORDS[COMP_CWORD]}} count=$((COMP_CWORD-1))
  for word in "${{COMP_WORDS[@]:1:$count}}"; do
    case "$typed $word" in
{paths}
    esac
  done
  case $typed in
{choices}
  esac
  COMPREPLY=($(compgen -W "$choices" -- "$current"))
}}
complete -o default -F _mjenv mjenv
"""


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "completion",
        help="print a completion script for a shell",
        description=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.add_argument("shell", choices=("bash", "zsh", "fish"))
    command.set_defaults(run=lambda arguments: print(script(arguments.shell, arguments.whole), end="") or 0)


def script(shell: str, whole: argparse.ArgumentParser) -> str:
    """The completion script of a shell."""
    found = dict(_commands(whole, ()))
    if shell == "fish":
        return "".join(_fish(found))
    paths = "\n".join(f'      "{_joined(path)}") typed="{_joined(path)}" ;;' for path in found if path)
    choices = "\n".join(
        f'    "{_joined(path)}") choices="{" ".join(_words(parser))}" ;;' for path, parser in found.items()
    )
    return BASH.format(paths=paths, choices=choices)


def _joined(path: tuple[str, ...]) -> str:
    return "".join(f" {part}" for part in path)


def _commands(
    parser: argparse.ArgumentParser, path: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], argparse.ArgumentParser]]:
    """The parser of each command, with the words that select the command."""
    yield path, parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, child in action.choices.items():
                yield from _commands(child, (*path, name))


def _words(parser: argparse.ArgumentParser) -> Iterator[str]:
    """The words that can follow a command: its options, choices and ids."""
    for action in parser._actions:
        yield from action.option_strings
        if action.choices:
            yield from map(str, action.choices)
        elif action.dest == "id":
            yield from mjenv.ids()


def _fish(found: dict[tuple[str, ...], argparse.ArgumentParser]) -> Iterator[str]:
    for path, parser in found.items():
        words = [word for word in _words(parser) if not word.startswith("-")]
        seen = "".join(f"; and __fish_seen_subcommand_from {part}" for part in path).removeprefix("; and ")
        condition = seen or "__fish_use_subcommand"
        if words:
            yield f'complete -c mjenv -n "{condition}" -f -a "{" ".join(words)}"\n'
        for action in parser._actions:
            for option in action.option_strings:
                if option.startswith("--"):
                    yield f'complete -c mjenv -n "{condition}" -l {option[2:]} -d "{action.help}"\n'
