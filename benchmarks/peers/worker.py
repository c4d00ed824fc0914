"""Steps one peer on request: worker.py PEER. Reads commands from stdin and writes answers to stdout.

about -> what runs here | open ID ENVS THREADS SEED -> ok | run SECONDS -> env steps and seconds taken | close -> ok
Each peer plays its own episodes under random actions drawn beforehand.
"""

from __future__ import annotations

import gc
import importlib
import itertools
import os
import platform
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

WARM_UP = 30  # steps before measuring, so that the robots have fallen and the caches are filled
ACTIONS = 16384  # how many are drawn before measuring; all environments share them

Step = Callable[[Any], int]  # takes actions, returns how many env steps it made


def drawn(space: Any, envs: int, dtype: Any, seed: int) -> Iterator[Any]:
    """Endless actions [envs][nu] within the space of one environment; [nu] where envs is 0."""
    count = max(64, ACTIONS // max(envs, 1))
    shape = (count, envs, *space.shape) if envs else (count, *space.shape)
    values = np.random.default_rng(seed).uniform(space.low, space.high, shape).astype(dtype)
    return itertools.cycle(list(values))


class Peer:
    """One configuration of one peer: actions, and what takes a step with them.

    Where steps are under way between calls, start sends the first and finish waits for the last, so that nothing runs
    while others are measured; finish returns how many env steps it made."""

    packages: tuple[str, ...] = ()

    def __init__(self, actions: Iterator[Any], step: Step, close: Callable[[], Any]) -> None:
        self.actions, self.step, self.close = actions, step, close

    def start(self) -> None: ...

    def finish(self) -> int:
        return 0


class Single(Peer):
    """An environment with the interface of gymnasium.Env."""

    def __init__(self, env: Any, seed: int) -> None:
        env.reset(seed=seed)

        def step(action: Any) -> int:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
            return 1

        super().__init__(drawn(env.action_space, 0, np.float32, seed), step, env.close)


class Vector(Peer):
    """A gymnasium.vector.VectorEnv."""

    def __init__(self, env: Any, actions: Iterator[Any]) -> None:
        def step(action: Any) -> int:
            env.step(action)
            return len(action)

        super().__init__(actions, step, env.close)


class MjenvSingle(Single):
    packages = ("mjenv", "gymnasium", "numpy")

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import mjenv

        super().__init__(mjenv.make(id), seed)


class Mjenv(Vector):
    packages = ("mjenv", "gymnasium", "numpy")

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import mjenv

        env = mjenv.make_vec(id, envs, num_threads=threads)
        env.reset(seed=seed)
        super().__init__(env, drawn(env.single_action_space, envs, np.float32, seed))


def own_values(model: Any, envs: int, seed: int) -> tuple[Any, Any]:
    """Masses and frictions for each environment."""
    random = np.random.default_rng(seed)
    mass = model.body_mass * random.uniform(0.8, 1.2, (envs, *model.body_mass.shape))
    return mass, model.geom_friction * random.uniform(0.5, 1.5, (envs, *model.geom_friction.shape))


class MjenvOwn(Mjenv):
    """Each environment has masses and frictions of its own."""

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import mjenv

        env = mjenv.make_vec(id, envs, num_threads=threads)
        model = env.envs[0].model
        env.model.body_mass[:], env.model.geom_friction[:] = own_values(model, envs, seed)
        env.reset(seed=seed)
        Vector.__init__(self, env, drawn(env.single_action_space, envs, np.float32, seed))


class MjenvAsync(Peer):
    """send and recv, half of the environments at a time."""

    packages = ("mjenv", "gymnasium", "numpy")

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import mjenv

        self.env = env = mjenv.make_vec(id, envs, num_threads=threads)
        env.reset(seed=seed)

        def step(action: Any) -> int:
            rows = env.recv(envs // 2)[0]
            env.send(action[: len(rows)], rows)
            return len(rows)

        super().__init__(drawn(env.single_action_space, envs, np.float32, seed), step, env.close)

    def start(self) -> None:
        self.env.send(next(self.actions))

    def finish(self) -> int:
        return len(self.env.recv()[0])


class GymnasiumSingle(Single):
    packages = ("gymnasium", "mujoco", "numpy")

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import gymnasium

        super().__init__(gymnasium.make(id), seed)


class GymnasiumSync(Vector):
    packages = ("gymnasium", "mujoco", "numpy")
    mode = "sync"

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import gymnasium

        env = gymnasium.make_vec(id, envs, vectorization_mode=self.mode)
        env.reset(seed=seed)
        super().__init__(env, drawn(env.single_action_space, envs, np.float32, seed))


class GymnasiumAsync(GymnasiumSync):
    """An AsyncVectorEnv, which runs a process for each environment."""

    mode = "async"


class EnvPoolSync(Vector):
    packages = ("envpool", "gymnasium", "numpy")

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import envpool

        env = envpool.make_gymnasium(id, num_envs=envs, num_threads=threads, seed=seed)
        env.reset()
        super().__init__(env, drawn(env.action_space, envs, np.float64, seed))


class EnvPoolAsync(Peer):
    """send and recv, half of the environments at a time."""

    packages = ("envpool", "gymnasium", "numpy")

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import envpool

        half = envs // 2
        self.env = env = envpool.make_gymnasium(id, num_envs=envs, batch_size=half, num_threads=threads, seed=seed)
        env.async_reset()
        self.received = [env.recv()[4]["env_id"] for _ in range(2)]

        def step(action: Any) -> int:
            env.send(action, env.recv()[4]["env_id"])
            return half

        super().__init__(drawn(env.action_space, half, np.float64, seed), step, env.close)

    def start(self) -> None:
        for rows in self.received:
            self.env.send(next(self.actions), rows)

    def finish(self) -> int:
        self.received = [self.env.recv()[4]["env_id"] for _ in range(2)]
        return sum(map(len, self.received))


class MujocoBatch(Peer):
    """The physics alone. Simulations go back to a start as often as Gymnasium's episodes do under random actions, by
    writing their states, which is quicker than Batch.reset."""

    packages = ("mujoco", "numpy")

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import gymnasium
        from mujoco.batch import Batch

        env = gymnasium.make(id)
        bare: Any = env.unwrapped
        starts, lengths = self._episodes(env, seed)
        random = np.random.default_rng(seed)
        batch = Batch(bare.model, envs, threads)
        self._prepare(batch, seed)
        qpos, qvel, ctrl = batch.bind("qpos"), batch.bind("qvel"), batch.bind("ctrl")

        def start(ids: Any) -> None:
            chosen = random.integers(len(starts), size=len(ids))
            qpos[ids], qvel[ids] = starts[chosen, : bare.model.nq], starts[chosen, bare.model.nq :]
            left[ids] = lengths[random.integers(len(lengths), size=len(ids))]

        left = np.zeros(envs, np.int64)
        start(np.arange(envs))
        frames = bare.frame_skip

        def step(action: Any) -> int:
            nonlocal left
            ctrl[:] = action
            batch.step(nstep=frames)
            left -= 1
            if not left.all():
                start(np.flatnonzero(left == 0))
            return envs

        super().__init__(drawn(env.action_space, envs, np.float64, seed), step, env.close)

    def _prepare(self, batch: Any, seed: int) -> None: ...

    @staticmethod
    def _episodes(env: Any, seed: int) -> tuple[Any, Any]:
        """The states that episodes start from, and the number of steps in an episode."""
        env.action_space.seed(seed)
        env.reset(seed=seed)
        starts, lengths, length = [], [], 0
        for _ in range(2000):
            length += 1
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                lengths.append(length)
                env.reset()
                length = 0
        for _ in range(64):
            env.reset()
            starts.append(np.concatenate([env.unwrapped.data.qpos, env.unwrapped.data.qvel]))
        return np.array(starts), np.array(lengths)


class MujocoBatchOwn(MujocoBatch):
    """Each simulation has masses and frictions of its own."""

    def _prepare(self, batch: Any, seed: int) -> None:
        values = own_values(batch.model, batch.nsim, seed)
        batch.expand("body_mass")[:], batch.expand("geom_friction")[:] = values


PEERS: dict[str, type[Peer]] = {
    "mjenv-single": MjenvSingle,
    "mjenv": Mjenv,
    "mjenv-own": MjenvOwn,
    "mjenv-async": MjenvAsync,
    "gymnasium-single": GymnasiumSingle,
    "gymnasium-sync": GymnasiumSync,
    "gymnasium-async": GymnasiumAsync,
    "envpool-sync": EnvPoolSync,
    "envpool-async": EnvPoolAsync,
    "mujoco-batch": MujocoBatch,
    "mujoco-batch-own": MujocoBatchOwn,
}


# Seconds of the processors, if MJENV_BENCHMARK_CLOCK is "cpu": what other programs do changes them less.
CLOCK = time.process_time if os.environ.get("MJENV_BENCHMARK_CLOCK") == "cpu" else time.perf_counter


def about(peer: type[Peer]) -> str:
    modules = [importlib.import_module(package) for package in peer.packages]
    versions = [f"{m.__name__} {getattr(m, '__version__', None) or m.version()}" for m in modules]
    return ", ".join([*versions, f"Python {platform.python_version()}"])


def run(peer: Peer, seconds: float, least: int = 1) -> tuple[int, float]:
    """Steps for about `seconds`, and makes at least `least` environment steps."""
    actions, step, clock = peer.actions, peer.step, CLOCK
    steps, start = 0, clock()
    end = start + seconds
    peer.start()
    while clock() < end or steps < least:
        steps += step(next(actions))
    steps += peer.finish()
    return steps, clock() - start


def serve(kind: type[Peer]) -> None:
    """Answers the commands in stdin for one kind of peer."""
    # The answers go to what is stdout now; what the peers print goes to stderr.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    peer: Peer | None = None
    for line in sys.stdin:
        command, *arguments = line.split()
        answer = "ok"
        if command == "about":
            answer = about(kind)
        elif command == "open":
            id, envs, threads, seed = arguments[0], *map(int, arguments[1:])
            peer = kind(id, envs, threads, seed)
            run(peer, 0, WARM_UP * envs)
        elif peer is None:
            answer = "nothing is open"
        elif command == "run":
            steps, taken = run(peer, float(arguments[0]))
            answer = f"{steps} {taken!r}"
        elif command == "close":
            peer.close()
            peer = None
            gc.collect()
        print(answer, file=answers, flush=True)


if __name__ == "__main__":
    serve(PEERS[sys.argv[1]])
