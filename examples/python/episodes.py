"""Plays three seeded episodes of each id with mjenv.make.

    episodes.py --norm plain ID...

Prints ID, steps, return, steps per second and a checksum over every bit of every output, separated by tabs.
"""

import argparse
import sys
import time
from collections.abc import Iterable

import numpy as np

import mjenv

EPISODES, SEED = 3, 42
MASK = 2**64 - 1


def mix(checksum: int, words: Iterable[int]) -> int:
    for word in words:
        checksum = (checksum ^ word) * 0x100000001B3 & MASK
    return checksum


def bits(*values: object) -> list[int]:
    """The 64-bit patterns of float64 numbers and arrays, in order."""
    flat = np.concatenate([np.atleast_1d(np.asarray(value, np.float64)) for value in values]) if values else np.empty(0)
    return flat.view(np.uint64).tolist()


def play(env_id: str, norm: str) -> None:
    checksum, steps, total, seconds = 0xCBF29CE484222325, 0, 0.0, 0.0
    with mjenv.make(env_id, norm=norm) as env:
        env.action_space.seed(SEED)
        for episode in range(EPISODES):
            obs, info = env.reset(seed=SEED if episode == 0 else None)
            checksum = mix(checksum, bits(obs, *info.values()))
            ended = False
            while not ended:
                action = env.action_space.sample()
                start = time.perf_counter()
                obs, reward, terminated, truncated, info = env.step(action)
                seconds += time.perf_counter() - start
                checksum = mix(checksum, bits(obs, reward))
                checksum = mix(checksum, [terminated, truncated])
                checksum = mix(checksum, bits(*info.values()))
                total += float(reward)
                steps += 1
                ended = terminated or truncated
    print(env_id, steps, total.hex(), f"{steps / seconds:.0f}", f"{checksum:016x}", sep="\t", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ids", nargs="+", metavar="ID")
    parser.add_argument("--norm", default="auto", choices=["auto", "fused", "plain"])
    arguments = parser.parse_args()
    for env_id in arguments.ids:
        print(env_id, file=sys.stderr)
        play(env_id, arguments.norm)


if __name__ == "__main__":
    main()
