"""EvoTorch: one environment and a vector of them."""

import gymnasium
import torch
from evotorch.algorithms import PGPE
from evotorch.neuroevolution import GymNE, VecGymNE

import mjenv
from common import ON_MJENV, id_of, show

torch.set_num_threads(1)
NETWORK = "Linear(obs_length, act_length)"
OPTIONS = {"env_config": {"max_episode_steps": 40, "reset_noise_scale": 0.0}}  # it seeds no environment
SEARCH = {"popsize": 4, "center_learning_rate": 0.1, "stdev_learning_rate": 0.1, "stdev_init": 0.1}


def best(problem):
    problem.manual_seed(1)
    search = PGPE(problem, **SEARCH)
    search.run(2)
    return search.status["mean_eval"]


show("GymNE", best(GymNE(id_of("Hopper-v5"), NETWORK, num_actors=None, **OPTIONS)))


def vector(num_envs, **options):
    if ON_MJENV:
        return mjenv.make_vec("Hopper-v5", num_envs, autoreset_mode="SameStep", **options)
    return gymnasium.make_vec(
        "Hopper-v5", num_envs, vectorization_mode="sync", vector_kwargs={"autoreset_mode": "SameStep"}, **options
    )


show("VecGymNE", best(VecGymNE(vector, NETWORK, **OPTIONS)))
