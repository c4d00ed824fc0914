"""mjenv.train and mjenv.evaluate, and the command mjenv train."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mjenv
from mjenv import AutoresetMode, _learner
from mjenv._engine import ENGINES
from mjenv.cli import main
from mjenv.policy import Policy
from mjenv.training import Settings, Stage, Training
from systems import not_on_windows

ID = "InvertedPendulum-v5"
SHORT: dict[str, Any] = {"rows": 8, "rollout_steps": 32, "minibatch_size": 100, "epochs": 2, "hidden": (16,)}
BATCH = 8 * 32


def trained(steps: int = 4 * BATCH, **keywords: Any) -> Training:
    return mjenv.train("Hopper-v5", steps=steps, settings=SHORT, seed=3, **keywords)


def test_learns_and_writes(tmp_path: Path) -> None:
    """The files of a training: its curve, and a policy that plays as well as the one in memory."""
    training = mjenv.train(ID, steps=50_000, out=tmp_path)
    assert training.curve[-1].mean_return == 1000
    assert {path.name for path in tmp_path.iterdir()} == {
        "checkpoint",
        "curve.csv",
        "curve.svg",
        "policy.txt",
        "training.json",
    }
    with (tmp_path / "curve.csv").open() as file:
        rows = [*csv.DictReader(file)]
    assert [int(row["steps"]) for row in rows] == [point.steps for point in training.curve]
    assert float(rows[-1]["mean_return"]) == 1000
    assert "</svg>" in (tmp_path / "curve.svg").read_text()
    assert Policy.load(tmp_path / "policy.txt") == training.policy()
    evaluation = mjenv.evaluate(tmp_path / "policy.txt", 30)
    assert evaluation.mean_return == 1000
    assert (evaluation.lengths == 1000).all()


def test_the_bits_do_not_depend_on_threads_or_who_steps() -> None:
    first = trained()
    assert trained(threads=3).policy() == first.policy()
    envs = mjenv.make_vec("Hopper-v5", 8, autoreset_mode=AutoresetMode.SAME_STEP)
    settings = Settings.of("Hopper-v5").with_values(SHORT)
    here = Training(envs, settings.with_values({"steps": 4 * BATCH}), seed=3, stepped_here=True)
    while here.steps < 4 * BATCH:
        here.update()
    assert here.policy() == first.policy()
    assert mjenv.train(envs, steps=4 * BATCH, settings=SHORT, seed=3).policy() == first.policy()


def test_resumed_equals_uninterrupted(tmp_path: Path) -> None:
    whole = trained()

    def stop(training: Training) -> None:
        if training.curve[-1].updates == 2:
            training.stop()

    part = trained(out=tmp_path, callback=stop)
    assert len(part.curve) == 2
    resumed = mjenv.train("Hopper-v5", steps=4 * BATCH, out=tmp_path, resume=True, threads=2)
    assert resumed.policy() == whole.policy()
    assert resumed.curve == whole.curve
    with pytest.raises(mjenv.InvalidValueError, match="a training of Hopper-v5, not of Ant-v5"):
        mjenv.train("Ant-v5", out=tmp_path, resume=True)
    with pytest.raises(mjenv.OptionError, match="resume needs"):
        mjenv.train("Ant-v5", resume=True)


def test_stages_and_callbacks(tmp_path: Path) -> None:
    """Stages have their own options; a callback changes settings, options and live values."""
    stages = [Stage(BATCH), Stage(2 * BATCH, {"max_episode_steps": 1})]
    training = trained(stages=stages, out=tmp_path)
    assert [point.mean_length > 1 for point in training.curve] == [True, False, False]
    resumed = trained(stages=[*stages, Stage(BATCH, {"max_episode_steps": 2})], out=tmp_path, resume=True)
    assert [point.mean_length for point in resumed.curve[1:]] == [1, 1, 2]

    def change(training: Training) -> None:
        if training.curve[-1].updates == 1:
            training.set(gamma=0.5, learning_rate=0.0)
            training.set_options(max_episode_steps=3)
        with pytest.raises(mjenv.InvalidValueError, match="rows cannot change"):
            training.set(rows=9)

    changed = trained(callback=change)
    assert changed.curve[-1].mean_length <= 3
    assert changed.curve[-1].learning_rate == 0
    assert changed.settings.gamma == 0.5


def test_the_actor_sees_less() -> None:
    seen = tuple(index != 4 for index in range(11))
    training = trained(steps=1)
    blind = mjenv.train("Hopper-v5", steps=BATCH, settings={**SHORT, "actor_obs": seen}, history=0)
    weights = np.array(blind.policy().layers[0].weights)
    assert (weights[:, 4] == 0).all()
    assert (np.array(training.policy().layers[0].weights)[:, 4] != 0).any()


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_evaluation_plays_the_policy(precision: str) -> None:
    """The returns are those of episodes in Python, with the actions of Policy.act; in float32, nearly."""
    policy = trained().policy()
    got = mjenv.evaluate(policy, 5, seed=40, rows=3, threads=2, precision=precision)
    with mjenv.make("Hopper-v5") as env:
        for episode in range(5):
            obs, _ = env.reset(seed=40 + episode)
            total, length, ended = 0.0, 0, False
            while not ended:
                obs, reward, terminated, truncated, _ = env.step(policy.act(obs.tolist()))
                total, length, ended = total + float(reward), length + 1, terminated or truncated
            if precision == "float64":
                assert (got.returns[episode], got.lengths[episode]) == (total, length)
            else:
                assert got.returns[episode] == pytest.approx(total, rel=0.05)


@pytest.mark.parametrize("activation", ["relu", "elu"])
def test_activations(activation: str) -> None:
    policy = trained(steps=1).policy()
    other = mjenv.train("Hopper-v5", steps=1, settings={**SHORT, "activation": activation}).policy()
    assert [layer.activation for layer in other.layers] == [activation, "identity"]
    assert policy.layers[0].activation == "tanh"
    assert mjenv.evaluate(other, 1).lengths[0] > 0


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(mjenv.InvalidValueError, match=r"settings\.gamma is 3, not 0 to 1"):
        mjenv.train("Hopper-v5", settings={"gamma": 3})
    with pytest.raises(mjenv.OptionError, match="no setting 'gama'"):
        mjenv.train("Hopper-v5", settings={"gama": 0.9})
    with pytest.raises(mjenv.OptionError, match="is a number"):
        mjenv.train("Hopper-v5", settings={"gamma": "much"})
    with pytest.raises(mjenv.InvalidValueError, match="activation is 'sine'"):
        mjenv.train("Hopper-v5", settings={"activation": "sine"})
    with pytest.raises(mjenv.UnknownIdError):
        mjenv.train("Hoper-v5")
    with pytest.raises(mjenv.OptionError, match="the id is a str"):
        mjenv.train(3)  # type: ignore[arg-type]
    with pytest.raises(mjenv.OptionError, match=r"no option 'frame_skp'.*mean 'frame_skip'"):
        mjenv.train("Hopper-v5", frame_skp=2)
    with pytest.raises(mjenv.InvalidValueError, match="max_episode_steps is an int"):
        mjenv.train("Hopper-v5", max_episode_steps=0)
    with pytest.raises(mjenv.OptionError, match="num_envs is an int"):
        mjenv.train("Hopper-v5", settings={"rows": "8"})
    with pytest.raises(mjenv.OptionError, match="SAME_STEP"):
        mjenv.train(mjenv.make_vec("Hopper-v5", 2))
    with pytest.raises(mjenv.InvalidValueError, match="at least one step"):
        mjenv.train("Hopper-v5", steps=0)
    with pytest.raises(FileNotFoundError):
        mjenv.train("Hopper-v5", out=tmp_path, resume=True)
    policy = trained(steps=1).policy()
    with pytest.raises(mjenv.InvalidValueError, match="11 observations and 3 actuators, the environment 17 and 6"):
        mjenv.evaluate(policy, 1, id="Walker2d-v5")
    with pytest.raises(mjenv.InvalidValueError, match="precision is 'half'"):
        mjenv.evaluate(policy, 1, precision="half")
    with pytest.raises(mjenv.InvalidValueError, match="episodes is 0"):
        mjenv.evaluate(policy, 0)


def test_a_wrong_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_learner, "FILE", Path(ENGINES.get().path).name)
    _learner.library.cache_clear()
    try:
        with pytest.raises(mjenv.EngineError, match="is not the library of this package"):
            mjenv.train(ID)
    finally:
        _learner.library.cache_clear()


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        "--rows",
        "8",
        "--rollout-steps",
        "32",
        "--minibatch-size",
        "100",
        "--hidden",
        "16,8",
        "--out",
        str(tmp_path),
    ]
    assert main(["train", "Hopper-v5", "--steps", "512", "--option", "frame_skip=2", *words]) == 0
    assert "Hopper-v5: 512 steps" in capsys.readouterr().out
    assert [len(layer.bias) for layer in Policy.load(tmp_path / "policy.txt").layers] == [16, 8, 3]
    resume = ["train", "Hopper-v5", "--steps", "1024", "--out", str(tmp_path), "--resume"]
    assert main([*resume, "--option", "frame_skip=2"]) == 0
    assert "Hopper-v5: 1,024 steps" in capsys.readouterr().out
    assert main(resume) == 2  # without the option, the rows are others
    assert main(["train", "Hopper-v5", "--gamma", "3", "--out", str(tmp_path)]) == 2
    assert "settings.gamma is 3" in capsys.readouterr().err
    assert main(["train", "Hopper-v5", "--stage", "many", "--out", str(tmp_path)]) == 2
    assert main(["train", "Hopper-v5", *words, "--stage", "256", "frame_skip=3", "--seconds", "9"]) == 0


def test_the_command_starts_without_numpy(tmp_path: Path) -> None:
    """Importing NumPy or Gymnasium would take longer than the command needs until its first update."""
    code = (
        "import atexit, runpy, sys; atexit.register(lambda: print(*sys.modules)); "
        "runpy.run_module('mjenv', {}, '__main__')"
    )
    small = ["--rows", "8", "--rollout-steps", "32", "--minibatch-size", "64", "--option", "frame_skip=2"]
    command = [sys.executable, "-c", code, "train", "Hopper-v5", "--out", str(tmp_path), *small]
    for words in (["--steps", "256"], ["--steps", "512", "--resume"]):
        run = subprocess.run([*command, *words], capture_output=True, text=True, check=True, timeout=120)
        imported = {*run.stdout.splitlines()[-1].split()}
        assert {"mjenv", "mjenv.cli.train", "mjenv.training"} <= imported
        assert not imported & {"numpy", "gymnasium", "torch"}
    assert len((tmp_path / "curve.csv").read_text().splitlines()) == 3


def test_environments_are_made_around_the_rows_of_the_learner() -> None:
    """A callback that reads them sees the episodes that the learner plays, and changes no bit."""
    found: list[Any] = []

    def look(training: Training) -> None:
        assert isinstance(training.envs, mjenv.VectorEnv)
        assert training.envs is training.envs
        found.append(training.envs.data.qpos.copy())

    watched = trained(callback=look, max_episode_steps=-1, frame_skip=2, engine=mjenv.engine().name)
    assert watched.policy() == trained(max_episode_steps=-1, frame_skip=2).policy()
    assert not np.array_equal(found[0], found[1])
    spec = watched.envs.spec
    assert spec is not None
    again = mjenv.make_vec(spec)
    kept = ("frame_skip", "autoreset_mode", "max_episode_steps", "num_threads")
    assert {name: again._pool.rows.options[name] for name in kept} == {
        "frame_skip": 2,
        "autoreset_mode": "same_step",
        "max_episode_steps": 0,
        "num_threads": 1,
    }
    assert (again.num_envs, again.metadata) == (8, watched.envs.metadata)


@not_on_windows("Wine sends no SIGINT")
def test_interrupt(tmp_path: Path) -> None:
    """Ctrl-C leaves the best policy and a checkpoint, from which the training continues."""
    command = [sys.executable, "-m", "mjenv", "train", ID, "--steps", "100000000", "--out", str(tmp_path / "out")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while not (tmp_path / "out" / "training.json").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "best policy so far" in output
    assert Policy.load(tmp_path / "out" / "policy.txt").id == ID
    done = len((tmp_path / "out" / "curve.csv").read_text().splitlines()) - 1
    resumed = mjenv.train(ID, steps=2048 * (done + 1), out=tmp_path / "out", resume=True)
    assert len(resumed.curve) == done + 1
