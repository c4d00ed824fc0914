"""mjenv_sb3.VecEnv with Stable-Baselines3 itself. Needs stable-baselines3 (and so torch); not part of the plain run."""

import functools
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from mjenv_sb3 import VecEnv
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize

import mjenv

pytestmark = pytest.mark.filterwarnings("default")


def same(a: Any, b: Any) -> bool:
    if isinstance(a, (list, tuple)):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[key], b[key]) for key in a)
    if isinstance(a, np.ndarray):
        return type(b) is np.ndarray and (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())
    return type(a) is type(b) and bool(a == b)


@pytest.mark.parametrize("id", mjenv.ids())
def test_dummy_vec_env(id: str) -> None:
    """Every output equals Stable-Baselines3's own vector environment over single environments."""
    ours = VecEnv(id, 3, num_threads=2, max_episode_steps=12)
    theirs = DummyVecEnv([functools.partial(mjenv.make, id, max_episode_steps=12)] * 3)
    for envs in (ours, theirs):
        envs.seed(7)
    assert same(ours.reset(), theirs.reset())
    assert same(ours.reset_infos, theirs.reset_infos)
    assert (ours.observation_space, ours.action_space) == (theirs.observation_space, theirs.action_space)
    rng = np.random.default_rng(0)
    for step in range(40):
        actions = rng.uniform(-1, 1, (3, *ours.action_space.shape)).astype((np.float32, np.float64)[step % 2])
        assert same(ours.step(actions), theirs.step(actions))
        assert same(ours.reset_infos, theirs.reset_infos)
    assert same(ours.reset(), theirs.reset())


@pytest.mark.parametrize("algorithm", [PPO, SAC])
def test_training_is_the_same(algorithm: Any) -> None:
    """The same weights come out as with Stable-Baselines3's own vector environment."""
    settings = {"n_steps": 64, "batch_size": 64} if algorithm is PPO else {"learning_starts": 200}
    weights = []
    for envs in (VecEnv("Hopper-v5", 4), DummyVecEnv([functools.partial(mjenv.make, "Hopper-v5")] * 4)):
        wrapped = VecNormalize(VecMonitor(envs))
        model = algorithm("MlpPolicy", wrapped, seed=3, device="cpu", **settings)
        model.learn(1024)
        weights.append([value.numpy().copy() for value in model.policy.state_dict().values()])
        wrapped.close()
    assert same(*weights)


def test_evaluation() -> None:
    train = VecEnv("InvertedPendulum-v5", 8)
    model = PPO("MlpPolicy", VecMonitor(train), n_steps=128, batch_size=256, seed=1, device="cpu")
    model.learn(20_000)
    mean, _ = evaluate_policy(model, VecMonitor(VecEnv("InvertedPendulum-v5", 4)), n_eval_episodes=8)
    assert mean > 100  # random actions last some ten steps


def test_saved_policies_play(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """mjenv play loads a policy, and its episode is the policy's."""
    main = pytest.importorskip("mjenv_command").main
    os.environ.setdefault("MUJOCO_GL", "egl")
    env = mjenv.make("Hopper-v5")
    model = SAC("MlpPolicy", env, seed=1, device="cpu")
    model.save(tmp_path / "policy.zip")
    obs, total, steps, ended = env.reset(seed=4)[0], 0.0, 0, False
    while not ended:
        obs, reward, terminated, truncated, _ = env.step(model.predict(obs, deterministic=True)[0])
        total, steps, ended = total + reward, steps + 1, terminated or truncated
    words = ["play", "Hopper-v5", "--seed", "4", "--video", str(tmp_path / "a.png"), "--width", "62", "--height", "44"]
    assert main([*words, "--policy", str(tmp_path / "policy.zip"), "--algorithm", "SAC"]) == 0
    assert capsys.readouterr().out.endswith(f"a.png: {steps} steps, return {total:.6g}\n")
    for algorithm, message in (("PPO", "no policy of PPO"), ("Poet", "no algorithm 'Poet'")):
        assert main([*words, "--policy", str(tmp_path / "policy.zip"), "--algorithm", algorithm]) == 2
        assert message in capsys.readouterr().err


def test_saved_normalizers_play(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """mjenv play normalizes observations by the file of --normalizer."""
    main = pytest.importorskip("mjenv_command").main
    os.environ.setdefault("MUJOCO_GL", "egl")
    envs = VecNormalize(VecEnv("Hopper-v5", 2))
    model = PPO("MlpPolicy", envs, n_steps=64, seed=1, device="cpu")
    model.learn(128)
    model.save(tmp_path / "model.zip")
    envs.save(str(tmp_path / "normalizer.pkl"))
    env = mjenv.make("Hopper-v5")
    obs, total, steps, ended = env.reset(seed=4)[0], 0.0, 0, False
    while not ended:
        action = model.predict(envs.normalize_obs(obs), deterministic=True)[0]
        obs, reward, terminated, truncated, _ = env.step(action)
        total, steps, ended = total + reward, steps + 1, terminated or truncated
    words = ["play", "Hopper-v5", "--seed", "4", "--video", str(tmp_path / "a.png"), "--width", "62", "--height", "44"]
    words += ["--policy", str(tmp_path / "model.zip")]
    assert main([*words, "--normalizer", str(tmp_path / "normalizer.pkl")]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'a.png'}: {steps} steps, return {total:.6g}\n"


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_tensors_share_memory(dtype: Any) -> None:
    """PyTorch takes outputs and exported arrays by DLPack without a copy, and sees the next step in them."""
    envs = mjenv.make_vec("Ant-v5", 3, arrays="xpos", copy=False, dtype=dtype)
    obs, xpos = torch.from_dlpack(envs.reset(seed=1)[0]), torch.from_dlpack(envs.arrays["xpos"])
    before = obs.clone()
    stepped, rewards, *_ = envs.step(torch.ones(3, 8).numpy())
    assert obs.data_ptr() == stepped.ctypes.data
    assert xpos.data_ptr() == envs.arrays["xpos"].ctypes.data
    assert torch.from_dlpack(rewards).data_ptr() == rewards.ctypes.data
    assert not torch.equal(obs, before)
    assert np.array_equal(obs.numpy(), stepped)
    assert np.array_equal(xpos.numpy(), envs.arrays["xpos"])


def test_pictures() -> None:
    os.environ.setdefault("MUJOCO_GL", "egl")
    envs = VecEnv("Hopper-v5", 2, render_mode="rgb_array", width=62, height=44)
    envs.reset()
    assert [image.shape for image in envs.get_images()] == [(44, 62, 3)] * 2
    assert envs.render().shape == (88, 62, 3)
