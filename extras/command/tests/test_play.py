"""What acts in `mjenv play`: policies and normalizers. tests/pictures/test_play.py has the videos, and
tests/long/check_sb3.py Stable-Baselines3, which a stand-in replaces here."""

import dataclasses
import os
import pickle
import sys
import types
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mjenv
from mjenv_command import main, play
from mjenv_learn.policy import Input, Layer, Policy

LINEAR = np.arange(22.0).reshape(2, 11)[:, :10] / 20  # Reacher's actions from its observations
POLICY = Policy(
    "Reacher-v5",
    mean=[0.0] * 10,
    scale=[1.0] * 10,
    clip=10.0,
    low=[-1.0] * 2,
    high=[1.0] * 2,
    layers=[Layer("tanh", LINEAR.tolist(), [0.0, 0.1])],
)


class Model:
    """What Stable-Baselines3's PPO.load gives."""

    def predict(self, obs: Any, deterministic: bool) -> Any:
        assert deterministic
        if obs.shape != (10,):
            raise ValueError("Unexpected observation shape")
        return np.tanh(LINEAR @ obs), None


class Ppo:
    @staticmethod
    def load(path: Path, device: str) -> Model:
        assert (zipfile.is_zipfile(path), device) == (True, "cpu")
        return Model()


class Normalizer:
    """What a pickled VecNormalize gives."""

    def __init__(self, mean: float) -> None:
        self.mean = mean

    def normalize_obs(self, obs: Any) -> Any:
        return obs - self.mean


class Unseen:
    """Takes the place of the sheet of pictures."""

    def __init__(self, path: Path, rate: int) -> None:
        pass

    def add(self, env: mjenv.Environment) -> None:
        pass

    def close(self) -> None:
        pass


@pytest.fixture(autouse=True)
def stand_ins(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    sb3 = types.ModuleType("stable_baselines3")
    sb3.PPO = Ppo  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "stable_baselines3", sb3)
    monkeypatch.setattr(play, "Sheet", Unseen)
    monkeypatch.setattr(play, "needed", lambda *modules: None)
    monkeypatch.chdir(tmp_path)
    with zipfile.ZipFile("model.zip", "w") as file:
        file.writestr("data", "{}")
    POLICY.save(Path("policy.txt"))
    Path("text.pkl").write_text("text")


def printed(act: Any, **options: Any) -> str:
    """What mjenv play prints of the episode in which these actions are taken."""
    env = mjenv.make("Reacher-v5", **options)
    obs, total = env.reset(seed=4)[0], 0.0
    for _ in range(50):
        obs, reward, *_ = env.step(act(obs))
        total += reward
    return f"a.png: 50 steps, return {total:.6g}\n"


def run(*words: str) -> int:
    return main(["play", "Reacher-v5", "--seed", "4", "--video", "a.png", *words])


def test_stable_baselines3(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--policy", "model.zip") == 0
    assert capsys.readouterr().out == printed(lambda obs: np.tanh(LINEAR @ obs))


def test_a_document_of_draws(capsys: pytest.CaptureFixture[str]) -> None:
    Path("draws.json").write_text('{"noise": {"observation": 0.1}, "delay": {"action": 2}}')
    assert run("--policy", "model.zip", "--randomize", "draws.json") == 0
    acted = printed(lambda obs: np.tanh(LINEAR @ obs), noise=mjenv.Noise(observation=0.1), delay=mjenv.Delay(2))
    assert capsys.readouterr().out == acted


def test_normalizers(capsys: pytest.CaptureFixture[str]) -> None:
    Path("other.pkl").write_bytes(pickle.dumps(Normalizer(0.25)))
    assert run("--policy", "model.zip", "--normalizer", "other.pkl") == 0
    assert capsys.readouterr().out == printed(lambda obs: np.tanh(LINEAR @ (obs - 0.25)))


def test_a_normalizer_that_nobody_named_runs_no_code(capsys: pytest.CaptureFixture[str]) -> None:
    Path("normalizer.pkl").write_bytes(pickle.dumps(Code()))
    assert run("--policy", "model.zip") == 0
    out, errors = capsys.readouterr()
    assert out == printed(lambda obs: np.tanh(LINEAR @ obs))
    assert "normalizer.pkl is not used" in errors
    assert not Path("ran").exists()


class Code:
    """An object that makes a folder when it is loaded."""

    def __reduce__(self) -> Any:
        return os.mkdir, ("ran",)


def test_a_policy_as_text(capsys: pytest.CaptureFixture[str]) -> None:
    """The normalizer belongs to model.zip; the text holds its own normalization."""
    Path("normalizer.pkl").write_bytes(pickle.dumps(Normalizer(0.25)))
    assert run("--policy", "policy.txt") == 0
    assert capsys.readouterr().out == printed(lambda obs: POLICY.act(obs))


def test_a_policy_names_its_environment(capsys: pytest.CaptureFixture[str]) -> None:
    named = dataclasses.replace(
        POLICY, inputs=[Input("all", 10)], about={"options": {"reward_dist_weight": 3, "history": 1}}
    )
    terms = {one.name: one.count for one in mjenv.make("Reacher-v5", history=1).fields("observation")}
    dataclasses.replace(named, inputs=[Input(*term) for term in terms.items()]).save(Path("named.txt"))
    words = ["play", "--seed", "4", "--video", "a.png", "--policy", "named.txt"]
    for more in ([], ["--option", "reward_dist_weight=5"], ["--option", "reward_dist_weight=1"]):
        assert main([*words, *more]) == 0
        weight = float(more[1].partition("=")[2]) if more else 3
        assert capsys.readouterr().out == printed(lambda obs: POLICY.act(obs), reward_dist_weight=weight)
    assert main(["play", "--video", "a.png"]) == 2
    assert "name an id, or a --policy" in capsys.readouterr().err
    named.save(Path("named.txt"))
    assert main(words) == 2
    assert 'sees "all", 10 numbers, but the observation has no such term; there are ' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--policy", "none.zip"], "none.zip"),
        (["--policy", "text.pkl"], "text.pkl: the text is no policy"),
        (["--policy", "model.zip", "--algorithm", "Poet"], "no algorithm 'Poet'"),
        (["--policy", "model.zip", "--normalizer", "none.pkl"], "none.pkl"),
        (["--policy", "model.zip", "--normalizer", "text.pkl"], "text.pkl is no saved VecNormalize"),
        (["--policy", "policy.txt", "--normalizer", "normalizer.pkl"], "leave --normalizer out"),
        (["--normalizer", "normalizer.pkl"], "--normalizer belongs to a --policy"),
        (["--camera", "nosuch"], "nosuch"),
    ],
)
def test_refusals(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(*words) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        ("policy.txt", "is a policy for Reacher-v5, not for Ant-v5"),
        ("model.zip", "cannot act on observations of Ant-v5"),
    ],
)
def test_a_policy_of_another_robot(policy: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["play", "Ant-v5", "--video", "a.png", "--policy", policy]) == 2
    assert message in capsys.readouterr().err
