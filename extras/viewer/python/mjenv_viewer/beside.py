"""What the viewer adds to mjenv."""

NAMES = {"view": "mjenv_viewer"}
COMMANDS = {"view": "mjenv_viewer.command"}
