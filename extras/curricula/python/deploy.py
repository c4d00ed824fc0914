"""Plays a saved policy and needs no learning library; examples/cpp/deploy.cpp does the same without Python.

    deploy.py POLICY [--backend mjenv|gymnasium] [--episodes 3] [--seed 100]

Prints a line for each episode: its length, its return as a hexadecimal float in C's format, and a checksum over the
bits of all actions.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Any

from mjenv_learn.policy import Policy

MASK = 2**64 - 1


def make(policy: Policy, backend: str) -> Any:
    if backend == "mjenv":
        import mjenv

        return mjenv.make(policy.id, **policy.keywords())
    import gymnasium

    return gymnasium.make(policy.id)


def play(policy: Policy, backend: str, episodes: int, seed: int) -> list[tuple[int, float, int]]:
    """Length, return and checksum of each episode; only the first reset is seeded."""
    env = make(policy, backend)
    act = policy.acting_in(env) if backend == "mjenv" else policy.act
    played = []
    for episode in range(episodes):
        observation, _ = env.reset(seed=seed if episode == 0 else None)
        length, total, checksum, ended = 0, 0.0, 0xCBF29CE484222325, False
        while not ended:
            action = act(observation)
            for word in action.view("u4").tolist():
                checksum = (checksum ^ word) * 0x100000001B3 & MASK
            observation, reward, terminated, truncated, _ = env.step(action)
            total += float(reward)
            length += 1
            ended = terminated or truncated
        played.append((length, total, checksum))
    env.close()
    return played


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policy", type=Path)
    parser.add_argument("--backend", choices=("mjenv", "gymnasium"), default="mjenv")
    parser.add_argument("--episodes", type=int, default=3)
    parser.add_argument("--seed", type=int, default=100)
    given = parser.parse_args()
    for length, total, checksum in play(Policy.load(given.policy), given.backend, given.episodes, given.seed):
        print(length, re.sub(r"\.?0*p", "p", total.hex()), f"{checksum:016x}")


if __name__ == "__main__":
    main()
