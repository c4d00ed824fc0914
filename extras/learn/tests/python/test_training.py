"""mjenv.train and mjenv.evaluate, and the command mjenv train."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
import os
import re
import shlex
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import mjenv
from mjenv import AutoresetMode
from mjenv.capi.engine import ENGINES
from mjenv_command import main
from mjenv_learn import learner, training
from mjenv_learn.policy import Input, Policy
from mjenv_learn.saved import stages_of
from mjenv_learn.training import Evaluation, Settings, Stage, Training
from systems import not_on_windows

ID = "InvertedPendulum-v5"
SHORT: dict[str, Any] = {"rows": 8, "rollout_steps": 32, "minibatch_size": 100, "epochs": 2, "hidden": (16,)}
BATCH = 8 * 32
SLIDE = (
    "<mujoco><worldbody><body><joint name='x' type='slide' axis='1 0 0' damping='20'/><geom size='0.1'/></body>"
    "</worldbody><actuator><motor joint='x' ctrlrange='-1 1' ctrllimited='true' gear='50'/></actuator></mujoco>"
)


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


def stop_after(updates: int) -> Callable[[Training], None]:
    return lambda training: training.stop() if training.curve[-1].updates == updates else None


def test_resume_needs_the_checkpoint_alone(tmp_path: Path) -> None:
    """The other files of a folder may be older, as after a kill, damaged or missing. The checkpoint has the options."""
    options: dict[str, Any] = {
        "frame_skip": 3,
        "randomize": {"body_mass": mjenv.Scale(np.float64(0.9), 1.1, elements=np.array([1, 2]))},
        "delay": mjenv.Delay(action=(0, 2)),
        "healthy_z_range": np.array([0.6, np.inf]),
    }
    stages = [Stage(2 * BATCH, {"ctrl_cost_weight": 0.1}), Stage(2 * BATCH, {"ctrl_cost_weight": 0.2})]
    whole = trained(stages=stages, **options)
    for updates in (1, 2, 3):
        folder = tmp_path / str(updates)
        trained(stages=stages, out=folder, callback=stop_after(updates), **options)
        (folder / "curve.csv").write_text("steps\nmany")
        (folder / "training.json").write_text("{")
        (folder / "policy.txt").unlink()
        resumed = mjenv.train("Hopper-v5", out=folder, resume=True)
        assert resumed.policy() == whole.policy()
        assert resumed.curve == whole.curve
        assert len((folder / "curve.csv").read_text().splitlines()) == 5


def test_resume_keeps_what_callbacks_and_stages_changed(tmp_path: Path) -> None:
    def shorten(training: Training) -> None:
        training.set_options(max_episode_steps=3)
        training.set(gamma=0.5)
        training.stop()

    trained(out=tmp_path / "changed", callback=shorten)
    resumed = mjenv.train("Hopper-v5", out=tmp_path / "changed", resume=True)
    assert (resumed.curve[-1].mean_length, resumed.settings.gamma) == (3, 0.5)

    class Interrupted(Training):
        """Ctrl-C after the environments of the second stage were made, and before their first update."""

        def update(self) -> Any:
            if self.stage == 1:
                raise KeyboardInterrupt
            return super().update()

    stages = [Stage(BATCH), Stage(BATCH, {"frame_skip": 2})]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(training, "Training", Interrupted)
        with pytest.raises(KeyboardInterrupt):
            trained(stages=stages, out=tmp_path / "stages")
    resumed = mjenv.train("Hopper-v5", out=tmp_path / "stages", resume=True)
    assert resumed.policy() == trained(stages=stages).policy()


def test_a_training_is_not_lost(tmp_path: Path) -> None:
    """A folder with a training is refused, as is one in which a training runs."""
    refused: list[str] = []

    def again(training: Training) -> None:
        for resume in (False, True):
            with pytest.raises(mjenv.BusyError, match="another training runs in") as error:
                trained(out=tmp_path, resume=resume)
            refused.append(str(error.value))

    first = trained(steps=1, out=tmp_path, callback=again)
    assert len(refused) == 2
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert "lock" not in before
    with pytest.raises(mjenv.InvalidValueError, match="holds a training: resume it, overwrite it"):
        trained(out=tmp_path)
    with pytest.raises(mjenv.InvalidValueError, match="a training with the seed 3, not 77"):
        mjenv.train("Hopper-v5", out=tmp_path, seed=77, resume=True)
    with pytest.raises(mjenv.OptionError, match="either resumed or overwritten"):
        trained(out=tmp_path, resume=True, overwrite=True)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    (tmp_path / "lock").touch()  # of a training that was killed
    other = mjenv.train("Hopper-v5", steps=1, settings=SHORT, seed=4, out=tmp_path, overwrite=True)
    assert Policy.load(tmp_path / "policy.txt") == other.policy() != first.policy()
    assert json.loads((tmp_path / "training.json").read_text())["seed"] == 4


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (None, "JSONDecodeError"),
        ([], "TypeError"),
        ({"seed": "1"}, "'1' is no int"),
        ({"stages": [{}]}, "TypeError"),
        ({"stages": [{"steps": 1, "until": "5"}]}, "'5' is no number"),
        ({"stages": [{"steps": True}]}, "True is no int"),
        ({"stages": 3}, "TypeError"),
        ({"options": 3}, "3 is no dict"),
        ({"stage": -5, "seed": 2**64}, "a seed is"),
        ({"settings": {"gama": 1}}, 'no setting "gama"; nearest: gamma'),
        ({"settings": {"hidden": ["x"]}}, r"hidden\[0\] is \"x\", not an integer"),
        ({"settings": {"hidden": {"a": 3}}}, "hidden cannot be {'a': 3}"),
        ({"settings": {"gamma": "0.5 clip=9"}}, "gamma cannot be '0.5 clip=9'"),
        ({"settings": {"seed": 7}}, "seed is an argument of its own"),
        ({"settings": {"actor_obs": 3}}, "actor_obs.* is 3, not 0 to 1"),
        ({"settings": {"rows": 2.5}}, 'rows is "2.5", not an integer'),
        ({"settings": {"gamma": [1, 2]}}, 'gamma is "1,2", not a number'),
        ({"options": {"engine": "9.9"}}, "no engine '9.9'"),
        ({"options": {"frame_skip": []}}, "frame_skip"),
        ({"options": {"randomize": 3}}, "randomize: an object with the names of arrays is expected"),
    ],
)
def test_a_strangers_checkpoint(tmp_path: Path, changed: Any, message: str) -> None:
    """What a checkpoint says of its training may be anything."""
    training = trained(steps=1, out=tmp_path)
    text = training.description().text()
    note = "" if changed is None else json.dumps({**json.loads(text), **changed} if changed else changed)
    training._learner.save(tmp_path / "checkpoint", note)
    with pytest.raises(mjenv.Error, match=message):
        mjenv.train("Hopper-v5", out=tmp_path, resume=True)


def test_a_strangers_checkpoint_opens_no_file(tmp_path: Path) -> None:
    """A model that only the checkpoint names is confined to its folder, whatever the checkpoint says of trust."""
    text = mjenv.model_xml("Hopper-v5")
    (tmp_path / "outside.xml").write_text("<mujoco><visual/></mujoco>")
    (tmp_path / "in").mkdir()
    model = tmp_path / "in" / "hopper.xml"
    model.write_text(text.replace("<worldbody>", "<include file='../outside.xml'/><worldbody>", 1))
    for options in ({}, {"trust_xml": "yes"}):
        out = tmp_path / f"trained{len(options)}"
        trained(steps=1, out=out, xml_file=str(model), **options)
        with pytest.raises(mjenv.ModelError, match="outside"):
            mjenv.train("Hopper-v5", steps=2 * BATCH, out=out, resume=True)
        again = mjenv.train("Hopper-v5", steps=2 * BATCH, out=out, resume=True, xml_file=str(model))
        assert len(again.curve) == 2


@not_on_windows("there are links and pipes for all users")
def test_links_and_pipes_in_a_folder(tmp_path: Path) -> None:
    """No file outside is written, and nothing waits for the other end of a pipe."""
    folder, outside = tmp_path / "out", tmp_path / "outside"
    folder.mkdir()
    outside.write_text("precious")
    for name in ("curve.csv", "curve.svg", "training.json", "policy.txt"):
        (folder / f"{name}.partial").symlink_to(outside)
    trained(steps=1, out=folder)
    assert outside.read_text() == "precious"
    assert len([*folder.iterdir()]) == 5
    (folder / "lock").symlink_to(tmp_path / "made")
    with pytest.raises(OSError, match="symbolic links"):
        mjenv.train("Hopper-v5", out=folder, resume=True)
    assert not (tmp_path / "made").exists()
    (folder / "lock").unlink()
    os.mkfifo(folder / "lock")
    with pytest.raises(OSError, match="No such device"):
        mjenv.train("Hopper-v5", out=folder, resume=True)


def test_the_printed_commands_name_tasks_and_models(tmp_path: Path) -> None:
    """They work as they are printed, in a process that knows the task only by --tasks."""
    task = tmp_path / "own tasks.py"
    task.write_text(
        "import mjenv, numpy as np\n"
        "class Slide(mjenv.Task):\n"
        f"    model = {SLIDE!r}\n"
        "    frame_skip, options = 5, {'pull': 0.5}\n"
        "    def reset(self, rng, rows): return rng.uniform(-1, 1, (rows, 1)), np.zeros((rows, 1))\n"
        "    def observe(self, sim): return np.concatenate([sim.qpos, sim.qvel], 1)\n"
        "    def step(self, sim, action): return -np.abs(sim.qpos[:, 0]), np.zeros(len(action), bool), {}\n"
        "mjenv.register('Slide-v0', Slide)\n"
    )

    def run(*words: str, status: int = 0) -> str:
        done = subprocess.run([sys.executable, "-m", *words], capture_output=True, text=True, timeout=120, cwd=tmp_path)
        assert done.returncode == status, done.stderr
        return done.stdout if status == 0 else done.stderr

    small = ["--rows", "8", "--rollout-steps", "32", "--minibatch-size", "64", "--steps", "256", "--out", "out"]
    printed = run("mjenv", "train", "Slide-v0", "--tasks", str(task), "--option", "pull=0.25", *small)
    view = printed.partition("watch it: ")[2].strip()
    policy = str(Path("out", "policy.txt"))
    assert shlex.split(view) == ["mjenv", "view", "--policy", policy, "--tasks", str(task)]
    refused = run("mjenv", "train", "Slide-v0", "--out", "out", "--resume", status=2)
    resume = refused.partition("it continues by ")[2].strip()
    assert "Slide-v0: 256 steps" in run(*shlex.split(resume))


def test_the_curve_of_returns_that_cannot_be_drawn(tmp_path: Path) -> None:
    training = trained(steps=3 * BATCH)
    heights = [math.inf, -1.7e308, 5e-324, 0.0, 1.7e308, -math.inf, math.nan]
    for picked in (heights, heights[:1], heights[2:4], [1e99] * 2, [-1e299]):
        training.curve[:] = [dataclasses.replace(training.curve[-1], mean_return=height) for height in picked]
        training.write(tmp_path)
        picture = (tmp_path / "curve.svg").read_text()
        assert picture.endswith("</svg>\n")
        assert not re.search("inf|nan", picture)


def test_stages_end_with_a_return(tmp_path: Path) -> None:
    """A stage ends early with its mean return over a whole window of its own episodes, also if it was resumed."""
    stages: list[dict[str, Any]] = [
        {"steps": 9 * BATCH, "options": {"max_episode_steps": 5}, "until": -100},
        {"steps": BATCH, "options": {"noise": {"action": 0.1}}, "until": 1e9},
        {"steps": BATCH},
    ]
    file = tmp_path / "stages.json"
    file.write_text(json.dumps(stages))
    settings, folder = {**SHORT, "window": 100}, tmp_path / "trained"
    words = [f"--{name.replace('_', '-')}={str(value).strip('(,)')}" for name, value in settings.items()]
    assert main(["train", "Hopper-v5", *words, "--stages", str(file), "--out", str(folder)]) == 0
    with (folder / "curve.csv").open() as table:
        points = [*csv.DictReader(table)]
    assert [int(point["steps"]) for point in points] == [BATCH * (update + 1) for update in range(11)]
    # Each update has 48 episodes of 5 steps, so the third one has a window of 100.
    lengths = [float(point["mean_length"]) for point in points]
    assert lengths[:3] == [5, 5, 5]
    assert all(length > 5 for length in lengths[3:])
    whole = (folder / "policy.txt").read_text()
    parts = [Stage.of(one) for one in stages]
    for updates in (2, 3, 4):
        stopped = tmp_path / str(updates)
        mjenv.train("Hopper-v5", settings=settings, stages=parts, out=stopped, callback=stop_after(updates))
        mjenv.train("Hopper-v5", out=stopped, resume=True)
        assert (stopped / "policy.txt").read_text() == whole
    for text, message in (
        ("{}", "is no list"),
        ('[{"step": 1}]', "step"),
        ("[", "Expecting value"),
        ('[{"steps": 0}]', "one step"),
    ):
        file.write_text(text)
        with pytest.raises(mjenv.InvalidValueError, match=message):
            mjenv.train("Hopper-v5", stages=stages_of(file))


def test_vectors_of_other_libraries(tmp_path: Path) -> None:
    """Gymnasium's vector has the bits of mjenv's; the terms of its observations have no names."""

    def vector(mode: str = "SameStep") -> Any:
        return gymnasium.vector.SyncVectorEnv([lambda: mjenv.make("Hopper-v5")] * 8, autoreset_mode=mode)

    expected = trained(max_episode_steps=None)
    found = mjenv.train(vector(), steps=4 * BATCH, settings=SHORT, seed=3, out=tmp_path, callback=stop_after(2))
    assert len(found.curve) == 2
    found = mjenv.train(vector(), steps=4 * BATCH, seed=3, out=tmp_path / "whole", settings=SHORT)
    assert found.curve == expected.curve
    assert found.policy() == dataclasses.replace(expected.policy(), inputs=[], about={})
    assert mjenv.evaluate(found.policy(), 2).returns.tolist() == mjenv.evaluate(expected.policy(), 2).returns.tolist()
    assert mjenv.train(vector(), steps=4 * BATCH, out=tmp_path, resume=True).steps == 4 * BATCH
    with pytest.raises(mjenv.OptionError, match="mode NEXT_STEP; training needs SAME_STEP"):
        mjenv.train(vector("NextStep"))
    with pytest.raises(mjenv.OptionError, match="options can change in environments of mjenv alone"):
        found.set_options(frame_skip=2)
    discrete = gymnasium.vector.SyncVectorEnv([lambda: gymnasium.make("CartPole-v1")], autoreset_mode="SameStep")
    with pytest.raises(mjenv.OptionError, match=r"a Box of actions, not Discrete\(2\)"):
        mjenv.train(discrete)


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
    assert blind.policy().inputs == [Input("qpos", 5, (0, 1, 2, 3)), Input("qvel", 6)]
    assert np.shape(blind.policy().layers[0].weights)[1] == 10
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
                obs, reward, terminated, truncated, _ = env.step(policy.act(obs))
                total, length, ended = total + float(reward), length + 1, terminated or truncated
            if precision == "float64":
                assert (got.returns[episode], got.lengths[episode]) == (total, length)
            else:
                assert got.returns[episode] == pytest.approx(total, rel=0.05)


def test_the_interval_of_a_mean_return() -> None:
    found = Evaluation(np.array([1.0, 2, 3, 4, 5]), np.arange(5))
    error = statistics.NormalDist().inv_cdf(0.975) * statistics.stdev(found.returns) / math.sqrt(5)
    assert found.interval == pytest.approx((3 - error, 3 + error), rel=1e-6)
    assert f"95 % interval of the mean {3 - error:.6g} to {3 + error:.6g}\nlength  mean 2" in str(found)
    assert np.isnan(Evaluation(np.ones(1), np.ones(1, np.int64)).interval).all()


def test_episodes_do_not_depend_on_each_other() -> None:
    """Draws and noise of an episode do not reach the next one of its row."""
    policy = trained(steps=1).policy()
    options: dict[str, Any] = {
        "randomize": {"body_mass": mjenv.Scale(0.5, 2.0), "dof_damping": mjenv.Offset(0.0, 0.5)},
        "noise": mjenv.Noise(action=0.1, observation=0.1),
        "delay": mjenv.Delay(action=(0, 2)),
        "max_episode_steps": 30,
    }
    alone = [mjenv.evaluate(policy, 1, seed=k, **options).returns[0] for k in range(7)]
    for rows, threads in ((1, 1), (3, 2), (7, 1)):
        assert mjenv.evaluate(policy, 7, rows=rows, threads=threads, **options).returns.tolist() == alone


@pytest.mark.parametrize("activation", ["relu", "elu"])
def test_activations(activation: str) -> None:
    policy = trained(steps=1).policy()
    other = mjenv.train("Hopper-v5", steps=1, settings={**SHORT, "activation": activation}).policy()
    assert [layer.activation for layer in other.layers] == [activation, "identity"]
    assert policy.layers[0].activation == "tanh"
    assert mjenv.evaluate(other, 1).lengths[0] > 0


def test_settings() -> None:
    """All values can be given as numbers, texts, or NumPy's; they are what the library makes of them."""
    given = {"gamma": np.float32(0.5), "hidden": np.array([3, 4]), "epochs": "7", "clip": 1, "actor_obs": (True, False)}
    settings = Settings.of("Some-v0").with_values({**given, "critic_obs": None, "normalize_obs": np.False_})
    assert (settings.gamma, settings.hidden, settings["epochs"], settings.clip) == (0.5, (3, 4), 7, 1.0)
    assert (settings.actor_obs, settings.critic_obs, settings.normalize_obs) == ((1, 0), (), False)
    assert settings.with_values(settings) == settings != Settings.of("Some-v0")
    assert Settings.of("Swimmer-v5").learning_rate == 6e-4
    with pytest.raises(AttributeError, match="gama"):
        _ = settings.gama


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(mjenv.InvalidValueError, match=r"settings\.gamma is 3, not 0 to 1"):
        mjenv.train("Hopper-v5", settings={"gamma": 3})
    with pytest.raises(mjenv.UnknownNameError, match='no setting "gama"; nearest: gamma'):
        mjenv.train("Hopper-v5", settings={"gama": 0.9})
    with pytest.raises(mjenv.OptionError, match='gamma is "much", not a number'):
        mjenv.train("Hopper-v5", settings={"gamma": "much"})
    with pytest.raises(mjenv.OptionError, match='normalize_obs is "2", not true or false'):
        mjenv.train("Hopper-v5", settings={"normalize_obs": 2})
    for large in ({"steps": 2**70}, {"settings": {"window": 2**64}}, {"settings": {"hidden": (2**64 + 8,)}}):
        with pytest.raises(mjenv.InvalidValueError, match=r"is \d{20,22}, not 1 to"):
            mjenv.train("Hopper-v5", **large)
    for seed in (-1, 2**64):
        with pytest.raises(mjenv.InvalidValueError, match=rf"a seed is at least 0 .* not {seed}"):
            mjenv.train("Hopper-v5", seed=seed)
    with pytest.raises(mjenv.OptionError, match=r"a seed is an int, not 1\.5"):
        mjenv.train("Hopper-v5", seed=1.5)  # type: ignore[arg-type]
    with pytest.raises(mjenv.InvalidValueError, match='activation is "sine", not one of tanh relu elu'):
        mjenv.train("Hopper-v5", settings={"activation": "sine"})
    with pytest.raises(mjenv.UnknownIdError):
        mjenv.train("Hoper-v5")
    with pytest.raises(mjenv.OptionError, match="the id is a str"):
        mjenv.train(3)  # type: ignore[arg-type]
    with pytest.raises(mjenv.OptionError, match=r"frame_skp.*mean 'frame_skip'"):
        mjenv.train("Hopper-v5", frame_skp=2)
    with pytest.raises(mjenv.InvalidValueError, match="max_episode_steps is an int"):
        mjenv.train("Hopper-v5", max_episode_steps=0)
    with pytest.raises(mjenv.OptionError, match=r'rows is "8\.5", not an integer'):
        mjenv.train("Hopper-v5", settings={"rows": 8.5})
    with pytest.raises(mjenv.OptionError, match="SAME_STEP"):
        mjenv.train(mjenv.make_vec("Hopper-v5", 2))
    with pytest.raises(mjenv.InvalidValueError, match="at least one step"):
        mjenv.train("Hopper-v5", steps=0)
    with pytest.raises(FileNotFoundError):
        mjenv.train("Hopper-v5", out=tmp_path, resume=True)
    policy = trained(steps=1).policy()
    with pytest.raises(mjenv.InvalidValueError, match=r'sees "qpos", 5 numbers, .* has 8'):
        mjenv.evaluate(policy, 1, id="Walker2d-v5")
    with pytest.raises(mjenv.InvalidValueError, match="precision is 'half'"):
        mjenv.evaluate(policy, 1, precision="half")
    with pytest.raises(mjenv.InvalidValueError, match="episodes is 0"):
        mjenv.evaluate(policy, 0)
    with pytest.raises(mjenv.InvalidValueError, match=r"a seed is at least 0 .* not -1"):
        mjenv.evaluate(policy, 1, seed=-1)


