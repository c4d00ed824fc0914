"""python -m mjenv: the command line."""

import sys

from mjenv.cli import main

if __name__ == "__main__":
    sys.exit(main())
