"""The ids as Gymnasium knows them."""

import dataclasses
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import RecordEpisodeStatistics, TimeAwareObservation, TimeLimit

import mjenv

# Gymnasium calls every v4 outdated.
pytestmark = pytest.mark.filterwarnings("ignore:.*is out of date")


def bits(values: Any) -> Any:
    """Everything in what reset and step return as something that compares bit for bit."""
    if isinstance(values, (tuple, list)):
        return [bits(value) for value in values]
    if isinstance(values, dict):
        return {name: bits(value) for name, value in values.items()}
    if isinstance(values, np.ndarray) and values.dtype == object:
        return [bits(value) for value in values]
    return type(values), np.asarray(values).tobytes()


def play(env: Any, steps: int) -> list[Any]:
    env.action_space.seed(3)
    seen = [bits(env.reset(seed=7))]
    for _ in range(steps):
        result = env.step(env.action_space.sample())
        seen.append(bits(result))
        if result[2] is True or result[3] is True:
            seen.append(bits(env.reset()))
    return seen


@pytest.mark.parametrize("id", mjenv.ids())
def test_every_id(id: str) -> None:
    found = gymnasium.spec(f"mjenv/{id}")
    gymnasiums = gymnasium.spec(id)
    assert (found.reward_threshold, found.max_episode_steps) == (
        gymnasiums.reward_threshold,
        gymnasiums.max_episode_steps,
    )
    env = gymnasium.make(f"mjenv/{id}")
    assert isinstance(env.unwrapped, mjenv.Environment)
    assert play(env, 20) == play(mjenv.make(id), 20)
    envs = gymnasium.make_vec(f"mjenv/{id}", num_envs=3)
    assert isinstance(envs, mjenv.VectorEnv)
    assert play(envs, 20) == play(mjenv.make_vec(id, 3), 20)


def test_keywords() -> None:
    env = gymnasium.make("mjenv/Reacher-v5", max_episode_steps=4, reward_control_weight=0.5, frame_skip=3)
    assert play(env, 4) == play(mjenv.make("Reacher-v5", 4, reward_control_weight=0.5, frame_skip=3), 4)
    with pytest.raises(mjenv.OptionError, match="no_such"):
        gymnasium.make("mjenv/Reacher-v5", no_such=1)
    with pytest.raises(mjenv.OptionError, match="no_such"):
        gymnasium.make_vec("mjenv/Reacher-v5", no_such=1)


def test_keywords_of_vectors() -> None:
    keywords = {"max_episode_steps": 5, "autoreset_mode": AutoresetMode.SAME_STEP, "frame_skip": 3}
    envs = gymnasium.make_vec("mjenv/Reacher-v5", num_envs=2, num_threads=2, dtype=np.float32, **keywords)
    assert play(envs, 8) == play(mjenv.make_vec("Reacher-v5", 2, dtype=np.float32, **keywords), 8)
    assert envs.spec.id == "mjenv/Reacher-v5"
    again = gymnasium.make_vec(envs.spec)
    assert play(again, 8) == play(envs, 8)


@pytest.mark.parametrize(("mode", "kind"), [("sync", SyncVectorEnv), ("async", AsyncVectorEnv)])
def test_gymnasiums_own_vectors_and_wrappers(mode: str, kind: type) -> None:
    def short(env: gymnasium.Env) -> gymnasium.Env:
        return TimeLimit(env, 6)

    envs = gymnasium.make_vec("mjenv/Ant-v5", 2, vectorization_mode=mode, wrappers=[short], frame_skip=2)
    assert type(envs) is kind
    assert play(envs, 9) == play(mjenv.make_vec("Ant-v5", 2, max_episode_steps=6, frame_skip=2), 9)
    envs.close()


def test_wrappers() -> None:
    env = RecordEpisodeStatistics(gymnasium.make("mjenv/Reacher-v5"))
    env.reset(seed=1)
    *_, info = [env.step(np.zeros(2)) for _ in range(50)][-1]
    assert info["episode"]["l"] == 50
    wrapped = gymnasium.make(env.spec)
    assert isinstance(wrapped, RecordEpisodeStatistics)
    assert isinstance(wrapped.unwrapped, mjenv.Environment)


def test_our_make_takes_the_registered_spec() -> None:
    spec = gymnasium.spec("mjenv/Hopper-v5")
    assert mjenv.make(spec).spec == mjenv.make("Hopper-v5").spec
    assert mjenv.make_vec(spec, 2).spec == mjenv.make_vec("Hopper-v5", 2).spec
    spec = dataclasses.replace(spec, max_episode_steps=3)
    assert play(mjenv.make(spec), 3) == play(mjenv.make("Hopper-v5", 3), 3)


