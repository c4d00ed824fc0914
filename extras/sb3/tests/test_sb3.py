"""mjenv_sb3.VecEnv without Stable-Baselines3, whose base class a stand-in replaces; check_sb3.py has it."""

import importlib
import pickle
import subprocess
import sys
import types
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import mjenv


class Base:
    """What an adapter relies on: the attributes that Stable-Baselines3 documents."""

    def __init__(self, num_envs: int, observation_space: Any, action_space: Any) -> None:
        self.num_envs, self.observation_space, self.action_space = num_envs, observation_space, action_space
        self.reset_infos: list[dict[str, Any]] = [{} for _ in range(num_envs)]
        self._reset_seeds(), self._reset_options()
        self.render_mode = self.get_attr("render_mode")[0]  # type: ignore[attr-defined]

    def _reset_seeds(self) -> None:
        self._seeds: list[int | None] = [None] * self.num_envs

    def _reset_options(self) -> None:
        self._options: list[dict[str, Any]] = [{}] * self.num_envs

    def seed(self, seed: int) -> None:
        self._seeds = [seed + i for i in range(self.num_envs)]

    def step(self, actions: Any) -> Any:
        self.step_async(actions)  # type: ignore[attr-defined]
        return self.step_wait()  # type: ignore[attr-defined]

    def _get_indices(self, indices: Any) -> Any:
        if indices is None:
            return range(self.num_envs)
        return [indices] if isinstance(indices, int) else indices


@pytest.fixture
def sb3(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The module mjenv_sb3 on the stand-in."""
    names = "stable_baselines3", "stable_baselines3.common", "stable_baselines3.common.vec_env"
    for name in names:
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    sys.modules[names[-1]].VecEnv = Base  # type: ignore[attr-defined]
    monkeypatch.delitem(sys.modules, "mjenv_sb3", raising=False)
    yield importlib.import_module("mjenv_sb3")
    sys.modules.pop("mjenv_sb3", None)


def same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray):
        return type(b) is np.ndarray and (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())
    return type(a) is type(b) and bool(a == b)


@pytest.mark.parametrize("id", mjenv.ids())
def test_single_environments(sb3: Any, id: str) -> None:
    """As single environments that are reset where they end: types, bits and keys, in order."""
    envs = sb3.VecEnv(id, 3, num_threads=2, max_episode_steps=9)
    ones = [mjenv.make(id, max_episode_steps=9) for _ in range(3)]
    envs.seed(4)
    obs = envs.reset()
    for row, one in enumerate(ones):
        expected, info = one.reset(seed=4 + row)
        assert same(obs[row], expected)
        check_info(envs.reset_infos[row], info)
    rng = np.random.default_rng(1)
    for step in range(25):
        actions = rng.uniform(-1, 1, (3, *envs.action_space.shape)).astype((np.float32, np.float64)[step % 2])
        obs, rewards, dones, infos = envs.step(actions)
        assert (rewards.dtype, dones.dtype, obs.dtype) == (np.float32, np.bool_, np.float64)
        for row, one in enumerate(ones):
            last, reward, terminated, truncated, info = one.step(actions[row])
            info["TimeLimit.truncated"] = truncated and not terminated
            if terminated or truncated:
                info["terminal_observation"] = last
                last, begun = one.reset()
                check_info(envs.reset_infos[row], begun)
            check_info(infos[row], info)
            assert same(obs[row], last)
            assert rewards[row] == np.float32(reward)
            assert dones[row] == (terminated or truncated)


def check_info(ours: dict[str, Any], theirs: dict[str, Any]) -> None:
    assert list(ours) == list(theirs)
    for key in ours:
        assert same(ours[key], theirs[key]), key


def test_the_rest_of_the_interface(sb3: Any) -> None:
    envs = sb3.VecEnv("Reacher-v5", 3, dtype=np.float32)
    envs.seed(1)
    assert envs.reset().dtype == np.float32
    assert envs.get_attr("np_random_seed") == [1, 2, 3]
    assert envs.get_attr("np_random_seed", [2, 0]) == [3, 1]
    assert envs.env_method("get_body_com", "body0", indices=1)[0].shape == (3,)
    single = mjenv.make("Reacher-v5")
    assert envs.get_attr("spec") == [single.spec] * 3
    assert envs.env_method("get_wrapper_attr", "dt") == [single.dt] * 3
    for obs, info in envs.env_method("reset", seed=3):
        expected = single.reset(seed=3)
        assert same(obs, expected[0].astype(np.float32))
        check_info(info, expected[1])
    assert envs.get_attr("np_random_seed") == [3, 3, 3]
    assert envs.env_is_wrapped(object) == [False] * 3
    assert envs.render_mode is None
    with pytest.raises(AttributeError, match="nothing"):
        envs.get_attr("nothing")
    with pytest.raises(AttributeError, match="reward_dist_weight"):
        envs.set_attr("reward_dist_weight", 2)
    with pytest.raises(AttributeError, match="render_mode None"):
        envs.get_images()
    with pytest.raises(mjenv.InvalidValueError, match="shape"):
        envs.step(np.zeros((2, 2)))
    with pytest.raises(TypeError, match=r"the id is a str.*this is an environment, and make needs its id"):
        sb3.VecEnv(mjenv.make_vec("Reacher-v5", 3))
    with pytest.raises(TypeError, match="autoreset_mode"):
        sb3.VecEnv("Reacher-v5", 3, autoreset_mode="Disabled")
    other = pickle.loads(pickle.dumps(envs))
    assert other.step(np.ones((3, 2)))[0].tobytes() == envs.step(np.ones((3, 2)))[0].tobytes()
    envs.close()
    with pytest.raises(mjenv.ClosedError):
        envs.step(np.zeros((3, 2)))


def test_without_stable_baselines3() -> None:
    """mjenv itself does not need it; mjenv_sb3 says what to install."""
    script = """
import sys
sys.modules["stable_baselines3"] = None
import mjenv
try:
    import mjenv_sb3
except ImportError as error:
    assert "pip install stable-baselines3" in str(error)
else:
    sys.exit("imported")
"""
    subprocess.run([sys.executable, "-c", script], check=True)
