"""extras/curricula/python/train_randomised.py: models with other masses and frictions, against Gymnasium's."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path.append(str(ROOT / "extras/curricula/python"))

import train_randomised  # noqa: E402
from mjenv_learn.policy import Policy  # noqa: E402

POLICIES = ROOT / "extras/curricula/policies"
EPISODES, SEED = 2, 5


def test_rows_have_their_own_models() -> None:
    """The mean returns are those of Gymnasium's environments with the same masses and frictions, every bit."""
    policy, factors = Policy.load(POLICIES / "Hopper-v5.txt"), np.array([0.5, 1.5])
    envs: list[Any] = []
    for mass in factors:
        for friction in factors:
            for _ in range(EPISODES):
                env: Any = gymnasium.make("Hopper-v5")
                env.unwrapped.model.body_mass[:] *= mass
                env.unwrapped.model.geom_friction[:, 0] *= friction
                mujoco.mj_setConst(env.unwrapped.model, env.unwrapped.data)
                envs.append(env)
    observations = np.stack([env.reset(seed=SEED + index % EPISODES)[0] for index, env in enumerate(envs)])
    network, returns, going_on = train_randomised.Network(policy), np.zeros(len(envs)), [True] * len(envs)
    while any(going_on):
        actions = network.act(observations)
        for index, env in enumerate(envs):
            if going_on[index]:
                observations[index], reward, terminated, truncated, _ = env.step(actions[index])
                returns[index] += reward
                going_on[index] = not (terminated or truncated)
    expected = returns.reshape(2, 2, EPISODES).mean(axis=2)
    assert len(np.unique(expected)) == 4
    np.testing.assert_array_equal(train_randomised.play(policy, factors, EPISODES, SEED), expected)


def test_the_committed_comparison(tmp_path: Path) -> None:
    """The drawing is of the committed numbers, and docs/randomisation.md states them."""
    factors, returns = train_randomised.read(POLICIES / "randomised" / "returns.csv")
    train_randomised.draw(tmp_path / "again.svg", factors, returns)
    assert (tmp_path / "again.svg").read_bytes() == (ROOT / "docs" / "randomisation.svg").read_bytes()
    inside = (factors >= train_randomised.DRAWN[0]) & (factors <= train_randomised.DRAWN[1])
    page = (ROOT / "docs" / "randomisation.md").read_text()
    for table in returns.values():
        assert f"{table[np.ix_(inside, inside)].mean():.0f} | {table.mean():.0f} |" in page


def test_numbers_are_read_as_they_were_written(tmp_path: Path) -> None:
    factors, returns = np.array([0.5, 1.0, 2.0]), {"fixed": np.arange(9.0).reshape(3, 3)}
    train_randomised.write(tmp_path / "returns.csv", factors, returns)
    same, again = train_randomised.read(tmp_path / "returns.csv")
    assert same.tolist() == factors.tolist()
    assert {name: table.tolist() for name, table in again.items()} == {"fixed": returns["fixed"].tolist()}


@pytest.mark.parametrize(("part", "expected"), [(0, "#440154"), (0.25, "#3b528b"), (1, "#fde725")])
def test_colours(part: float, expected: str) -> None:
    assert train_randomised.colour(part) == expected
