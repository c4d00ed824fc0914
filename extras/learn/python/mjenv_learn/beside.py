"""What the learner adds to mjenv."""

NAMES = {"evaluate": "mjenv_learn.training", "train": "mjenv_learn.training"}
COMMANDS = {"train": "mjenv_learn.command"}
