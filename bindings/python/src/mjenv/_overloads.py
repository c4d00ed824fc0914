"""make and make_vec for type checkers: the build writes _overloads.pyi beside it, with the keywords of each id."""

from mjenv.gym.make import make
from mjenv.gym.make_vec import make_vec

__all__ = ["make", "make_vec"]
