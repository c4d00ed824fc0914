import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[3] / "bindings/python/tests"))  # tasks_of_python.py, interrupts.py