def test_a_wrong_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(learner, "FILE", Path(ENGINES.get().path).name)
    learner.library.cache_clear()
    try:
        with pytest.raises(mjenv.EngineError, match="is not the library of this package"):
            mjenv.train(ID)
    finally:
        learner.library.cache_clear()


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
    assert main([*resume, "--option", "frame_skip=3"]) == 2  # the rows are others
    assert "other options" in capsys.readouterr().err
    assert main(resume) == 0
    output = capsys.readouterr().out
    assert output.endswith(f"mjenv view --policy {tmp_path / 'policy.txt'}\n")
    assert Policy.load(tmp_path / "policy.txt").about["options"] == {"frame_skip": 2}
    assert main(["train", "Hopper-v5", "--gamma", "3", "--out", str(tmp_path)]) == 2
    assert "settings.gamma is 3" in capsys.readouterr().err
    assert main(["train", "Hopper-v5", "--stage", "many", "--out", str(tmp_path)]) == 2
    stages = ["--stage", "256", "frame_skip=3", "healthy_z_range=0.5,inf", "--seconds", "9"]
    assert main(["train", "Hopper-v5", *words, *stages]) == 2
    assert "holds a training" in capsys.readouterr().err
    assert main(["train", "Hopper-v5", *words, *stages, "--overwrite"]) == 0
    options = Policy.load(tmp_path / "policy.txt").about["options"]
    assert options == {"frame_skip": 3, "healthy_z_range": [0.5, math.inf]}
    parts = {"randomize": {"body_mass": {"kind": "scale", "low": 0.5, "high": 1.5}}, "noise": {"action": 0.1}}
    (tmp_path / "draws.json").write_text(json.dumps(parts))
    randomize = ["--randomize", str(tmp_path / "draws.json"), "--steps", "256", "--overwrite"]
    assert main(["train", "Hopper-v5", *words, *randomize]) == 0
    options = json.loads((tmp_path / "training.json").read_text())["options"]
    assert {name: options[name] for name in parts} == parts
    assert main(resume) == 0  # with the draws that the checkpoint keeps
    for text, message in (("{", "no JSON"), ('{"noise": {}, "noise": {}}', "twice"), ('{"xml_file": "a"}', "xml_file")):
        (tmp_path / "draws.json").write_text(text)
        with pytest.raises(SystemExit):
            main(["train", "Hopper-v5", *words, *randomize])
        assert message in capsys.readouterr().err


