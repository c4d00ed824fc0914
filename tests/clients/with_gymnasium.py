"""Gymnasium's check_env and its wrappers, of environments and of vectors."""

import os
import shutil
import warnings

import gymnasium
import numpy as np
from gymnasium import wrappers
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import vector

from common import ON_MJENV, digest, id_of, play, seen, show

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
warnings.simplefilter("ignore")
SIZE = {"width": 64, "height": 64}
BOX = gymnasium.spaces.Box(-9, 9, (11,))


def make(**options):
    return gymnasium.make(id_of("Hopper-v5"), **options)


for robot in ("Ant", "HalfCheetah", "Hopper", "Humanoid", "InvertedPendulum", "Pusher", "Reacher", "Swimmer"):
    check_env(gymnasium.make(id_of(f"{robot}-v5")).unwrapped, skip_render_check=True)
    show("check_env", robot)

SINGLE = {
    "Autoreset": {}, "ClipAction": {}, "ClipReward": {"min_reward": -1, "max_reward": 1},
    "DelayObservation": {"delay": 3},
    "DtypeObservation": {"dtype": np.float32}, "FlattenObservation": {}, "FrameStackObservation": {"stack_size": 4},
    "MaxAndSkipObservation": {"skip": 3}, "NormalizeObservation": {}, "NormalizeReward": {}, "OrderEnforcing": {},
    "PassiveEnvChecker": {}, "RescaleAction": {"min_action": -2, "max_action": 2},
    "StickyAction": {"repeat_action_probability": 0.3},
    "TimeAwareObservation": {}, "TimeLimit": {"max_episode_steps": 20}, "RepeatAction": {"num_repeats": 3},
    "TransformAction": {"func": lambda a: a / 2, "action_space": None}, "TransformReward": {"func": lambda r: r * 2},
    "TransformObservation": {"func": lambda o: np.clip(o, -9, 9), "observation_space": BOX},
    "NumpyToTorch": {},
}  # fmt: skip
for name, options in SINGLE.items():
    if hasattr(wrappers, name) and name != "NumpyToTorch":
        show(name, play(getattr(wrappers, name)(make(), **options)))
show(
    "RescaleObservation",
    play(wrappers.RescaleObservation(wrappers.TransformObservation(make(), lambda o: np.clip(o, -9, 9), BOX), -1, 1)),
)
env = wrappers.NumpyToTorch(make())
show("NumpyToTorch", digest([part.numpy() if hasattr(part, "numpy") else part for part in env.reset(seed=1)]))
statistics = wrappers.RecordEpisodeStatistics(make())
play(statistics)
show("RecordEpisodeStatistics", list(statistics.return_queue), list(statistics.length_queue))

pictured = make(render_mode="rgb_array", **SIZE)
show("AddRenderObservation", seen(wrappers.AddRenderObservation(pictured).reset(seed=1)[0]))
gray = wrappers.GrayscaleObservation(wrappers.ResizeObservation(wrappers.AddRenderObservation(pictured), (32, 32)))
show("GrayscaleObservation, ResizeObservation", seen(gray.reset(seed=1)[0]))
frames = wrappers.RenderCollection(make(render_mode="rgb_array", **SIZE))
play(frames, 5)
show("RenderCollection", seen(frames.render()))
play(wrappers.HumanRendering(pictured), 3)
shutil.rmtree("build/clients-videos", ignore_errors=True)
recorded = wrappers.RecordVideo(
    make(render_mode="rgb_array", **SIZE), "build/clients-videos", episode_trigger=lambda _: True
)
play(recorded, 40)
recorded.close()
show("RecordVideo", sorted(os.listdir("build/clients-videos")))

VECTOR = {
    "ClipAction": {}, "ClipReward": {"min_reward": -1, "max_reward": 1}, "DictInfoToList": {},
    "DtypeObservation": {"dtype": np.float32}, "FlattenObservation": {}, "NormalizeObservation": {},
    "NormalizeReward": {}, "RescaleAction": {"min_action": -2, "max_action": 2},
    "TransformReward": {"func": lambda r: r * 2},
    "TransformAction": {"func": lambda a: a / 2, "action_space": None},
    "TransformObservation": {"func": lambda o: o * 2},
}  # fmt: skip
for name, options in VECTOR.items():
    sync = {} if ON_MJENV else {"vectorization_mode": "sync"}
    envs = getattr(vector, name)(gymnasium.make_vec(id_of("Hopper-v5"), num_envs=3, **sync), **options)
    found = [envs.reset(seed=1)[0]]
    envs.action_space.seed(1)
    for _ in range(80):
        found.append(envs.step(envs.action_space.sample())[:4])
    show("vector", name, digest(found))
