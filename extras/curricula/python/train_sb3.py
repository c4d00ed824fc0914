"""Trains with the PPO of Stable-Baselines3. Only make() depends on the backend; both learn the same bits.

    train_sb3.py InvertedPendulum-v5 [--backend mjenv|gymnasium] [--steps N] [--seed 1] [--out FOLDER]

Writes curve.csv (steps, wall time, mean return of the last 20 episodes), policy.txt for deployment, and model.zip
with normalizer.pkl for Stable-Baselines3.
"""

from __future__ import annotations

import argparse
import functools
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from mjenv_learn.policy import Policy, layers_of, needs_of

ENVS = 8
WINDOW = 20  # episodes
SETTINGS: dict[str, dict[str, Any]] = {
    "InvertedPendulum-v5": {"steps": 100_000, "n_steps": 256, "batch_size": 128, "learning_rate": 1e-3, "n_epochs": 5},
    "Reacher-v5": {"steps": 150_000, "n_steps": 256, "batch_size": 256, "learning_rate": 1e-3, "gamma": 0.9},
    "Hopper-v5": {"steps": 300_000, "n_steps": 512, "batch_size": 256, "learning_rate": 5e-4, "gamma": 0.99},
}
SETTINGS_ELSEWHERE: dict[str, Any] = {"steps": 500_000, "n_steps": 512, "batch_size": 256}


def make(id: str, backend: str) -> Any:
    if backend == "mjenv":
        from mjenv_sb3 import VecEnv

        return VecEnv(id, ENVS)
    import gymnasium
    from stable_baselines3.common.vec_env import DummyVecEnv

    return DummyVecEnv([functools.partial(gymnasium.make, id)] * ENVS)


class Curve(BaseCallback):
    """Writes a line of curve.csv after each rollout."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path, self._start = path, time.perf_counter()

    def _on_training_start(self) -> None:
        self._file = self._path.open("w", buffering=1)
        print("steps,seconds,mean_return", file=self._file)
        self._start = time.perf_counter()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        returns = [episode["r"] for episode in self.model.ep_info_buffer]
        mean = float(np.mean(returns)) if returns else float("nan")
        print(self.num_timesteps, f"{time.perf_counter() - self._start:.3f}", repr(mean), sep=",", file=self._file)

    def _on_training_end(self) -> None:
        self._file.close()


def policy_of(model: PPO, envs: VecNormalize, id: str) -> Policy:
    """The deterministic policy, together with the normalization of its observations."""
    first, _, second, _ = model.policy.mlp_extractor.policy_net
    return Policy(
        id=id,
        mean=envs.obs_rms.mean.tolist(),
        scale=np.sqrt(envs.obs_rms.var + envs.epsilon).tolist(),
        clip=envs.clip_obs,
        low=envs.action_space.low.tolist(),
        high=envs.action_space.high.tolist(),
        layers=layers_of(first, second, model.policy.action_net),
        **needs_of(id, {}),
    )


def train(id: str, backend: str, steps: int | None, seed: int, out: Path) -> None:
    settings = {"seed": seed, "device": "cpu", "stats_window_size": WINDOW, **SETTINGS.get(id, SETTINGS_ELSEWHERE)}
    default_steps = settings.pop("steps")
    envs = VecNormalize(VecMonitor(make(id, backend)), gamma=settings.get("gamma", 0.99))
    model = PPO("MlpPolicy", envs, **settings)
    out.mkdir(parents=True, exist_ok=True)
    model.learn(steps or default_steps, Curve(out / "curve.csv"))
    policy_of(model, envs, id).save(out / "policy.txt")
    model.save(out / "model.zip")
    envs.save(str(out / "normalizer.pkl"))
    envs.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("id")
    parser.add_argument("--backend", choices=("mjenv", "gymnasium"), default="mjenv")
    parser.add_argument("--steps", type=int, help="environment steps; the default depends on the id")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("trained"))
    given = parser.parse_args()
    torch.set_num_threads(1)
    train(given.id, given.backend, given.steps, given.seed, given.out)


if __name__ == "__main__":
    main()
