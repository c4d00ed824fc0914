"""d3rlpy: SAC on the environment, TD3+BC on what it collected, evaluation."""

import d3rlpy
import gymnasium
import numpy as np

from common import digest, id_of, show

d3rlpy.seed(0)
envs = [gymnasium.make(id_of("Hopper-v5")) for _ in range(2)]
for number, env in enumerate(envs):
    env.reset(seed=number)
    env.action_space.seed(number)
sac = d3rlpy.algos.SACConfig(batch_size=32).create(device="cpu")
buffer = d3rlpy.dataset.create_fifo_replay_buffer(limit=1000, env=envs[0])
options = {"update_start_step": 60, "random_steps": 60, "save_interval": 99, "show_progress": False}
logs = d3rlpy.logging.NoopAdapterFactory()
sac.fit_online(envs[0], buffer, n_steps=150, n_steps_per_epoch=150, logger_adapter=logs, **options)
show("SAC", digest(sac.predict(np.ones((1, 11), np.float32))))
td3 = d3rlpy.algos.TD3PlusBCConfig(batch_size=32).create(device="cpu")
td3.fit(buffer, n_steps=50, n_steps_per_epoch=50, show_progress=False, save_interval=99, logger_adapter=logs)
show("TD3+BC", digest(td3.predict(np.ones((1, 11), np.float32))))
show("evaluation", d3rlpy.metrics.EnvironmentEvaluator(envs[1], n_trials=2)(sac, None))
