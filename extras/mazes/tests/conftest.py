"""What the comparisons with Gymnasium-Robotics have in common."""

from __future__ import annotations

import os
import sys
from pathlib import Path

# NumPy's exp for AVX-512 rounds in another way.
os.environ.setdefault("NPY_DISABLE_CPU_FEATURES", "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL")
os.environ.setdefault("MUJOCO_GL", "egl")
sys.path.insert(0, str(Path(__file__).parents[3] / "tests/models"))  # compiled_model.py

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="3 seeds and full episodes")
