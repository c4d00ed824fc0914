"""mjenv verify, beside an installed Gymnasium."""

from __future__ import annotations

import subprocess
import sys

import gymnasium
import mujoco
import pytest

import mjenv
import mjenv_command


def test_verify_for_users() -> None:
    command = [sys.executable, "-m", "mjenv", "verify", "Hopper-v5", "Ant-v4", "--option-sets", "2", "--steps", "20"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    first, *ids = run.stdout.splitlines()
    assert f"gymnasium 1.4.0, mujoco {mujoco.__version__}" in first
    assert [line.split(":")[0] for line in ids] == ["Hopper-v5", "Ant-v4"]
    assert all("4 runs of 20 steps" in line and line.endswith("every bit equal") for line in ids)


def test_verify_tells_of_a_difference(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    make = mjenv.make
    monkeypatch.setattr(mjenv, "make", lambda id, **options: make(id, **{**options, "ctrl_cost_weight": 0.7}))
    assert mjenv_command.main(["verify", "Hopper-v5", "--option-sets", "2", "--seeds", "1", "--steps", "5"]) == 1
    out = capsys.readouterr().out
    assert "Hopper-v5: DIFFERS after 0 equal runs: Hopper-v5 {} seed" in out
    assert "1 of 1 ids differ" in out


def test_verify_goes_on_after_an_id_that_gymnasium_lacks(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(gymnasium.registry, "Ant-v5")
    arguments = ("--option-sets", "1", "--seeds", "1", "--steps", "5")
    assert mjenv_command.main(["verify", "Ant-v5", "Hopper-v5", *arguments]) == 0
    _, ant, hopper = capsys.readouterr().out.splitlines()
    assert ant.startswith("Ant-v5: not compared, because Gymnasium cannot build it: ")
    assert hopper.endswith("every bit equal")
    assert mjenv_command.main(["verify", "Ant-v5", *arguments]) == 2
    assert "nothing was compared" in capsys.readouterr().err