def test_a_policy_names_its_environment() -> None:
    """It plays where it was trained; what the caller says counts more."""
    options: dict[str, Any] = {
        "history": "qvel=2",
        "reset_noise_scale": 0.1,
        "noise": mjenv.Noise(observation={"qpos": 0.1}),
        "max_episode_steps": 50,
    }
    mask = [index % 3 == 0 for index in range(17)]
    training = mjenv.train("Hopper-v5", steps=1, num_threads=1, settings={**SHORT, "actor_obs": mask}, **options)
    policy = training.policy()
    assert policy.inputs == [Input("qpos", 5, (0, 3)), Input("qvel", 12, (1, 4, 7, 10))]
    assert policy.about["options"].keys() == options.keys()
    assert policy.about["engine"] == mjenv.engine().name
    assert policy.about["revision"] == 0
    assert Policy.parse(policy.text()) == policy
    played = mjenv.evaluate(policy, 5, rows=2)
    envs = mjenv.make_vec("Hopper-v5", 5, **options)
    obs, returns, playing = envs.reset(seed=0)[0], np.zeros(5), np.ones(5, bool)
    act = policy.acting_in(envs)
    while playing.any():
        obs, rewards, terminated, truncated, _ = envs.step(act(obs))
        returns += np.where(playing, rewards, 0)
        playing &= ~(terminated | truncated)
    assert returns.tolist() == played.returns.tolist()
    assert mjenv.evaluate(policy, 5, noise=None).returns.tolist() != returns.tolist()
    plain = dataclasses.replace(policy, about={})
    with pytest.raises(mjenv.InvalidValueError, match=r'sees "qvel", 12 numbers, but this term .* has 6'):
        mjenv.evaluate(plain, 1)
    with pytest.raises(mjenv.InvalidValueError, match=r"sees 6 numbers \(qpos \(2\), qvel \(4\)\)"):
        policy.act(np.zeros(17))
    # The rows of a training that Python steps have the same names.
    here = Training(
        mjenv.make_vec("Hopper-v5", 8, autoreset_mode="same_step"), Settings.of("Hopper-v5"), stepped_here=True
    )
    assert [one.name for one in here.policy().inputs] == ["qpos", "qvel"]


