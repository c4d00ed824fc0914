"""Tasks of plug-ins. tests/run gives these tests a process of their own, because a task stays loaded.

Expected values are recordings of Gymnasium, which the tasks in tests/tasks/*.c and *.cpp write again.
"""

import copy
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import golden
import mjenv
from test_golden import TRAJECTORIES, by_name, check_trajectory

BUILT = Path(os.environ["MJENV_LIBRARY"]).resolve().parent / "tests" / "tasks"
WRITTEN_AGAIN = {"Hopper-v5": ("OwnHopper-v5", "CppHopper-v5"), "Ant-v5": ("CppAnt-v5",)}
RECORDED = [
    pytest.param(path, id, id=f"{id}-{by_name(path)}")
    for path in TRAJECTORIES
    for id in WRITTEN_AGAIN.get(golden.load(path).id, ())
]


def plugin(name: str) -> Path:
    path = BUILT / f"lib{name}.so"
    assert path.exists(), f"{path} is missing: build with -DMJENV_BUILD_TESTS=ON"
    return path


BEFORE = mjenv.ids()
for loaded in ("hopper_c", "hopper_cpp", "ant_cpp", "typed"):
    mjenv.load_tasks(plugin(loaded))


def test_ids() -> None:
    assert len(BEFORE) == 22
    own = {"CppAnt-v5", "CppHopper-v5", "OwnHopper-v5", "Typed-v7"}
    assert mjenv.ids() == tuple(sorted({*BEFORE, *own}))


def test_loading_again_does_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    before = mjenv.ids()
    monkeypatch.chdir(BUILT.parent)
    for path in (str(plugin("hopper_c")), "tasks/libhopper_c.so", Path("./tasks/libhopper_c.so")):
        mjenv.load_tasks(path)
    assert mjenv.ids() == before


@pytest.mark.parametrize(("path", "id"), RECORDED)
def test_trajectory(path: Path, id: str) -> None:
    check_trajectory(path, id)


def test_there_are_recordings() -> None:
    assert {param.values[1] for param in RECORDED} == {"OwnHopper-v5", "CppHopper-v5", "CppAnt-v5"}


def flat(values: Any) -> list[Any]:
    if isinstance(values, tuple) or (isinstance(values, np.ndarray) and values.dtype == object):
        return [flat(value) for value in values]
    if isinstance(values, dict):
        return [(name, flat(value)) for name, value in values.items()]
    return [type(values), np.asarray(values).dtype, np.asarray(values).tobytes()]


def play(envs: Any) -> list[Any]:
    """Two episodes of every row, and the moment between them."""
    envs.action_space.seed(5)
    played = [flat(envs.reset(seed=2))]
    for _ in range(80):
        result = envs.step(envs.action_space.sample())
        played.append(flat(result))
        if not isinstance(envs, gymnasium.vector.VectorEnv) and (result[2] or result[3]):
            played.append(flat(envs.reset()))
    return played


@pytest.mark.parametrize("id", ["OwnHopper-v5", "CppHopper-v5"])
def test_every_way_to_make(id: str) -> None:
    """They equal the built-in Hopper-v5, which other tests compare with Gymnasium."""
    made = mjenv.make("Hopper-v5", max_episode_steps=9)
    expected = play(made)
    assert play(mjenv.make(id, max_episode_steps=9)) == expected
    assert play(mjenv.make(f"mjenv/{id}", max_episode_steps=9)) == expected
    assert play(gymnasium.make(f"mjenv/{id}", max_episode_steps=9)) == expected
    options: dict[str, Any] = {"max_episode_steps": 9, "num_threads": 2, "autoreset_mode": "same_step"}
    expected = play(mjenv.make_vec("Hopper-v5", 5, **options))
    assert play(mjenv.make_vec(id, 5, **options)) == expected
    assert play(gymnasium.make_vec(f"mjenv/{id}", 5, **options)) == expected


@pytest.mark.parametrize("id", ["OwnHopper-v5", "CppHopper-v5"])
def test_spec_and_options(id: str) -> None:
    spec, gymnasiums = gymnasium.spec(f"mjenv/{id}"), gymnasium.spec("Hopper-v5")
    assert spec.reward_threshold == gymnasiums.reward_threshold
    assert spec.max_episode_steps == gymnasiums.max_episode_steps
    assert (mjenv.spec(id).name, mjenv.spec(id).version) == (id.removesuffix("-v5"), 5)
    mine, hoppers = mjenv.options(id), mjenv.options("Hopper-v5")
    assert {name: option.default for name, option in mine.items()} == {
        name: option.default for name, option in hoppers.items()
    }
    assert mjenv.model_xml(id) == mjenv.model_xml("Hopper-v5")
    with pytest.raises(mjenv.OptionError, match="healthy_reward"):
        mjenv.make(id, healthy_rewards=2)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_go_on(copied: Any) -> None:
    env = mjenv.make("CppHopper-v5", terminate_when_unhealthy=False)
    env.reset(seed=1)
    env.step(np.ones(3))
    other = copied(env)
    for _ in range(30):
        assert flat(other.step(np.ones(3))) == flat(env.step(np.ones(3)))


# ---- what a task may have, and built-in robots do not ----

KINDS = {
    "float64": (np.float64, np.float64),
    "action": (np.float32, np.float32),
    "native_float": (float, np.float64),
    "native_int": (int, np.int64),
    "int64": (np.int64, np.int64),
    "float32": (np.float32, np.float32),
    "int32": (np.int32, np.int32),
    "uint8": (np.uint8, np.uint8),
}


