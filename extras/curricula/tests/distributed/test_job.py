"""A training by `ray job submit`, as docs/distributed.md says.

To a cluster of one node, as several on one machine would remove each other's copies of a job's files; so it runs before
the other tests begin theirs.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from ray.cluster_utils import Cluster

ROOT = Path(__file__).resolve().parents[4]


def test_ray_job_submit(home: Path, tmp_path: Path) -> None:
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 3, "include_dashboard": True})
    command = [
        *(Path(sys.executable).parent / "ray", "job", "submit", "--address", f"http://{cluster.head_node.webui_url}"),
        *("--working-dir", ROOT / "extras/curricula", "--"),
        *(sys.executable, "distributed/train.py", "Reacher-v5", "--updates", "2", "--rows", "4", "--out", tmp_path),
    ]
    ended = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=400)
    cluster.shutdown()
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "steps/s a pool" in ended.stdout
    assert (tmp_path / "policy.txt").read_text().startswith("mjenv-policy 1\nid Reacher-v5\n")
