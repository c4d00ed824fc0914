"""Short trainings on mjenv and on Gymnasium must give the same curve and the same policy.

Needs the Python of `tools/setup training`.
"""

from __future__ import annotations

import csv
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

ROOT = Path(__file__).resolve().parents[4]
sys.path += [str(ROOT / path) for path in ("extras/curricula/python", "benchmarks/training", "bindings/python/tests")]

import compare  # noqa: E402
import mjenv  # noqa: E402
import train_cleanrl  # noqa: E402
from deploy import play  # noqa: E402
from mjenv_learn.policy import Policy  # noqa: E402
from tasks_of_python import NumpyHopper, within  # noqa: E402

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


class TorchHopper(NumpyHopper):
    """Hopper-v5 with tensors that share the memory of the simulation's arrays."""

    def observe(self, sim: Any) -> Any:
        return torch.cat([torch.from_numpy(sim.qpos)[:, 1:], torch.from_numpy(sim.qvel).clamp(-10, 10)], 1)

    def step(self, sim: Any, action: Any) -> Any:
        qpos, qvel = torch.from_numpy(sim.qpos), torch.from_numpy(sim.qvel)
        healthy = within(qpos[:, 1], self.healthy_z_range) & within(qpos[:, 2], self.healthy_angle_range)
        healthy &= within(torch.cat([qpos[:, 2:], qvel], 1), self.healthy_state_range).all(1)
        velocity = (qpos[:, 0] - torch.from_numpy(sim.x)) / self.dt
        ctrl = self.ctrl_cost_weight * torch.tensor(action).square().sum(1)
        return (velocity + healthy * self.healthy_reward) - ctrl, ~healthy, {"x_velocity": velocity}


@pytest.mark.filterwarnings("ignore:The given NumPy array is not writable")
def test_numpy_tasks_may_compute_with_tensors() -> None:
    mjenv.register("TorchHopper-v5", TorchHopper)
    ours, built_in = (mjenv.make_vec(id, 16, autoreset_mode="same_step") for id in ("TorchHopper-v5", "Hopper-v5"))
    np.testing.assert_array_equal(ours.reset(seed=1)[0], built_in.reset(seed=1)[0])
    rng, ended = np.random.default_rng(0), 0
    for _ in range(200):
        action = rng.uniform(-1, 1, (16, 3)).astype(np.float32)
        got, expected = ours.step(action), built_in.step(action)
        for index in range(4):
            assert got[index].tobytes() == expected[index].tobytes()
        ended += int(expected[2].sum())
    assert ended > 50
