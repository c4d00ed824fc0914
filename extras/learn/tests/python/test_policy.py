"""mjenv_learn.policy; tests/live plays trained policies from C++ and Gymnasium, the curricula compare with PyTorch."""

import dataclasses
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import mjenv
from mjenv_command import main
from mjenv_learn.declarations import Precision
from mjenv_learn.learner import PolicyHandle
from mjenv_learn.policy import ACTIVATIONS, Input, Layer, Policy, needs_of

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


def acted(policy: Policy, observation: Sequence[float]) -> list[float]:
    """The action as docs/training.md defines it, with each product and sum rounded."""
    bounded = [(x - mean) / scale for x, mean, scale in zip(observation, policy.mean, policy.scale, strict=True)]
    values = [min(max(x, -policy.clip), policy.clip) for x in bounded]
    for layer in policy.layers:
        sums = [*layer.bias]
        for index, x in enumerate(values):
            sums = [total + row[index] * x for total, row in zip(sums, layer.weights, strict=True)]
        values = [ACTIVATIONS[layer.activation](total) for total in sums]
    return [min(max(x, low), high) for x, low, high in zip(values, policy.low, policy.high, strict=True)]


@pytest.mark.parametrize("activation", ["tanh", "relu", "elu", "identity"])
def test_all_that_environments_return(activation: str) -> None:
    """An array or a dict of groups, of one or many rows: the same bits, which the library's policies have, too."""
    rng = np.random.default_rng(3)
    hidden = Layer(activation, rng.normal(size=(16, 12)).tolist(), rng.normal(size=16).tolist())
    last = Layer("identity", (rng.normal(size=(3, 16)) / 4).tolist(), [0.0] * 3)
    policy = Policy(
        "Own-v0", rng.normal(size=12).tolist(), [0.5] * 12, 5.0, [-1.0, 0.0, -1.0], [1.0] * 3, [hidden, last]
    )
    rows = rng.normal(size=(40, 12)) * 3
    expected = np.array([acted(policy, row) for row in rows], np.float32)
    groups = {"policy": rows[:, :6].reshape(-1, 3, 2), "critic": rows[:, 6:]}
    for many in (rows, rows.tolist(), rows.reshape(-1, 4, 3), groups, {"other": rows[:, 6:], "policy": rows}):
        assert policy.act(many).tobytes() == expected.tobytes()
    assert PolicyHandle(policy.text()).act(rows, 3, Precision.FLOAT64).tobytes() == expected.tobytes()
    for row, action in zip(rows, expected, strict=True):
        own = {"policy": row[:6].reshape(3, 2), "critic": row[6:]}
        for one in (row, [*row], row.reshape(4, 3), own, {"actor": row, "critic": row[:1]}):
            assert policy.act(one).tobytes() == action.tobytes()
    assert policy.act(rows[:0]).shape == (0, 3)
    assert policy.act(rows.astype(np.float32)).tobytes() == policy.act(rows.astype(np.float32).astype(float)).tobytes()
    terms = {"b": rows[:, 4:], "z": rows[:, :1], "a": rows[:, :4]}  # it names the terms, in its own order
    named = dataclasses.replace(policy, inputs=[Input("a", 4), Input("b", 8)])
    assert named.act(terms).tobytes() == expected.tobytes()
    assert Policy.parse(named.text()) == named
    for wrong in (rows[0, :11], rows[:, :11], {"policy": rows[:, :6], "critic": rows[:39, 6:]}, {}, 3.0):
        with pytest.raises(mjenv.InvalidValueError, match="this policy of Own-v0 sees 12 numbers"):
            policy.act(wrong)


