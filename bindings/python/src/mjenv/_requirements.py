"""Checks the version of Gymnasium, whose classes older than 1.0 cannot be derived from."""

import gymnasium

if int(gymnasium.__version__.split(".")[0]) < 1:
    raise ImportError(f'mjenv needs Gymnasium 1.0 or newer, not {gymnasium.__version__}: pip install "gymnasium>=1.0"')
