"""Trains with RLlib's PPO on mjenv's vector environment; each environment runner steps its rows inside the library.

    rllib_ppo.py [ID] [--iterations N] [--runners N] [--rows N]

Runs on a cluster when started by `ray job submit` or with RAY_ADDRESS set, otherwise on a local one.
"""

from __future__ import annotations

import argparse

import ray
from ray.rllib.algorithms.ppo import PPOConfig


def config(id: str, runners: int, rows: int) -> PPOConfig:
    """The lines that differ from a configuration for Gymnasium: the id and gym_env_vectorize_mode."""
    return (
        PPOConfig()
        # Every worker imports the module before the colon, which registers the ids.
        .environment(f"mjenv:mjenv/{id}")
        .env_runners(
            num_env_runners=runners,
            num_envs_per_env_runner=rows,
            gym_env_vectorize_mode="vector_entry_point",
            rollout_fragment_length="auto",
        )
        .training(train_batch_size_per_learner=4096, minibatch_size=256, num_epochs=5, lr=3e-4)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("id", nargs="?", default="InvertedPendulum-v5")
    parser.add_argument("--iterations", type=int, default=20)
    parser.add_argument("--runners", type=int, default=2)
    parser.add_argument("--rows", type=int, default=8)
    given = parser.parse_args()
    ray.init()
    algorithm = config(given.id, given.runners, given.rows).build_algo()
    for _ in range(given.iterations):
        result = algorithm.train()
        runners = result["env_runners"]
        print(
            f"{runners['num_env_steps_sampled_lifetime']:9.0f} steps, "
            f"mean return {runners.get('episode_return_mean', float('nan')):.1f}",
            flush=True,
        )
    algorithm.stop()
    ray.shutdown()


if __name__ == "__main__":
    main()
