"""Functions that several benchmarks use."""

from __future__ import annotations

from pathlib import Path

ROBOTS = (
    "Ant HalfCheetah Hopper Humanoid HumanoidStandup InvertedDoublePendulum InvertedPendulum Pusher Reacher Swimmer"
    " Walker2d"
).split()


def cpu_model() -> str:
    """The name of the CPU with its family and model, because virtual machines shorten names."""
    first = Path("/proc/cpuinfo").read_text().partition("\n\n")[0]
    said = dict(line.split(":", 1) for line in first.splitlines() if ":" in line)
    found = {name.strip(): value.strip() for name, value in said.items()}
    if "model name" not in found:
        return "unknown"
    return f"{found['model name']} (family {found.get('cpu family', '?')}, model {found.get('model', '?')})"
