"""Every id of both engines in Chromium, tasks of one's own in every language, and trainings that are watched.

Needs what tests/run view --long installs. The screenshots are in build/view-screenshots.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mjenv_sb3 import VecEnv
from stable_baselines3 import PPO

import mjenv
from commands import Command
from mjenv_learn.training import Training
from mjenv_viewer.controls import Page

ROOT = Path(__file__).parents[4]
SCREENSHOTS = ROOT / "build" / "view-screenshots"
TESTS = ROOT / "bindings" / "python" / "tests"
PLUGINS = Path(os.environ["MJENV_LIBRARY"]).resolve().parent / "tests" / "tasks"
ENGINES = ("2.2.2", "4.0")
for _engine in ENGINES:
    mjenv.spec("dm_control/cheetah-run-v0", _engine)  # ids() lists the suite once one of its tasks has been asked for


@pytest.mark.usefixtures("plain_light")
@pytest.mark.parametrize(("engine", "id"), [(engine, id) for engine in ENGINES for id in mjenv.ids(engine)])
def test_every_id_appears(engine: str, id: str, tab: Any) -> None:
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    with Page(id, 2, {"engine": engine}, port=0) as session:
        session.do(lambda: session.picture.switches.update(dict.fromkeys(session.picture.switches, True)))
        page = tab(session.address, width=900)
        page.wait_for_picture()
        page.page.screenshot(path=SCREENSHOTS / f"{id.replace('/', '-')}-{engine}.png")


def rust_plugin() -> Path:
    """The plug-in that the tests of the crate build as users do."""
    manifest = ROOT / "bindings/rust/mjenv/tests/plugin/hopper/Cargo.toml"
    target = ROOT / "build/view-rust"
    cargo = subprocess.run([ROOT / "tools/setup", "rust"], capture_output=True, text=True, check=True).stdout.strip()
    command = [cargo, "build", "--offline", "--release", "--quiet", "--manifest-path", manifest, "--target-dir", target]
    subprocess.run(command, check=True)
    return target / "release/libhopper.so"


@pytest.mark.parametrize(
    ("id", "file"),
    [
        ("OwnHopper-v5", lambda: PLUGINS / "libhopper_c.so"),
        ("CppAnt-v5", lambda: PLUGINS / "libant_cpp.so"),
        ("RustHopper-v5", rust_plugin),
        ("NumbaHopper-v5", lambda: ROOT / "extras/numba/tests/check_numba_tasks.py"),
        ("NumpyHopper-v5", lambda: ROOT / "extras/batch/tests/check_numpy_tasks.py"),
    ],
)
def test_own_tasks_appear(id: str, file: Any, tab: Any) -> None:
    with Command(id, "--tasks", file(), "--rows", 2) as command:
        page = tab(command.address)
        page.wait_for_picture()
        page.page.get_by_text(id).first.wait_for()


def test_a_model_of_a_file_appears(tab: Any) -> None:
    spider = ROOT / "tests" / "golden" / "custom" / "spider.xml"
    with Command("Model-v0", "--xml", spider, "--engine", "4.0") as command:
        page = tab(command.address)
        page.wait_for_picture()
        page.page.get_by_text("MuJoCo 4.0").first.wait_for()


def test_policies_of_stable_baselines3_act(tmp_path: Path, tab: Any) -> None:
    model = PPO("MlpPolicy", VecEnv("Hopper-v5", 2), n_steps=64, batch_size=64, seed=0, device="cpu").learn(256)
    model.save(tmp_path / "model.zip")
    with Command("Hopper-v5", "--policy", tmp_path / "model.zip", "--rows", 3) as command:
        tab(command.address).wait_for_picture()
    from mjenv_command import parser  # what follows acts as the command does, in this process
    from mjenv_viewer.command import acting

    arguments = parser().parse_args(["view", "Hopper-v5", "--policy", str(tmp_path / "model.zip")])
    observations = np.random.default_rng(0).normal(size=(3, 11))
    assert np.array_equal(acting(arguments, {})(observations), model.predict(observations, deterministic=True)[0])


def test_a_training_that_is_watched_learns_the_same(tmp_path: Path, tab: Any) -> None:
    command = [
        sys.executable,
        ROOT / "extras/curricula/python/train_cleanrl.py",
        "Hopper-v5",
        "--steps",
        "40000",
        "--out",
    ]
    subprocess.run([*command, tmp_path / "plain"], check=True)
    watched = subprocess.Popen([*command, tmp_path / "watched", "--view"], stderr=subprocess.PIPE, text=True)
    assert watched.stderr
    said = watched.stderr.readline()
    assert said.startswith("mjenv view: ")
    page = tab(said.split()[-1])
    page.wait_for_picture()
    assert watched.poll() is None  # it still trains
    watched.communicate()
    assert watched.returncode == 0
    page.page.close()
    assert (tmp_path / "plain/policy.txt").read_bytes() == (tmp_path / "watched/policy.txt").read_bytes()


def test_mjenv_train_shows_what_it_trains(tmp_path: Path, tab: Any) -> None:
    steps = 10**9  # more than it does before Ctrl-C ends it
    command = [sys.executable, "-m", "mjenv", "train", "Hopper-v5", "--steps", str(steps), "--view", "--out", tmp_path]
    watched = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert watched.stderr
    said = watched.stderr.readline()
    assert said.startswith("mjenv view: ")
    page = tab(said.split()[-1])
    page.wait_for_picture()
    page.page.close()
    watched.send_signal(signal.SIGINT)
    out, _ = watched.communicate()
    assert watched.returncode == 130
    assert out.startswith("stopped: ")
    seen = (tmp_path / "curve.csv").read_text().splitlines()[1:]
    assert seen

    def stop(training: Training) -> None:
        if len(training.curve) == len(seen):
            training.stop()

    plain = mjenv.train("Hopper-v5", steps=steps, callback=stop)
    assert [",".join(map(str, astuple(point))) for point in plain.curve] == seen


def test_numba_tasks_can_be_loaded() -> None:
    mjenv.load_tasks(ROOT / "extras/numba/tests/check_numba_tasks.py")
    assert "NumbaLive-v0" in mjenv.ids()
