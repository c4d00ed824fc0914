"""Minari: record, recover the environment, replay."""

import os
import shutil

os.environ["MINARI_DATASETS_PATH"] = os.path.abspath("build/clients-minari")
shutil.rmtree("build/clients-minari", ignore_errors=True)

import gymnasium  # noqa: E402
import minari  # noqa: E402
import numpy as np  # noqa: E402

from common import digest, id_of, show  # noqa: E402

env = minari.DataCollector(gymnasium.make(id_of("Hopper-v5"), reset_noise_scale=0.01))
for seed in range(3):
    env.reset(seed=seed)
    env.action_space.seed(seed)
    for _ in range(60):
        if any(env.step(env.action_space.sample())[2:4]):
            break
about = {
    "algorithm_name": "random",
    "author": "tests",
    "author_email": "",
    "code_permalink": "",
    "description": "random",
}
env.create_dataset(dataset_id="hopper/random-v0", **about)

dataset = minari.load_dataset("hopper/random-v0")
show("recorded", dataset.total_steps, [digest([episode.observations, episode.rewards]) for episode in dataset])
recovered = dataset.recover_environment()
show("options", recovered.spec.kwargs["reset_noise_scale"])
for seed, episode in enumerate(dataset):
    observations = [recovered.reset(seed=seed)[0], *(recovered.step(action)[0] for action in episode.actions)]
    show("replay equal:", np.array_equal(observations, episode.observations))