def test_a_policy_of_a_stranger() -> None:
    """What it names is checked as what a caller says, and a model that only it names is not trusted."""
    policy = mjenv.train("Hopper-v5", steps=1, settings=SHORT).policy()

    def of(**about: Any) -> Policy:
        return dataclasses.replace(policy, about=about)

    stranger = of(options={"xml_file": "/etc/passwd", "num_threads": 10**9, "arrays": "none"})
    assert stranger.keywords() == {"xml_file": "/etc/passwd", "trust_xml": "no"}
    assert stranger.keywords(xml_string="<mujoco/>") == {"xml_string": "<mujoco/>"}
    for about, message in (
        ({"options": {"frameskip": 2}}, "names the option 'frameskip', which Hopper-v5 does not have"),
        ({"options": {"render_mode": "human"}}, "names the option 'render_mode'"),
        ({"options": {"frame_skip": "2"}}, "frame_skip"),
        ({"options": []}, "wrong type"),
        ({"engine": 4}, "wrong type"),
        ({"engine": "9.9"}, "9.9"),
        ({"options": {"xml_file": "/dev/null"}}, "null"),
    ):
        with pytest.raises((mjenv.Error, OSError), match=message):
            mjenv.evaluate(of(**about), 1)
    with pytest.warns(UserWarning, match="of the revision 3 of the task, not 0"):
        mjenv.evaluate(of(revision=3), 1)
    for line, message in (("[]", "no object"), ("{", "no JSON"), ("[" * 100_000, "no JSON")):
        text = policy.text().replace(f"about {json.dumps(policy.about)}", f"about {line}")
        with pytest.raises(mjenv.InvalidValueError, match=f"the text is no policy: about is {message}"):
            Policy.parse(text)


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


def test_a_motor_without_ctrlrange() -> None:
    xml = "<mujoco><worldbody><body><joint name='j'/><geom size='.1'/></body></worldbody>"
    xml += "<actuator><motor joint='j'/></actuator></mujoco>"
    with pytest.raises(mjenv.InvalidValueError, match=r"the bounds of action 0 \(j\) are -inf and inf"):
        mjenv.train("Model-v0", steps=1, xml_string=xml, max_episode_steps=9)
