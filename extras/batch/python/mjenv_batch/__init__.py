"""NumPy tasks: classes derived from mjenv.Task whose methods compute over all rows at once (docs/tasks/python.md).

mjenv.register finds this package. It has the types of what the methods get: Random, Sim and Start.
"""

from mjenv_batch.sim import Random, Sim
from mjenv_batch.start import Start

__all__ = ["Random", "Sim", "Start"]
