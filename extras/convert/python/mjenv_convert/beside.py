"""What the converter adds to mjenv."""

COMMANDS = {"convert": "mjenv_convert.command"}
