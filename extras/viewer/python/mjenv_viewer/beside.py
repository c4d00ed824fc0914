"""What the viewer adds to mjenv."""

NAMES = {"html_of": "mjenv_viewer.notebook", "view": "mjenv_viewer"}
COMMANDS = {"view": "mjenv_viewer.command"}
