"""PufferLib: its emulation of an environment, one after the other and in processes."""

import gymnasium
import numpy as np
import pufferlib.emulation
import pufferlib.vector

from common import digest, id_of, show


def make(buf=None, seed=0):
    env = gymnasium.wrappers.ClipAction(gymnasium.make(id_of("Hopper-v5")))
    return pufferlib.emulation.GymnasiumPufferEnv(env=env, buf=buf, seed=seed)


def main():
    for backend in (pufferlib.vector.Serial, pufferlib.vector.Multiprocessing):
        envs = pufferlib.vector.make(
            make, num_envs=2, backend=backend, **({"num_workers": 2} if "Multi" in backend.__name__ else {})
        )
        rng, found = np.random.default_rng(0), [np.array(envs.reset(seed=3)[0])]
        for _ in range(60):
            found.append([np.array(part) for part in envs.step(rng.uniform(-1, 1, (2, 3)).astype(np.float32))[:4]])
        show(backend.__name__, digest(found))
        envs.close()


if __name__ == "__main__":
    main()