PLAYER = """
#include "policy.h"
#include <stdio.h>

int main(void) {
  double observation[MJENV_POLICY_OBSERVATIONS];
  float action[MJENV_POLICY_ACTIONS];
  while (fread(observation, sizeof observation, 1, stdin)) {
    mjenv_policy_act(observation, action);
    fwrite(action, sizeof action, 1, stdout);
  }
}
"""


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_a_header_in_c(tmp_path: Path) -> None:
    """mjenv export writes C with the bits of the library, also for an id that would end its comment."""
    rng = np.random.default_rng(5)
    layers = [
        Layer(activation, rng.normal(size=(7, inputs)).tolist(), [-0.0, 0.0, *rng.normal(size=5).tolist()])
        for activation, inputs in (("tanh", 4), ("relu", 7), ("elu", 7), ("identity", 7))
    ]
    policy = Policy("*/ int x", rng.normal(size=4).tolist(), [1e-300, 0.5, 1, 7], 5.0, [-1.0] * 7, [1.0] * 7, layers)
    policy = dataclasses.replace(policy, inputs=[Input("qpos", 5, (1, 4)), Input("*/", 2)], about={"engine": "2.2.2"})
    rows = np.concatenate([rng.normal(size=(500, 4)) * 3, [[0.0, -0.0, math.inf, -math.inf]] * 2])
    policy.save(tmp_path / "policy.txt")
    assert main(["export", str(tmp_path / "policy.txt"), "--c", str(tmp_path / "policy.h")]) == 0
    (tmp_path / "play.c").write_text(PLAYER)
    for compiler in (["cc", "-std=c99"], ["c++", "-std=c++11", "-x", "c++"]):
        flags = ["-pedantic", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", "-o", "play", "play.c", "-lm"]
        subprocess.run([*compiler, *flags], cwd=tmp_path, check=True)
        played = subprocess.run([tmp_path / "play"], input=rows.tobytes(), capture_output=True, check=True).stdout
        assert played == PolicyHandle(policy.text()).act(rows, 7, Precision.FLOAT64).tobytes()
    assert (
        " * It sees qpos, 5 numbers, of which 1, 4.\n * It sees * /, 2 numbers.\n"
        in (tmp_path / "policy.h").read_text()
    )
    assert main(["export", str(tmp_path / "play.c"), "--c", str(tmp_path / "policy.h")]) == 2


def test_signs_of_zeros() -> None:
    """A bound replaces what is beyond it, so a zero keeps its sign, as in C."""
    layer = Layer("identity", [[0.0], [-0.0]], [0.0, -0.0])
    policy = Policy("Own-v0", [0.0], [1.0], 1.0, [0.0, 0.0], [1.0, 1.0], [layer])
    for rows in (1, 2, 33):
        action = policy.act(np.ones((rows, 1)))
        assert not np.signbit(action[:, 0]).any()
        assert np.signbit(action[:, 1]).all()
        assert PolicyHandle(policy.text()).act(np.ones((rows, 1)), 2, Precision.FLOAT64).tobytes() == action.tobytes()


def test_every_bit_is_kept(tmp_path: Path) -> None:
    for file in (tmp_path / "policy.txt", str(tmp_path / "other.txt")):
        SMALL.save(file)
        assert Policy.load(file) == SMALL
    with pytest.raises(FileNotFoundError):
        Policy.load("no-such-policy")
    with pytest.raises(mjenv.InvalidValueError, match="null character"):
        Policy.load(f"{tmp_path}/policy.txt\0")


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
        ("0.5", "nan"),
        ("0.5", "1_0"),
        ("0.5", "1\u2028"),
        ("0.5", "\u0661"),  # an Arabic digit
        ("scale 2.0", "scale 0.0"),
        ("id ", "id\ud800 "),
        ("low -1.0", "low 2.0"),
    ],
)
def test_refusals(tmp_path: Path, old: str, new: str) -> None:
    file = tmp_path / "policy.txt"
    SMALL.save(file)
    text = file.read_text()
    assert old in text
    text = text.replace(old, new, 1)
    with pytest.raises(mjenv.InvalidValueError, match="no policy"):
        Policy.parse(text)
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    with pytest.raises(mjenv.InvalidValueError, match=r"policy.txt: the text is no policy"):
        Policy.load(file)


def test_what_cannot_be_read_is_not_written(tmp_path: Path) -> None:
    file = tmp_path / "policy.txt"
    SMALL.save(file)
    for changes in ({"mean": [math.inf] * 10}, {"scale": [0.0] * 10}, {"clip": math.nan}, {"id": "two\nlines"}):
        with pytest.raises(mjenv.InvalidValueError, match="no policy"):
            dataclasses.replace(SMALL, **changes).save(file)
    assert Policy.load(file) == SMALL
    assert [path.name for path in tmp_path.iterdir()] == ["policy.txt"]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such files")
def test_other_files(tmp_path: Path) -> None:
    """Nothing waits for a pipe, and links that lie where a file is written first are not followed."""
    pipe, file, mine = tmp_path / "pipe", tmp_path / "policy.txt", tmp_path / "mine"
    os.mkfifo(pipe)
    for path in (pipe, "/dev/zero", tmp_path):
        with pytest.raises(FileNotFoundError, match="no regular file"):
            Policy.load(path)
    with pytest.raises(OSError, match="no regular file"):
        SMALL.save(pipe)
    mine.write_text("mine")
    (tmp_path / "policy.txt.partial").symlink_to(mine)
    SMALL.save(file)
    assert mine.read_text() == "mine"
    assert Policy.load(file) == SMALL
    assert not file.is_symlink()


def test_policies_of_other_learners_say_what_they_need(tmp_path: Path) -> None:
    """What the examples for Stable-Baselines3 and CleanRL write."""
    options = {"exclude_current_positions_from_observation": False, "randomize": {"body_mass": mjenv.Scale(0.9, 1.1)}}
    needs = needs_of("Hopper-v5", options)
    linear = Layer("identity", [[0.1] * 12] * 3, [0.0] * 3)
    Policy("Hopper-v5", [0.0] * 12, [1.0] * 12, 10.0, [-1.0] * 3, [1.0] * 3, [linear], **needs).save(tmp_path / "p.txt")
    policy = Policy.load(tmp_path / "p.txt")
    assert [(one.name, one.count) for one in policy.inputs] == [("qpos", 6), ("qvel", 6)]
    env = mjenv.make(policy.id, **policy.keywords())
    assert policy.acting_in(env)(env.reset(seed=1)[0]).shape == (3,)
