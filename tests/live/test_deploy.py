"""Trained policies give the same actions and returns in C++ and in Python, on mjenv and on Gymnasium."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
POLICIES = sorted((EXAMPLES / "policies").glob("*.txt"))

# The return of each policy in the worst of the episodes below.
LEAST = {"Hopper-v5": 2000, "InvertedPendulum-v5": 1000, "Reacher-v5": -12}


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """examples/cpp/deploy.cpp, linked with the library that Python uses."""
    made = tmp_path_factory.mktemp("cpp") / "deploy"
    library = Path(os.environ["MJENV_LIBRARY"])
    flags = ["-std=c++17", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", f"-I{ROOT}/capi/include"]
    source = EXAMPLES / "cpp" / "deploy.cpp"
    subprocess.run(["c++", *flags, source, "-o", made, library, f"-Wl,-rpath,{library.parent}"], check=True)
    return made


def run(*command: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*map(str, command)], capture_output=True, text=True)


def test_there_are_policies() -> None:
    assert {policy.stem for policy in POLICIES} == set(LEAST)


@pytest.mark.parametrize("policy", POLICIES, ids=[policy.stem for policy in POLICIES])
def test_bits(program: Path, policy: Path) -> None:
    episodes = 10 if policy.stem == "Reacher-v5" else 1
    script = EXAMPLES / "python" / "deploy.py"
    played = [
        run(program, policy, episodes, 100),
        run(sys.executable, script, policy, "--episodes", episodes),
        run(sys.executable, script, policy, "--episodes", episodes, "--backend", "gymnasium"),
    ]
    for ended in played:
        assert ended.returncode == 0, ended.stderr
    assert played[0].stdout == played[1].stdout == played[2].stdout
    returns = [float.fromhex(line.split()[1]) for line in played[0].stdout.splitlines()]
    assert len(returns) == episodes
    assert min(returns) >= LEAST[policy.stem]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mjenv-policy 1", "mjenv-policy 2", "no policy"),
        ("id Reacher-v5", "id Reacher-v9", "Reacher-v9"),
        ("id Reacher-v5", "id Ant-v5", "do not fit"),
        ("tanh", "relu", "unknown activation relu"),
        ("\nmean ", "\nmean 0.5 ", "mean is missing or of another length"),
        ("\nclip ", "\nclap ", "clip is missing"),
        ("\nweights ", "\nweights 1 ", "another length than the inputs"),
        ("\nbias ", "\nbias 1 ", "do not fit"),
    ],
)
def test_bad_policies(program: Path, tmp_path: Path, old: str, new: str, message: str) -> None:
    text = (EXAMPLES / "policies" / "Reacher-v5.txt").read_text()
    assert old in text
    file = tmp_path / "policy.txt"
    file.write_text(text.replace(old, new, 1))
    ended = run(program, file)
    assert ended.returncode == 1
    assert message in ended.stderr
