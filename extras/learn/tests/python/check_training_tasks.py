"""mjenv.train with tasks that do not belong to mjenv, in a process of their own, because ids stay registered."""

from __future__ import annotations

import math
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mjenv
from mjenv_command import main
from mjenv_command.policies import policy_of
from mjenv_learn.policy import Policy
from mjenv_learn.training import Training

SHORT: dict[str, Any] = {"rows": 8, "rollout_steps": 32, "minibatch_size": 100, "epochs": 2, "hidden": (16,)}
BATCH = 8 * 32
ROOT = Path(__file__).resolve().parents[4]


class Slide(mjenv.Task):
    """A mass that is to stay near 0, in NumPy."""

    model = (
        "<mujoco><worldbody><body><joint name='x' type='slide' axis='1 0 0' damping='20'/><geom size='0.1'/></body>"
        "</worldbody><actuator><motor joint='x' ctrlrange='-1 1' ctrllimited='true' gear='50'/></actuator></mujoco>"
    )
    frame_skip = 5
    time_limit = 200
    fault = ""

    def reset(self, rng: Any, rows: int) -> Any:
        return rng.uniform(-1, 1, (rows, 1)), np.zeros((rows, 1))

    def observe(self, sim: Any) -> Any:
        return np.concatenate([sim.qpos, sim.qvel], 1)

    def step(self, sim: Any, action: Any) -> Any:
        reward = -np.abs(sim.qpos[:, 0])
        if self.fault:
            reward[3] = np.inf
        return reward, np.zeros(len(reward), bool), {}


class Blind(Slide):
    """The policy does not see the speed, the critic does."""

    def observe(self, sim: Any) -> Any:
        return {"policy": sim.qpos, "critic": np.concatenate([sim.qpos, sim.qvel], 1)}


class Counts(Slide):
    """The reward counts the episodes of the row, in a number that resets keep."""

    state = {"episodes": ()}  # noqa: RUF012
    kept = ("episodes",)

    def reset(self, rng: Any, rows: int) -> Any:
        return *super().reset(rng, rows), {"episodes": rng.kept["episodes"] + 1}

    def step(self, sim: Any, action: Any) -> Any:
        return sim.episodes.copy(), np.zeros(len(action), bool), {}


mjenv.register("Counts-v0", Counts)
mjenv.register("Slide-v0", Slide)
mjenv.register("Blind-v0", Blind)


def test_own_task() -> None:
    """A task in NumPy learns, and its policy plays."""
    settings = {"rows": 16, "rollout_steps": 50, "minibatch_size": 200, "learning_rate": 3e-3, "gamma": 0.95}
    training = mjenv.train("Slide-v0", steps=60_000, settings=settings)
    played = [point.mean_return for point in training.curve if not math.isnan(point.mean_return)]
    first, last = played[0], played[-1]
    assert last > first / 4  # less than a quarter as far away
    evaluation = mjenv.evaluate(training.policy(), 40, rows=16)
    assert evaluation.mean_return > first / 4
    assert (evaluation.lengths == 200).all()
    again = mjenv.evaluate(training.policy(), 40, rows=16)
    assert np.array_equal(again.returns, evaluation.returns)


TASKS = """
import mjenv
import numpy as np

class Slide(mjenv.Task):
    model = {model!r}
    time_limit = 20
    state = {{"goal": ()}}

    def reset(self, rng, rows):
        return rng.uniform(-1, 1, (rows, 1)), np.zeros((rows, 1)), {{"goal": rng.uniform(-1, 1, rows)}}

    def observe(self, sim):
        return np.concatenate([sim.qpos, sim.qvel, sim.goal[:, None]], 1)

    def step(self, sim, action):
        return -np.abs(sim.qpos[:, 0] - sim.goal), np.zeros(len(action), bool), {{}}

mjenv.register("FileSlide-v0", Slide)
"""


