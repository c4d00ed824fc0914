"""What the learner adds to mjenv."""

NAMES = {"evaluate": "mjenv_learn.training", "train": "mjenv_learn.training"}
COMMANDS = {"export": "mjenv_learn.export", "train": "mjenv_learn.command"}
