"""The commands for tasks of one's own."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import mjenv
from check_tasks import build, installed, plugin, run
from mjenv_command import main

BUILT = Path(os.environ["MJENV_LIBRARY"]).resolve().parent / "tests" / "tasks"
ROOT = Path(__file__).resolve().parents[3]
LEARNS = """
#include <mjenv/learn.h>
#include <stdio.h>
int main(void) {
  static const mjenv_learn_calls calls = MJENV_LEARN_CALLS_INIT;
  mjenv_learner *learner = NULL;
  printf("%d ", mjenv_learner_create(&calls, NULL, NULL, NULL, &learner) == MJENV_OK);
  puts(mjenv_learn_last_error());
}
"""
LISTS = """cmake_minimum_required(VERSION 3.22)
project(learns LANGUAGES C)
find_package(mjenv 0.1 REQUIRED)
add_executable(learns learns.c)
target_link_libraries(learns PRIVATE mjenv::mjenv mjenv::learn)
"""

__all__ = ["installed"]  # a fixture


def test_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "Typed-v7"]) == 0
    assert capsys.readouterr().out.startswith("Typed-v7: episodes of any length\n")
    assert main(["list", "--json"]) == 0
    listed = {entry["id"]: entry for entry in json.loads(capsys.readouterr().out)}
    assert set(listed) == set(mjenv.ids())
    assert listed["Typed-v7"] == {
        "id": "Typed-v7",
        "observation": 1,
        "action": 1,
        "dt": 0.002,
        "max_episode_steps": None,
        "reward_threshold": None,
    }
    assert main(["model", "Typed-v7"]) == 0
    assert capsys.readouterr().out == (BUILT / "typed.xml").read_text()


def test_option_tasks() -> None:
    words = "-m", "mjenv", "--tasks", plugin("hopper_c"), "--tasks", plugin("typed")
    for id, size in (("OwnHopper-v5", 11), ("mjenv/Typed-v7", 1)):
        done = run(*words, "info", id, "--json")
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["spaces"]["observation"]["shape"] == [size]
        assert run("-m", "mjenv", "info", id, "--json", *words[2:]).stdout == done.stdout
    words = "-m", "mjenv", "--tasks", plugin("live"), "--tasks", plugin("groups"), "info"
    found = json.loads(run(*words, "CppLive-v0", "--json").stdout)
    assert [option["name"] for option in found["options"] if option["live"]] == ["speed", "gains"]
    assert found["groups"] == []
    found = json.loads(run(*words, "CppGroups-v0", "--json").stdout)
    assert {group["name"]: group["terms"] for group in found["groups"]} == {
        "policy": ["cart", "ball"],
        "critic": ["mass", "velocity"],
        "clock": ["clock"],
    }
    assert not any(option["live"] for option in found["options"])
    assert "critic  8-15   mass, velocity\n" in run(*words, "CppGroups-v0").stdout
    assert "the commanded speed, m/s [live: " in run(*words, "CppLive-v0").stdout


def test_option_tasks_of_unknown_ids() -> None:
    words = "-m", "mjenv", "--tasks", plugin("hopper_c")
    unknown = run(*words, "info", "CppHopper-v5")
    assert unknown.returncode == 2
    assert 'no environment "CppHopper-v5"; nearest: Hopper-v5' in unknown.stderr
    missing = run("-m", "mjenv", "--tasks", "/nowhere/libx.so", "list")
    assert missing.returncode == 2
    assert 'argument --tasks: plug-in "/nowhere/libx.so": No such file or directory' in missing.stderr


def test_variable() -> None:
    paths = f"{plugin('hopper_c')}:/nowhere/libx.so:{plugin('typed')}"
    done = run("-m", "mjenv", "info", "Typed-v7", "--json", MJENV_TASKS=paths)
    assert done.returncode == 0, done.stderr
    script = """
import gymnasium, mjenv
print(gymnasium.make("mjenv/OwnHopper-v5").reset(seed=1)[0].shape, mjenv.ids()[-1])
for attempt in (lambda: mjenv.make("Nothing-v0"), mjenv.load_tasks):
    try:
        attempt()
    except mjenv.Error as error:
        print(type(error).__name__, str(error)[-62:])
