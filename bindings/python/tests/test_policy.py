"""mjenv.policy; tests/live plays trained policies from C++ and Gymnasium, tests/training compares with PyTorch."""

import math
from pathlib import Path

import numpy as np
import pytest

import mjenv
from mjenv.policy import Layer, Policy

SMALL = Policy(
    "Reacher-v5",
    mean=[0.5] * 10,
    scale=[2.0] * 10,
    clip=3.0,
    low=[-1.0, -1.0],
    high=[1.0, 0.25],
    layers=[
        Layer("tanh", [[0.1 * (i + 1)] * 10 for i in range(3)], [0.0, 0.1, -0.1]),
        Layer("identity", [[1 / 3, 0.0, 0.0], [1.0, 1.0, 1.0]], [0.0, 0.0]),
    ],
)


def test_act() -> None:
    """By mathematics: all inputs are (2.5 - 0.5) / 2 = 1, or clipped to 3."""
    action = SMALL.act([2.5] * 10)
    assert action.dtype == np.float32
    assert action[0] == np.float32(math.tanh(sum([0.1] * 10)) / 3)
    assert action[1] == 0.25  # its bound
    clipped = SMALL.act([1e9] * 10)
    assert np.array_equal(clipped, SMALL.act([6.5] * 10))


def test_every_bit_is_kept(tmp_path: Path) -> None:
    for file in (tmp_path / "policy.txt", str(tmp_path / "other.txt")):
        SMALL.save(file)
        assert Policy.load(file) == SMALL
    with pytest.raises(FileNotFoundError):
        Policy.load("no-such-policy")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("mjenv-policy 1", "mjenv-policy 2"),
        ("tanh", "sigmoid"),
        ("\nmean ", "\nmean 0.5 "),
        ("\nclip 3.0", ""),
        ("\nclip 3.0", "\nclip 3.0 4.0"),
        ("\nbias ", "\nbias 1 "),
        ("\nweights ", "\nweights 1 "),
        ("\nlow ", "\nlower "),
        ("\nlayer 3", "\nstratum 3"),
        ("0.5", "half"),
    ],
)
def test_refusals(tmp_path: Path, old: str, new: str) -> None:
    file = tmp_path / "policy.txt"
    SMALL.save(file)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(mjenv.InvalidValueError, match=r"policy.txt is no policy"):
        Policy.load(file)