def test_the_command_trains_tasks_of_a_file(tmp_path: Path) -> None:
    """A task in NumPy with draws and stages; its training goes on, and its policy plays, where the command names the
    file."""
    file, folder = tmp_path / "slide.py", tmp_path / "trained"
    file.write_text(TASKS.format(model=Slide.model))
    (tmp_path / "draws.json").write_text('{"randomize": {"geom_friction": {"kind": "scale", "low": 0.5, "high": 1}}}')
    words = ["--tasks", str(file), "--out", str(folder), "--rows=8", "--rollout-steps=32", "--minibatch-size=100"]
    begin = ["train", "FileSlide-v0", *words, "--randomize", str(tmp_path / "draws.json")]
    assert main([*begin, "--stage", "256", "--stage", "256", "frame_skip=5"]) == 0
    assert main(["train", "FileSlide-v0", *words, "--resume", "--steps", "1024"]) == 0
    assert len((folder / "curve.csv").read_text().splitlines()) == 5
    options = Policy.load(folder / "policy.txt").about["options"]
    assert (options["frame_skip"], options["randomize"]["geom_friction"]["low"]) == (5, 0.5)
    assert mjenv.evaluate(folder / "policy.txt", 3).lengths.tolist() == [20] * 3
    alone = [sys.executable, "-m", "mjenv", "train", "FileSlide-v0", "--out", str(folder), "--resume"]
    refused = subprocess.run(alone, capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert f"it continues by mjenv train FileSlide-v0 --out {folder} --resume --tasks {file}" in refused.stderr


def test_groups(tmp_path: Path) -> None:
    """Each network sees its own group of the observation, unless the settings say what it sees."""
    training = mjenv.train("Blind-v0", steps=BATCH, settings=SHORT)
    weights = np.array(training.policy().layers[0].weights)
    assert weights.shape[1] == 1
    assert [one.count for one in training.policy().inputs] == [1]
    assert training.settings.critic_obs == (False, True, True)
    assert mjenv.evaluate(training.policy(), 3).lengths.tolist() == [200] * 3
    policy = training.policy()
    env, envs = mjenv.make("Blind-v0"), mjenv.make_vec("Blind-v0", 3)
    obs, many = env.reset(seed=5)[0], envs.reset(seed=5)[0]
    action = policy.act(obs)
    assert action.shape == env.action_space.shape
    assert np.array_equal(policy.act(many)[0], action)
    assert np.array_equal(policy.acting_in(env)(np.concatenate([*obs.values()])), action)
    policy.save(tmp_path / "policy.txt")
    act = policy_of(tmp_path / "policy.txt", env, "PPO", None)  # what mjenv play and mjenv view call
    assert np.array_equal(act(obs), action)
    assert np.array_equal(act(many), policy.act(many))
    deploy = runpy.run_path(str(ROOT / "extras/curricula/python" / "deploy.py"))
    evaluation = mjenv.evaluate(policy, 1, seed=5)
    assert deploy["play"](policy, "mjenv", 1, 5)[0][:2] == (evaluation.lengths[0], evaluation.returns[0])
    told = mjenv.train("Blind-v0", steps=1, settings={**SHORT, "actor_obs": (True, True, True)})
    assert (np.array(told.policy().layers[0].weights)[:, 2] != 0).any()


def test_evaluated_episodes_are_first_ones() -> None:
    policy = mjenv.train("Counts-v0", steps=1, settings=SHORT).policy()
    for rows in (1, 4):
        assert mjenv.evaluate(policy, 4, rows=rows).returns.tolist() == [200] * 4


def test_a_suite_task_and_randomisation() -> None:
    training = mjenv.train(
        "dm_control/cartpole-balance-v0", steps=1, settings=SHORT, randomize={"geom_friction": mjenv.Scale(0.9, 1.1)}
    )
    assert training.steps == BATCH
    assert mjenv.evaluate(training.policy(), 2).lengths.tolist() == [1000, 1000]


def test_not_finite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reward that is not finite ends the training with its row and step, and leaves its files."""

    def spoil(training: Training) -> None:
        if training.curve[-1].updates == 2:
            monkeypatch.setattr(Slide, "fault", "reward")

    settings = {**SHORT, "rollout_steps": 10, "minibatch_size": 80}
    with pytest.raises(mjenv.InvalidValueError, match="row 3, step 21 of the training: the reward is inf"):
        mjenv.train("Slide-v0", steps=400, settings=settings, out=tmp_path, callback=spoil)
    monkeypatch.setattr(Slide, "fault", "")
    assert mjenv.train("Slide-v0", steps=400, out=tmp_path, resume=True).steps == 400


def test_a_motor_without_ctrlrange() -> None:
    class Endless(Slide):
        model = Slide.model.replace(
            "motor joint='x' ctrlrange='-1 1' ctrllimited='true'", "motor name='pull' joint='x'"
        )

    mjenv.register("Endless-v0", Endless)
    with pytest.raises(mjenv.InvalidValueError, match=r"the bounds of action 0 \(pull\) are -inf and inf"):
        mjenv.train("Endless-v0", steps=1)
