"""Compiled programs that step environments equal loops in Python, bit for bit."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import mjenv_jax
import numpy as np
import pytest

import mjenv

ROWS, STEPS = 64, 64


def same(got: Any, expected: Any) -> None:
    got, expected = np.asarray(got), np.asarray(expected)
    assert got.shape == expected.shape
    assert got.tobytes() == expected.astype(got.dtype).tobytes()


@pytest.fixture(params=[False, True], ids=["float32", "float64"])
def real(request: pytest.FixtureRequest) -> Any:
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", request.param)
    yield np.float64 if request.param else np.float32
    jax.config.update("jax_enable_x64", before)


def weights(real: Any) -> dict[str, Any]:
    rng = np.random.default_rng(0)
    return {
        "actor": jnp.asarray(rng.normal(0, 0.3, (11, 3)), real),
        "critic": jnp.asarray(rng.normal(0, 0.1, 11), real),
    }


def sampled(policy: Any, obs: Any, noise: Any) -> Any:
    return jnp.tanh(obs @ policy["actor"] + 0.1 * noise)


def updated(policy: Any, seen: Any, noise: Any, rewards: Any, ended: Any, last: Any) -> Any:
    """One step of PPO: advantages by GAE, the clipped ratio, the critic's squared error.

    The barriers keep XLA from fusing it with what stands around it, which would add in another order.
    """
    policy, seen, noise, rewards, ended, last = jax.lax.optimization_barrier(
        (policy, seen, noise, rewards, ended, last)
    )
    values = seen @ policy["critic"]

    def back(carry: Any, now: Any) -> Any:
        advantage, after = carry
        reward, value, ends = now
        going_on = 1 - ends.astype(seen.dtype)
        advantage = reward + 0.99 * after * going_on - value + 0.99 * 0.95 * advantage * going_on
        return (advantage, value), advantage

    first = jnp.zeros(ROWS, seen.dtype), last @ policy["critic"]
    _, advantages = jax.lax.scan(back, first, (rewards, values, ended), reverse=True)
    before = seen @ policy["actor"] + 0.1 * noise

    def loss(policy: Any) -> Any:
        log = -0.5 * jnp.square((before - seen @ policy["actor"]) / 0.1).sum(-1)
        ratio = jnp.exp(log + 0.5 * jnp.square(noise).sum(-1))
        gain = jnp.minimum(ratio * advantages, jnp.clip(ratio, 0.8, 1.2) * advantages).mean()
        return jnp.square(seen @ policy["critic"] - values - advantages).mean() - gain

    slopes = jax.lax.optimization_barrier(jax.grad(loss)(policy))
    return jax.tree.map(lambda weight, slope: weight - 1e-3 * slope, policy, slopes)


def test_an_update_of_ppo_in_one_jit_equals_the_loop_in_python(real: Any) -> None:
    env = mjenv_jax.make("Hopper-v5", ROWS, num_threads=2)
    noise = jnp.asarray(np.random.default_rng(1).normal(size=(STEPS, ROWS, 3)), real)

    @jax.jit
    def whole(policy: Any) -> Any:
        def step(carry: Any, noise: Any) -> Any:
            handle, obs = carry
            handle, found = env.step(handle, sampled(policy, obs, noise))
            return (handle, found.obs), (obs, found)

        (handle, last), (seen, found) = jax.lax.scan(step, env.reset(5), noise)
        ended = found.terminated | found.truncated
        return updated(policy, seen, noise, found.reward, ended, last), seen, found, handle

    policy, seen, found, handle = whole(weights(real))
    assert handle.tolist() == [env.number, STEPS + 1]

    envs = mjenv.make_vec("Hopper-v5", ROWS, dtype=real)
    obs, _ = envs.reset(seed=5)
    act, all_seen, all_rewards, all_ended = jax.jit(sampled), [], [], []
    for step in range(STEPS):
        all_seen.append(obs)
        obs, rewards, terminated, truncated, _ = envs.step(np.asarray(act(weights(real), obs, noise[step])))
        all_rewards.append(rewards.astype(real))
        all_ended.append(terminated | truncated)
    same(seen, all_seen)
    same(found.reward, all_rewards)
    same(found.terminated | found.truncated, all_ended)
    assert np.any(all_ended)
    arrays = [jnp.asarray(np.array(values)) for values in (all_seen, noise, all_rewards, all_ended, obs)]
    expected = jax.jit(updated)(weights(real), *arrays)
    for name in policy:
        same(policy[name], expected[name])
        assert np.any(policy[name] != weights(real)[name])


def test_two_environments_and_a_while_loop(real: Any) -> None:
    one, two = mjenv_jax.make("Hopper-v5", 2), mjenv_jax.make("Reacher-v5", 3)

    @jax.jit
    def until_one_falls() -> Any:
        (a, _), (b, _) = one.reset(1), two.reset(2)

        def step(carry: Any) -> Any:
            a, b, count, _ = carry
            a, hopper = one.step(a, jnp.ones((2, 3)))
            b, reacher = two.step(b, jnp.ones((3, 2)))
            return a, b, count + 1, (hopper.terminated, reacher.obs)

        start = (a, b, 0, (jnp.zeros(2, bool), jnp.zeros((3, 10), real)))
        return jax.lax.while_loop(lambda carry: ~carry[3][0].any(), step, start)

    _, _, count, (_, obs) = until_one_falls()
    hopper, reacher = mjenv.make_vec("Hopper-v5", 2), mjenv.make_vec("Reacher-v5", 3, dtype=real)
    hopper.reset(seed=1)
    reacher.reset(seed=2)
    for _ in range(count):
        *_, terminated, _, _ = hopper.step(np.ones((2, 3), real))
        expected, *_ = reacher.step(np.ones((3, 2), real))
    assert terminated.any()
    same(obs, expected)


PENDULUM = """<mujoco><worldbody><body>
<joint name="hinge" axis="0 1 0"/><geom size="0.1" pos="0 0 -1"/></body></worldbody>
<actuator><motor joint="hinge" ctrllimited="true" ctrlrange="-1 1"/></actuator></mujoco>"""


def test_rewards_and_observations_are_compiled_with_the_policy(real: Any) -> None:
    options = {"xml_string": PENDULUM, "observations": 2, "arrays": "qpos qvel", "max_episode_steps": 20}
    env = mjenv_jax.make("Batch-v0", 4, **options)
    start, still = jnp.linspace(0, 1, 4)[:, None].astype(real), jnp.zeros((4, 1), real)

    def observed(arrays: Any) -> Any:
        return jnp.concatenate([jnp.sin(arrays["qpos"]), arrays["qvel"]], 1)

    @jax.jit
    def play() -> Any:
        handle, _ = env.reset(0)
        handle, arrays = env.begin(handle, jnp.ones(4, bool), start, still)
        handle, first = env.finish(handle, observed(arrays))

        def step(carry: Any, _: Any) -> Any:
            handle, obs = carry
            handle, arrays, resets = env.advance(handle, obs[:, :1])
            handle, begun = env.begin(handle, resets, start, still)
            arrays = {name: jnp.where(resets[:, None], begun[name], arrays[name]) for name in arrays}
            handle, found = env.finish(handle, observed(arrays), -jnp.square(arrays["qpos"][:, 0]))
            return (handle, found.obs), (found, arrays)

        return jax.lax.scan(step, (handle, first.obs), None, length=50)[1]

    found, arrays = play()
    stepped = ~np.asarray(found.was_reset)
    same(found.reward[stepped], -jnp.square(arrays["qpos"][..., 0])[stepped])
    assert np.flatnonzero(found.truncated.all(1)).tolist() == [19, 40]
    assert np.flatnonzero(found.was_reset.all(1)).tolist() == [20, 41]
    model = mjenv.make_vec("Model-v0", 4, xml_string=PENDULUM, dtype=np.float64)
    model.reset(seed=0)
    model.handle.set_state(mjenv.capi.declarations.ALL_ROWS, np.asarray(start, np.float64), np.zeros((4, 1)))
    obs = np.asarray(jnp.concatenate([jnp.sin(start), still], 1))
    for step in range(19):
        state, *_ = model.step(np.asarray(obs[:, :1]))
        same(arrays["qpos"][step], state[:, :1].astype(real))
        obs = np.asarray(found.obs[step])


def test_donated_buffers(real: Any) -> None:
    """A program may give its handle and observations away, for XLA to write the next ones there."""
    policy, results = weights(real), []
    for donated in ((), (0, 1)):
        env = mjenv_jax.make("Hopper-v5", ROWS)

        def step(handle: Any, obs: Any, env: mjenv_jax.Env = env) -> Any:
            handle, found = env.step(handle, sampled(policy, obs, 1))
            return handle, found.obs, found.reward

        compiled, (handle, obs), seen = jax.jit(step, donate_argnums=donated), env.reset(3), []
        for _ in range(30):
            given = obs
            handle, obs, reward = compiled(handle, obs)
            seen += [np.array(obs), np.array(reward)]
            assert given.is_deleted() == bool(donated)
        results.append(seen)
    for got, expected in zip(*results, strict=True):
        same(got, expected)


def test_misuse() -> None:
    env = mjenv_jax.make("Hopper-v5", 2)
    handle, _ = env.reset(1)
    action = jnp.zeros((2, 3))
    after, _ = env.step(handle, action)
    with pytest.raises(Exception, match="this handle is that of turn 1, but the environment is at turn 2"):
        jax.block_until_ready(env.step(handle, action))
    with pytest.raises(NotImplementedError, match="vmap"):
        jax.vmap(lambda a: env.step(after, a))(jnp.zeros((5, 2, 3)))
    with pytest.raises(ValueError, match=r"mjenv_jax_step. cannot be differentiated"):
        jax.grad(lambda a: env.step(after, a)[1].reward.sum())(action)
    with pytest.raises(mjenv.InvalidValueError, match=r"action has the shape \(3, 2\), not \(2, 3\)"):
        env.step(after, action.T)
    with pytest.raises(Exception, match=r"mjenv: row 0: action\[0\] is nan, but must be finite"):
        jax.block_until_ready(env.step(after, action * jnp.nan))
    after, _ = env.step(after, action)  # the refused step has changed nothing
    env.close()
    with pytest.raises(Exception, match="this environment was closed"):
        jax.block_until_ready(env.step(after, action))
    jax.clear_caches()


def test_a_program_refuses_an_environment_with_other_rows() -> None:
    """Also if all arrays of numbers have as many as those of its own."""
    joint = '<body><joint name="{0}" type="slide"/><geom size="1"/></body>'
    motor = '<motor joint="{0}" ctrlrange="-1 1" ctrllimited="true"/>'
    envs = []
    for rows, count in ((2, 4), (8, 1)):
        bodies, motors = ("".join(part.format(i) for i in range(count)) for part in (joint, motor))
        xml = f"<mujoco><worldbody>{bodies}</worldbody><actuator>{motors}</actuator></mujoco>"
        envs.append(mjenv_jax.make("Batch-v0", rows, xml_string=xml, observations=1))
    mine, other = envs
    handle, _ = other.reset(1)
    with pytest.raises(Exception, match="this program was compiled for another environment"):
        jax.block_until_ready(jax.jit(mine.advance)(handle, jnp.zeros((2, 4))))
    jax.clear_caches()


class Hop(mjenv.Task):
    """A task over all rows whose methods return arrays of JAX."""

    model = "hopper.xml"
    frame_skip = 4

    def reset(self, rng: Any, rows: int) -> Any:
        return np.tile(self.qpos0, (rows, 1)), jnp.zeros((rows, self.nv))

    def observe(self, sim: Any) -> Any:
        return jnp.concatenate([jnp.asarray(sim.qpos), jnp.asarray(sim.qvel)], 1)

    def step(self, sim: Any, action: Any) -> Any:
        height = jnp.asarray(sim.qpos)[:, 1]
        return height, height < 0.7, {"height": height}


mjenv.register("Hop-v0", Hop)


def test_numpy_tasks_may_return_arrays_of_jax() -> None:
    envs = mjenv.make_vec("Hop-v0", 2)
    envs.reset(seed=1)
    obs, rewards, _, _, infos = envs.step(np.zeros((2, 3)))
    same(obs.astype(np.float32), np.concatenate([envs.data.qpos, envs.data.qvel], 1))
    same(infos["height"], rewards)
    with pytest.raises(mjenv.TaskError, match="NumPy task"):
        mjenv_jax.make("Hop-v0", 2)
    pytest.importorskip("mjenv_learn")
    settings = {"rows": 8, "rollout_steps": 32, "minibatch_size": 100, "hidden": (16,)}
    training = mjenv.train("Hop-v0", steps=1024, settings=settings, max_episode_steps=20)
    assert training.steps == 1024
    assert mjenv.evaluate(training.policy(), 2, rows=2).returns.min() > 20 * 0.7
