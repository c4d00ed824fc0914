"""What these classes add to mjenv."""

NAMES = {"MujocoEnv": "mjenv_classes", "gymnasium_classes": "mjenv_classes.imports"}
