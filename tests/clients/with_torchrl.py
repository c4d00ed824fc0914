"""TorchRL: GymEnv by id and over a vector, pixels, processes, Collector."""

import gymnasium
import torch
from torchrl.collectors import Collector
from torchrl.envs import (
    Compose,
    DoubleToFloat,
    GymEnv,
    GymWrapper,
    ParallelEnv,
    RewardSum,
    StepCounter,
    TransformedEnv,
    check_env_specs,
)

import mjenv
from common import ON_MJENV, digest, id_of, seen, show

torch.set_num_threads(1)
ID = id_of("HalfCheetah-v5")


def rollout(env, steps=50):
    torch.manual_seed(0)
    env.set_seed(0)
    found = env.rollout(steps, break_when_any_done=False)
    return digest([found["next", "observation"].numpy(), found["next", "reward"].numpy()])


def main():
    env = GymEnv(ID)
    check_env_specs(env)
    show("GymEnv", rollout(env), rollout(GymEnv(ID, ctrl_cost_weight=0.0)))
    env = TransformedEnv(GymEnv(ID), Compose(StepCounter(20), RewardSum(), DoubleToFloat()))
    show("transforms", rollout(env))
    # GymEnv draws a first picture before it has a seed, and Gymnasium's camera looks at where the robot was then.
    pictured = GymEnv(ID, from_pixels=True, pixels_only=False, width=64, height=64, reset_noise_scale=0.0)
    pictured.set_seed(0)
    show("pixels", seen(pictured.reset()["pixels"].numpy()))
    several = ParallelEnv(2, lambda: GymEnv(ID))
    show("ParallelEnv", rollout(several))
    several.close()
    if ON_MJENV:
        envs = mjenv.make_vec("HalfCheetah-v5", 4, autoreset_mode="SameStep")
    else:
        envs = gymnasium.make_vec(ID, 4, vectorization_mode="sync", vector_kwargs={"autoreset_mode": "SameStep"})
    wrapped = GymWrapper(envs)
    show("vector", rollout(wrapped))
    collector = Collector(wrapped, None, frames_per_batch=80, total_frames=240)
    show("Collector", sum(batch.numel() for batch in collector))
    collector.shutdown()


if __name__ == "__main__":
    main()
