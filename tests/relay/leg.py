"""leg.py GOLDEN FIRST END IN OUT THREADS: as leg.c, from Python."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import mjenv

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bindings" / "python" / "tests"))

import golden


def main() -> None:
    path, first, end, taken, left, threads = sys.argv[1:]
    expected = golden.load(Path(path))
    envs = mjenv.make_vec(
        expected.id, 3, num_threads=int(threads), autoreset_mode="Disabled", **{"strict": 0, **expected.keywords}
    )
    envs.reset(seed=[1, 2, expected.seed])
    if int(first) > 0:
        envs.restore(Path(taken).read_bytes(), 2)
    episodes = expected["reset_at"].tolist()
    for step in range(int(first), int(end)):
        if step in episodes[1:]:
            obs, _ = envs.reset(options={"reset_mask": np.array([False, False, True])})
            assert golden.same(obs[2], expected["reset_obs"][episodes.index(step)]), step
        obs, rewards, terminations, truncations, _ = envs.step(np.stack([expected["action"][step]] * 3))
        assert golden.same(obs[2], expected["obs"][step]), step
        assert rewards[2].tobytes() == expected["reward"][step].tobytes(), step
        assert (terminations[2], truncations[2]) == (expected["terminated"][step], expected["truncated"][step]), step
    Path(left).write_bytes(envs.snapshot(2))


if __name__ == "__main__":
    main()
