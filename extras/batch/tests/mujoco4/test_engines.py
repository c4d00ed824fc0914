"""NumPy tasks with both engines."""

import pickle

from test_python import ROOT, play, printed

import mjenv
from tasks_of_python import NumpyHopper


def test_tasks_of_python_on_both() -> None:
    """One is registered before the engine 4.0 is loaded, and one after that."""
    text = f"""
import sys; sys.path.append({str(ROOT / "bindings/python/tests")!r})
import mjenv
from tasks_of_python import NumpyHopper
mjenv.register("Before-v0", NumpyHopper)
expected = play(mjenv.make("Hopper-v5", engine="4.0"))
mjenv.register("After-v0", NumpyHopper)
print(*(play(mjenv.make(id, engine="4.0")) == expected for id in ("Before-v0", "After-v0")))
expected = play(mjenv.make("Hopper-v5"))
print(*(play(mjenv.make(id)) == expected for id in ("Before-v0", "After-v0")))
"""
    assert printed(text) == "True True\nTrue True\n"


def test_a_copy_of_a_numpy_task_keeps_its_engine() -> None:
    mjenv.register("NumpyHopper-v0", NumpyHopper)
    envs = mjenv.make_vec("NumpyHopper-v0", 2, engine="4.0")
    envs.reset(seed=1)
    other = pickle.loads(pickle.dumps(envs))
    assert other.engine == "4.0"
    assert play(other) == play(envs) == play(mjenv.make_vec("Hopper-v5", 2, engine="4.0"))
