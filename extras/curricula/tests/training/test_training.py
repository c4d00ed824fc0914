"""Short trainings on mjenv and on Gymnasium must give the same curve and the same policy.

Needs the Python of `tools/setup training`.
"""

from __future__ import annotations

import csv
import math
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

ROOT = Path(__file__).resolve().parents[4]
sys.path += [str(ROOT / "extras/curricula/python"), str(ROOT / "benchmarks" / "training")]

import compare  # noqa: E402
import train_cleanrl  # noqa: E402
from deploy import play  # noqa: E402
from mjenv_learn.policy import Policy  # noqa: E402

# What docs/training.md states of the long trainings: the mean return of the last 20 episodes is at least this.
STATED = {"InvertedPendulum-v5": 1000, "Reacher-v5": -7, "Hopper-v5": 1000}


@pytest.fixture(scope="module", params=[("sb3", "InvertedPendulum-v5"), ("cleanrl", "Reacher-v5")])
def trained(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short training on both, whose curves and policies were compared."""
    trainer, id = request.param
    folder = tmp_path_factory.mktemp(trainer)
    points = compare.train_both(trainer, id, folder, steps=16_384)
    assert len(points) == 8
    returns = [point.mean_return for point in points if not math.isnan(point.mean_return)]
    assert returns[-1] > returns[0]
    return folder


def test_a_difference_is_found(trained: Path, tmp_path: Path) -> None:
    """The comparison on which the fixture relies notices a change of one digit."""
    for backend in compare.BACKENDS:
        (tmp_path / backend).mkdir()
        for name in ("curve.csv", "policy.txt"):
            (tmp_path / backend / name).write_bytes((trained / backend / name).read_bytes())
    compare.joined("id", tmp_path)
    for file, message in (("mjenv/policy.txt", "policies differ"), ("gymnasium/curve.csv", "curves differ")):
        text = (tmp_path / file).read_text().rstrip()
        (tmp_path / file).write_text(text[:-1] + str((int(text[-1]) + 1) % 10) + "\n")
        with pytest.raises(SystemExit, match=message):
            compare.joined("id", tmp_path)


def test_deployment(trained: Path) -> None:
    """Without PyTorch, on both backends. tests/live plays trained policies from C++ too."""
    policy = Policy.load(trained / "mjenv" / "policy.txt")
    assert play(policy, "mjenv", 2, 7) == play(policy, "gymnasium", 2, 7)


def test_the_policy_is_the_trained_one() -> None:
    """The policy evaluated in float64 equals PyTorch's network except for the rounding to float32."""
    torch.manual_seed(3)
    agent = train_cleanrl.Agent(11, 3)
    for parameter in agent.parameters():
        torch.nn.init.normal_(parameter, std=0.3)
    first, _, second, _, third = agent.actor
    rng = np.random.default_rng(0)
    mean, scale = rng.normal(size=11), rng.uniform(0.5, 2, 11)
    layers = train_cleanrl.layers_of(first, second, third)
    policy = Policy("Hopper-v5", mean.tolist(), scale.tolist(), 10.0, [-100.0] * 3, [100.0] * 3, layers)
    for observation in rng.normal(scale=8, size=(200, 11)):
        normal = torch.as_tensor(((observation - mean) / scale).clip(-10, 10), dtype=torch.float32)
        expected = agent.actor(normal).detach().numpy()
        np.testing.assert_allclose(policy.act(observation), expected, rtol=0, atol=3e-5)
    assert np.array_equal(policy.act(mean + 1e9 * scale), policy.act(mean + 10.5 * scale))


@pytest.mark.parametrize("trainer", ["sb3", "cleanrl"])
def test_the_committed_curves(trainer: str, tmp_path: Path) -> None:
    """They reach the stated returns, and the drawing is of these numbers."""
    table = ROOT / "benchmarks" / "training" / f"{trainer}.csv"
    points = compare.read(table)
    last = {point.id: point for point in points}
    assert set(last) == set(STATED)
    for id, least in STATED.items():
        assert last[id].mean_return >= least
    compare.draw(tmp_path / "again.svg", points)
    assert (tmp_path / "again.svg").read_bytes() == table.with_suffix(".svg").read_bytes()


def test_stages_have_their_own_options(tmp_path: Path) -> None:
    """A stage begins where the one before ended, in environments with other options."""
    settings = train_cleanrl.Settings(envs=2, rollout=64, epochs=1, minibatch=64)
    short, long = train_cleanrl.Stage(256, {}), train_cleanrl.Stage(128, {"max_episode_steps": 1})
    curves = []
    for name, stages in (("one", [short]), ("two", [short, long])):
        train_cleanrl.train(
            "InvertedPendulum-v5", "mjenv", stages, 1, tmp_path / name, settings, watch="reward_survive"
        )
        with (tmp_path / name / "curve.csv").open() as file:
            curves.append([*csv.DictReader(file)])
    one, two = curves
    assert [int(row["steps"]) for row in two] == [128, 256, 384]
    # The rate falls more slowly in the longer training, so that only the first update has the same data.
    assert two[0]["mean_return"] == one[0]["mean_return"]
    assert float(two[2]["mean_return"]) == 1
    assert 0 < float(two[0]["reward_survive"]) <= 1
