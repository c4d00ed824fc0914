"""Steps environments inside of a function that JAX compiles, on request: worker.py KIND. peers/worker.py describes the
commands.

A policy of one layer acts, in float64, which is what EnvPool's environments compute with.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.experimental import io_callback

from peers.worker import Peer, serve

LENGTH = 100  # steps in one call of the compiled function

# Takes a handle and actions. Returns the next handle, observations, rewards, terminated and truncated.
Step = Callable[[Any, Any], tuple[Any, ...]]


class Compiled(Peer):
    """Each step of the peer is a call of the compiled function."""

    def __init__(self, step: Step, handle: Any, obs: Any, actuators: int, close: Callable[[], Any], seed: int) -> None:
        rows, observations = obs.shape
        weights = jnp.asarray(np.random.default_rng(seed).normal(0, 0.3, (observations, actuators)))

        @jax.jit
        def play(carry: Any) -> Any:
            def one(carry: Any, _: Any) -> Any:
                handle, obs = carry
                handle, obs, *found = step(handle, jnp.tanh(obs @ weights))
                return (handle, obs), found

            return jax.lax.scan(one, carry, None, length=LENGTH)

        carry = (jnp.asarray(handle), jnp.asarray(obs))

        def call(_: Any) -> int:
            nonlocal carry
            carry, found = play(carry)
            jax.block_until_ready((carry, found))
            return LENGTH * int(rows)

        super().__init__(itertools.repeat(None), call, close)


class MjenvJax(Compiled):
    packages = ("mjenv", "jax", "numpy")

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import mjenv_jax

        env = mjenv_jax.make(id, envs, num_threads=threads)

        def step(handle: Any, action: Any) -> tuple[Any, ...]:
            handle, found = env.step(handle, action)
            return handle, found.obs, found.reward, found.terminated, found.truncated

        handle, obs = env.reset(seed)
        super().__init__(step, handle, obs, env.envs.single_action_space.shape[0], env.close, seed)


class IoCallback(Compiled):
    packages = ("mjenv", "jax", "numpy")

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import mjenv

        env = mjenv.make_vec(id, envs, num_threads=threads)
        obs, _ = env.reset(seed=seed)
        real, flags = jax.ShapeDtypeStruct((envs,), np.float64), jax.ShapeDtypeStruct((envs,), np.bool_)
        types = jax.ShapeDtypeStruct(obs.shape, np.float64), real, flags, flags

        def step(handle: Any, action: Any) -> tuple[Any, ...]:
            found = io_callback(lambda action: env.step(np.asarray(action))[:4], types, action, ordered=True)
            return handle, *found

        super().__init__(step, 0, obs, env.single_action_space.shape[0], env.close, seed)


class EnvPool(Compiled):
    packages = ("envpool", "jax", "numpy")

    def __init__(self, id: str, envs: int, threads: int, seed: int) -> None:
        import envpool

        env = envpool.make_gymnasium(id, num_envs=envs, num_threads=threads, seed=seed)
        obs, _ = env.reset()
        handle, _, _, step_all = env.xla()

        def step(handle: Any, action: Any) -> tuple[Any, ...]:
            handle, (obs, reward, terminated, truncated, _) = step_all(handle, action)
            return handle, obs, reward, terminated, truncated

        super().__init__(step, handle, obs, env.action_space.shape[0], env.close, seed)


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    serve({"mjenv_jax": MjenvJax, "io_callback": IoCallback, "envpool": EnvPool}[sys.argv[1]])