"""
    done = run("-c", script, MJENV_TASKS=paths)
    why = 'MJENV_TASKS: plug-in "/nowhere/libx.so": No such file or directory'[-62:]
    assert done.stdout == f"(11,) Walker2d-v5\nUnknownIdError {why}\nTaskError {why}\n", done.stderr


def test_new_task(installed: Path, tmp_path: Path) -> None:
    """What `mjenv new-task` writes builds as its README says, and passes the test that it brings."""
    environment = {"MJENV_LIBRARY": str(installed)}

    def mjenv_command(*words: str) -> "subprocess.CompletedProcess[str]":
        command = [sys.executable, "-m", "mjenv", *words]
        return subprocess.run(
            command, capture_output=True, text=True, cwd=tmp_path, env={**os.environ, **environment}, check=False
        )

    made = mjenv_command("new-task", "my_puck")
    assert (made.returncode, made.stderr) == (0, "")
    assert "MyPuck-v0" in made.stdout
    folder = tmp_path / "my_puck"
    assert sorted(path.name for path in folder.iterdir()) == [
        "CMakeLists.txt",
        "README.md",
        "my_puck.cpp",
        "my_puck.xml",
        "test_my_puck.py",
    ]
    build(folder, f"-Dmjenv_DIR={mjenv_command('cmake-dir').stdout.strip()}")
    # What mjenv installs is enough for it.
    tested = subprocess.run(
        [sys.executable, "-m", "unittest"],
        cwd=folder,
        env={**os.environ, **environment},
        stderr=subprocess.PIPE,
        text=True,
    )
    assert tested.returncode == 0, tested.stderr
    assert "Ran 4 tests" in tested.stderr

    again = mjenv_command("new-task", "my_puck")
    assert again.returncode == 2
    assert "File exists: 'my_puck'" in again.stderr
    assert "'My-Puck' is not" in mjenv_command("new-task", "My-Puck").stderr


@pytest.mark.skipif(not (ROOT / "extras" / "learn").exists(), reason="the learner is a program of its own")
def test_the_cmake_package_of_pip_has_the_learner(tmp_path: Path) -> None:
    """Its files lie as bindings/python/CMakeLists.txt installs them."""
    package = tmp_path / "mjenv" / "cmake" / "mjenv"
    package.mkdir(parents=True)
    build_folder = Path(os.environ["MJENV_LIBRARY"]).resolve().parent
    for file in ("bindings/python/mjenv-config.cmake", "cmake/mjenv-tasks.cmake"):
        shutil.copy(ROOT / file, package)
    shutil.copy(build_folder / "mjenv-config-version.cmake", package)
    for headers in ("capi/include", "extras/learn/include"):
        shutil.copytree(ROOT / headers, tmp_path / "mjenv" / "include", dirs_exist_ok=True)
    for library in ("libmjenv.so", "libmjenv-learn.so"):
        shutil.copy(build_folder / library, tmp_path / "mjenv")
    (tmp_path / "learns.c").write_text(LEARNS)
    (tmp_path / "CMakeLists.txt").write_text(LISTS)
    build(tmp_path, f"-Dmjenv_DIR={package}")
    beside = {**os.environ, "LD_LIBRARY_PATH": str(tmp_path / "mjenv")}  # a wheel's libraries have no other names
    (tmp_path / "mjenv" / "libmjenv.so.1").symlink_to("libmjenv.so")
    (tmp_path / "mjenv" / "libmjenv-learn.so.1").symlink_to("libmjenv-learn.so")
    done = subprocess.run([tmp_path / "build" / "learns"], capture_output=True, text=True, env=beside, check=True)
    assert done.stdout.startswith("0 env ")


def test_no_cmake_package(capsys: pytest.CaptureFixture[str]) -> None:
    """This library stands in the folder in which it was built."""
    assert main(["cmake-dir"]) == 2
    assert "no CMake package beside" in capsys.readouterr().err
