"""What tasks over all rows add to mjenv."""

NAMES = {
    "NumpyRegistered": "mjenv_batch.registered",  # by which mjenv.register registers them
    **dict.fromkeys(("Random", "Sim", "Start"), "mjenv_batch"),
}
