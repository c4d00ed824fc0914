"""python -m mjenv: the command line, which is a program beside this package."""

import sys

from mjenv.beside import value_of


def main() -> int:
    try:
        run = value_of("main")
    except AttributeError:
        sys.exit("mjenv: the command line is not installed: install mjenv with the programs of its folder extras")
    return int(run())


if __name__ == "__main__":
    sys.exit(main())
