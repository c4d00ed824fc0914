"""A cluster of three Ray nodes on this machine."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[4]
sys.path += [str(ROOT / "extras/curricula/distributed"), str(ROOT / "extras/curricula/python")]


@pytest.fixture(scope="session")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Gives the tests their own home folder, because Ray keeps the token of its clusters there."""
    made = tmp_path_factory.mktemp("home")
    os.environ["HOME"] = str(made)
    # By default Ray's workers run at low priority and starve on a busy machine.
    os.environ["RAY_worker_niceness"] = "0"  # noqa: SIM112 Ray spells it so
    return made


@pytest.fixture(scope="session")
def cluster(home: Path) -> Iterator[Any]:
    """A head with one CPU, and two nodes with two each."""
    import ray
    from ray.cluster_utils import Cluster

    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    for _ in range(2):
        made.add_node(num_cpus=2)
    ray.init(address=made.address, log_to_driver=False)
    yield made
    ray.shutdown()
    made.shutdown()
