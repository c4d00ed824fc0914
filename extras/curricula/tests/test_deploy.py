"""Trained policies give the same actions and returns in C++ and in Python, on mjenv and on Gymnasium."""

from __future__ import annotations

import os
import re
import statistics
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

import mjenv

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = ROOT / "examples"
POLICIES = sorted((ROOT / "extras/curricula/policies").glob("*.txt"))
for_each_policy = pytest.mark.parametrize("policy", POLICIES, ids=[policy.stem for policy in POLICIES])

ROW = re.compile(r"\| (?P<id>\w+-v5) \|.*?\| (?P<mean>-?[\d,.]+) ± (?P<deviation>[\d,.]+) \|")


@dataclass(frozen=True)
class Stated:
    """What docs/training.md says of the returns of a policy."""

    mean: float
    deviation: float


def number(text: str) -> float:
    return float(text.replace(",", ""))


STATED = {
    row["id"]: Stated(number(row["mean"]), number(row["deviation"]))
    for row in ROW.finditer((ROOT / "docs" / "training.md").read_text())
}


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


def episodes_of(program: Path, policy: Path, count: int, seed: int) -> list[tuple[int, float]]:
    """Lengths and returns."""
    played = run(program, policy, count, seed)
    assert played.returncode == 0, played.stderr
    lines = [line.split() for line in played.stdout.splitlines()]
    assert len(lines) == count
    return [(int(length), float.fromhex(total)) for length, total, _ in lines]


def test_each_robot_has_a_policy() -> None:
    v5 = {id for id in mjenv.ids() if id.endswith("-v5")}
    assert {policy.stem for policy in POLICIES} == set(STATED) == v5


@for_each_policy
def test_bits(program: Path, policy: Path) -> None:
    script = ROOT / "extras/curricula/python/deploy.py"
    played = [
        run(program, policy, 1, 100),
        run(sys.executable, script, policy, "--episodes", 1),
        run(sys.executable, script, policy, "--episodes", 1, "--backend", "gymnasium"),
    ]
    for ended in played:
        assert ended.returncode == 0, ended.stderr
    assert played[0].stdout == played[1].stdout == played[2].stdout


@for_each_policy
def test_returns(program: Path, policy: Path) -> None:
    """Not exactly those of the documentation, because a tanh of another kind of CPU changes the episodes."""
    played = episodes_of(program, policy, 20, 100)
    stated = STATED[policy.stem]
    assert statistics.fmean(total for _, total in played) > stated.mean - stated.deviation - 0.01 * abs(stated.mean)


@for_each_policy
@pytest.mark.parametrize("seed", range(8))
def test_no_fall(program: Path, policy: Path, seed: int) -> None:
    """Each robot goes on for 5 seconds, or to the time limit of its episodes."""
    with mjenv.make(policy.stem) as env:
        assert env.spec is not None
        limit, dt = env.spec.max_episode_steps, env.dt
    [(length, _)] = episodes_of(program, policy, 1, seed)
    assert length == limit or length * dt >= 5


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mjenv-policy 2", "mjenv-policy 3", "no policy"),
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
    text = (ROOT / "extras/curricula/policies" / "Reacher-v5.txt").read_text()
    assert old in text
    file = tmp_path / "policy.txt"
    file.write_text(text.replace(old, new, 1))
    ended = run(program, file)
    assert ended.returncode == 1
    assert message in ended.stderr
