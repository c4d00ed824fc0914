import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[4] / "tests/mujoco4"))  # test_python.py
