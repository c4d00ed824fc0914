"""What the command line adds to mjenv."""

_MODULES = {
    "catalogue": "list engines info model",
    "randomize": "randomize",
    "play": "play",
    "bench": "bench",
    "verify": "verify",
    "snapshots": "snapshot",
    "tasks": "new-task cmake-dir",
}

NAMES = {"main": "mjenv_command"}
COMMANDS = {name: f"mjenv_command.{module}" for module, names in _MODULES.items() for name in names.split()}