def test_time_aware() -> None:
    """The time needs the limit of steps, which gymnasium.make does not pass to the environment."""
    made = gymnasium.make("mjenv/Reacher-v5", time_aware=True)
    wanted = play(TimeAwareObservation(gymnasium.make("mjenv/Reacher-v5"), normalize_time=True), 60)
    for env in (made, gymnasium.make(made.spec), mjenv.make(made.spec), mjenv.make(made.unwrapped.spec)):
        assert play(env, 60) == wanted
    spec = mjenv.make("Reacher-v5", 20, time_aware=True).spec
    short = gymnasium.make("mjenv/Reacher-v5", max_episode_steps=20)
    wanted = play(TimeAwareObservation(short, normalize_time=True), 60)
    for env in (gymnasium.make(spec), mjenv.make(spec)):
        assert play(env, 60) == wanted
    envs = mjenv.make_vec("Reacher-v5", max_episode_steps=20, time_aware=True)
    assert play(gymnasium.make_vec(spec), 60) == play(envs, 60)


# ---- other processes ----


def python(text: str, **environment: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-c", text], capture_output=True, text=True, env={**os.environ, **environment}, timeout=120
    )


@pytest.mark.parametrize(
    "text",
    [
        "import gymnasium, mjenv",
        "import mjenv, gymnasium",
    ],
)
def test_mjenv_says_which_gymnasium_it_needs(text: str, tmp_path: Path) -> None:
    """A package that has what mjenv would trip over in Gymnasium 0.29: its VectorEnv is not generic.

    tests/long/check_gymnasium.py does the same with the real versions.
    """
    package = tmp_path / "gymnasium"
    for folder in ("envs", "vector"):
        (package / folder).mkdir(parents=True)
    (package / "__init__.py").write_text(
        "from gymnasium import error, vector\n__version__ = '0.29.1'\nclass Env: ...\n"
    )
    (package / "error.py").write_text("class Error(Exception): ...\n")
    (package / "vector" / "__init__.py").write_text("class VectorEnv: ...\n")
    (package / "envs" / "__init__.py").touch()
    (package / "envs" / "registration.py").write_text("class EnvSpec: ...\n")
    run = python(text, PYTHONPATH=os.pathsep.join([str(tmp_path), *sys.path]))
    assert run.returncode == 1
    assert run.stderr.endswith(
        'ImportError: mjenv needs Gymnasium 1.0 or newer, not 0.29.1: pip install "gymnasium>=1.0"\n'
    )


@pytest.mark.parametrize(
    "text",
    [
        "import gymnasium; print(gymnasium.make('mjenv:mjenv/Ant-v5'))",
        "import gymnasium; print(gymnasium.make_vec('mjenv:mjenv/Ant-v5', num_envs=64))",
        "import mjenv, gymnasium; print(gymnasium.make('mjenv/Ant-v5'))",
        "import gymnasium, mjenv; print(gymnasium.spec('mjenv/Ant-v5'))",
        "import mjenv; mjenv.make('Ant-v5'); import gymnasium; print(gymnasium.make('mjenv/Ant-v5'))",
        "import mjenv; from gymnasium.envs.registration import spec; print(spec('mjenv/Ant-v5'))",
        "import mjenv, gymnasium, importlib; importlib.reload(gymnasium); print(gymnasium.spec('mjenv/Ant-v5'))",
        "import mjenv; from importlib.util import find_spec; find_spec('gymnasium')\n"
        "import gymnasium; print(gymnasium.spec('mjenv/Ant-v5'))",
    ],
)
def test_ids_in_gymnasium(text: str) -> None:
    run = python(text)
    assert (run.returncode, run.stderr) == (0, "")
    assert "Ant-v5" in run.stdout


@pytest.mark.parametrize("name", ["numpy", "gymnasium"])
def test_a_missing_package_is_named(name: str) -> None:
    run = python(f"import sys; sys.modules[{name!r}] = None; import mjenv; mjenv.make('Ant-v5')")
    assert run.returncode == 1
    assert f"No module named {name!r}" in run.stderr or f"import of {name} halted" in run.stderr


def test_a_python_file_is_imported_once_with_its_folder(tmp_path: Path) -> None:
    (tmp_path / "robots.py").write_text("NAME = 'a robot'")
    (tmp_path / "falling.py").write_text("import robots; print(__name__, robots.NAME)")
    load = f"mjenv.load_tasks({str(tmp_path / 'falling.py')!r})"
    done = python(f"import mjenv; {load}; {load}; import falling")
    assert (done.stdout, done.stderr) == ("falling a robot\n", "")


@pytest.mark.parametrize(
    ("text", "message"),
    [(None, "No such file"), ("1 / 0", "ZeroDivisionError"), ("def", "SyntaxError"), ("import nothing", "nothing")],
)
def test_a_python_file_that_cannot_be_imported(text: str | None, message: str, tmp_path: Path) -> None:
    file = tmp_path / "broken_tasks.py"
    if text is not None:
        file.write_text(text)
    with pytest.raises(mjenv.TaskError, match=f"broken_tasks.py cannot be imported: .*{message}"):
        mjenv.load_tasks(file)
