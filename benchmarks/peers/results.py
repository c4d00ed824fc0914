"""The peers, the measured cases, and the CSV file with the results."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path

from common import ROBOTS

# Those that begin with "mujoco4-" are others of the list, on MuJoCo 4.0. Those that end in "-lanesN" step N rows at
# once, or one row at a time where N is 0.
PEERS = (
    "mjenv-c mjenv-rollout mjenv-rollout-lanes0 mjenv-single mjenv mjenv-lanes0 mjenv-lanes2 mjenv-async"
    " gymnasium-single gymnasium-sync gymnasium-async envpool-sync envpool-async mujoco-batch mujoco4-mjenv-c"
    " mujoco4-mjenv-single mujoco4-mjenv mujoco4-mjenv-lanes0 mujoco4-gymnasium-single mujoco4-gymnasium-sync"
).split()
ON_MUJOCO4 = "mujoco4-"
LANES = "-lanes"
FIELDS = "robot envs threads peer steps_per_second block_seconds blocks about cpu cpus date".split()
Row = dict[str, str]


def read(path: Path) -> list[Row]:
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def key(row: Row) -> tuple[int, int, int, int]:
    return ROBOTS.index(row["robot"]), int(row["envs"]), int(row["threads"]), PEERS.index(row["peer"])


def write(path: Path, rows: Iterable[Row]) -> None:
    """Sorted; where several rows measure the same case, the last one counts."""
    by_key = {key(row): row for row in rows}
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(by_key[k] for k in sorted(by_key))
