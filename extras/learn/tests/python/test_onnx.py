"""mjenv export --onnx writes what onnxruntime computes as Policy.act does. Needs onnx and onnxruntime."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from mjenv_learn.policy import Layer, Policy

onnxruntime = pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")


@pytest.mark.parametrize("activation", ["tanh", "relu", "elu"])
def test_actions_are_those_of_the_policy(activation: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    sizes, layers = (11, 16, 8, 3), []
    for index, (inputs, outputs) in enumerate(pairwise(sizes)):
        kind = "identity" if index == 2 else activation
        layers.append(Layer(kind, rng.normal(size=(outputs, inputs)).tolist(), rng.normal(size=outputs).tolist()))
    mean, scale = rng.normal(size=11).tolist(), rng.uniform(0.5, 2, 11).tolist()
    policy = Policy("Hopper-v5", mean, scale, 5.0, [-20.0] * 3, [20.0] * 3, layers)
    policy.save(tmp_path / "policy.txt")
    command = [sys.executable, "-m", "mjenv", "export", tmp_path / "policy.txt", "--onnx", tmp_path / "policy.onnx"]
    subprocess.run([*map(str, command)], check=True)
    session = onnxruntime.InferenceSession(tmp_path / "policy.onnx")
    observations = rng.normal(scale=3, size=(200, 11))
    (actions,) = session.run(None, {"observation": observations})
    assert actions.dtype == np.float32
    np.testing.assert_allclose(actions, policy.act(observations), rtol=1e-6, atol=1e-6)  # it sums in another order
    assert len(np.unique(actions)) > 50
    assert session.get_modelmeta().custom_metadata_map["id"] == "Hopper-v5"