def check_typed(info: dict[str, Any]) -> None:
    assert list(info) == [key for name in KINDS for key in (name, f"{name}s")]
    for name, (kind, dtype) in KINDS.items():
        assert (type(info[name]), info[name]) == (kind, 200)
        assert (info[f"{name}s"].dtype, info[f"{name}s"].tolist()) == (dtype, [[1, 2]])


def test_types() -> None:
    env = mjenv.make("Typed-v7")
    env.reset()
    _, reward, terminated, truncated, info = env.step(np.zeros(1, np.float32))
    assert (type(reward), reward) == (np.float32, np.float32(0.1))
    assert (terminated, truncated) == (False, False)
    check_typed(info)


def test_types_of_many_rows() -> None:
    envs = mjenv.make_vec("Typed-v7", 3)
    envs.reset()
    *_, infos = envs.step(np.zeros((3, 1), np.float32))
    for name, (_, dtype) in KINDS.items():
        assert (infos[name].dtype, infos[name].tolist()) == (dtype, [200] * 3)
        assert (infos[f"{name}s"].dtype, infos[f"{name}s"].tolist()) == (dtype, [[[1, 2]]] * 3)


def test_final_info_of_one_row() -> None:
    envs = mjenv.make_vec("Typed-v7", 2, max_episode_steps=1, autoreset_mode="same_step")
    envs.reset()
    *_, infos = envs.step(np.zeros((2, 1), np.float32))
    for name, (_, dtype) in KINDS.items():
        assert infos["final_info"][f"{name}s"].dtype == dtype


def test_no_time_limit() -> None:
    for spec in (mjenv.spec("Typed-v7"), gymnasium.spec("mjenv/Typed-v7"), mjenv.make("Typed-v7").spec):
        assert spec is not None
        assert spec.max_episode_steps is None
    env = gymnasium.make("mjenv/Typed-v7")
    env.reset()
    assert not any(env.step(np.zeros(1))[3] for _ in range(3000))


def test_model_in_a_file() -> None:
    assert mjenv.model_xml("Typed-v7") == (BUILT / "typed.xml").read_text()


# ---- errors ----


@pytest.mark.parametrize(
    ("path", "kind", "message"),
    [
        ("/nowhere/libx.so", mjenv.TaskError, 'plug-in "/nowhere/libx.so": No such file or directory'),
        (BUILT / "typed.xml", mjenv.TaskError, "typed.xml"),
        (BUILT / "libno_entry.so", mjenv.TaskError, "MJENV_PLUGIN"),
        (BUILT / "libother_abi.so", mjenv.TaskError, "999"),
        (BUILT / "libno_tasks.so", mjenv.TaskError, "it contains no task"),
        (BUILT / "librefuses.so", mjenv.TaskError, "it lacks the licence"),
        (BUILT / "libtwice.so", mjenv.InvalidValueError, "already registered"),
        (b"libx.so", mjenv.OptionError, "path of their file, not b'libx.so'"),
        (7, TypeError, "path of their file, not 7"),
        ("libx.so\0", ValueError, "null character"),
    ],
)
def test_refused(path: Any, kind: type[Exception], message: str) -> None:
    before = mjenv.ids()
    with pytest.raises(kind, match=message):
        mjenv.load_tasks(path)
    assert mjenv.ids() == before


# ---- the command line, and MJENV_TASKS ----


def run(*words: str | Path, **environment: str) -> "subprocess.CompletedProcess[str]":
    """Python in another process, into which nothing was loaded."""
    return subprocess.run(
        [sys.executable, *map(str, words)], capture_output=True, text=True, env={**os.environ, **environment}
    )


# ---- building, against an installed mjenv ----

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library in a prefix."""
    prefix = tmp_path_factory.mktemp("prefix")
    build = Path(os.environ["MJENV_LIBRARY"]).resolve().parent
    subprocess.run(["cmake", "--install", build, "--prefix", prefix], check=True, stdout=subprocess.DEVNULL)
    [library] = prefix.rglob("libmjenv.so")
    return library


def build(folder: Path, *words: str) -> None:
    for command in (["cmake", "-S", folder, "-B", folder / "build", *words], ["cmake", "--build", folder / "build"]):
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr


def test_cartpole(installed: Path, tmp_path: Path) -> None:
    """The example builds in a folder of its own, and is found from another one."""
    folder = tmp_path / "cartpole"
    shutil.copytree(ROOT / "examples" / "tasks" / "cartpole", folder)
    build(folder, f"-DCMAKE_PREFIX_PATH={installed.parents[1]};{installed.parents[2]}")
    mjenv.load_tasks(folder / "build" / "libmy_robots.so")
    env = gymnasium.make("mjenv/CartpoleSwingup-v0", reset_noise_scale=0)
    obs, _ = env.reset(seed=1)
    assert obs == pytest.approx([0, -1, 0, 0, 0], abs=1e-12)  # it hangs
    for step in range(1, 501):
        action = np.array([0.1 * np.cos(step)], np.float32)  # small pushes, so that the cart stays on its track
        obs, reward, terminated, truncated, info = env.step(action)
        # After a step, site_xpos is one timestep older than qpos, as mj_step leaves it.
        tip = env.unwrapped.data.site("tip").xpos[2]
        cost = 0.01 * np.float64(action[0]) ** 2
        assert (info["height"], info["reward_ctrl"], reward) == (tip, -cost, tip / 0.6 - cost)
        assert not terminated
        assert truncated == (step == 500)
    envs = mjenv.make_vec("CartpoleSwingup-v0", 64)
    assert envs.reset(seed=1)[0].shape == (64, 5)
