"""Rollouts and training on several Ray nodes give the same bits as without Ray, even when actors or nodes are lost."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ray
import torch

import mjenv
import train as distributed
from pool import Batch, Crew, Pool, State
from train_cleanrl import SETTINGS

ID, ROWS, SEED, STEPS, GAMMA = "Hopper-v5", 4, 5, 96, 0.99


def same(ours: list[Batch], theirs: list[Batch]) -> bool:
    return all(
        (x.dtype, x.shape, x.tobytes()) == (y.dtype, y.shape, y.tobytes())
        for a, b in zip(ours, theirs, strict=True)
        for x, y in zip(a.arrays(), b.arrays(), strict=True)
    ) and [batch.returns for batch in ours] == [batch.returns for batch in theirs]


def learner() -> distributed.Learner:
    torch.set_num_threads(1)
    with mjenv.make(ID) as env:
        sizes = len(env.observation_space.low), len(env.action_space.low)
    return distributed.Learner(*sizes, SETTINGS[ID], SEED)


@pytest.fixture(scope="module")
def expected() -> list[list[Batch]]:
    """Three rollouts of four pools, in this process, with an update after each."""
    pools = [Pool(ID, ROWS, SEED + index * ROWS) for index in range(4)]
    teacher = learner()
    rollouts = []
    for index in range(3):
        rollouts.append([pool.collect(teacher.brain(), STEPS, GAMMA)[0] for pool in pools])
        teacher.learn(rollouts[-1], index / 3)
    assert any(batch.returns for batch in rollouts[-1])
    assert not same(rollouts[0], rollouts[1])
    return rollouts


def crew_of(count: int = 4) -> Crew:
    return Crew(ID, count, ROWS, SEED)


def kill(actor: Any) -> None:
    """Kills an actor's process, which only then is gone for good."""
    process = ray.get(actor.__ray_call__.remote(lambda self: os.getpid()))
    os.kill(process, signal.SIGKILL)


def test_state_is_all(expected: list[list[Batch]]) -> None:
    """A pool that continues from the state of another gives the same batches as that one."""
    teacher = learner()
    one = Pool(ID, ROWS, SEED)
    _, state, _ = one.collect(teacher.brain(), STEPS, GAMMA)
    teacher.learn(expected[0], 0)
    assert isinstance(state, State)
    # A pool that continues from a state does not use its seed.
    again = Pool(ID, ROWS, 999, state).collect(teacher.brain(), STEPS, GAMMA)[0]
    assert same([again], [one.collect(teacher.brain(), STEPS, GAMMA)[0]])
    assert same([again], expected[1][:1])


def test_pools_on_several_nodes(cluster: Any, expected: list[list[Batch]]) -> None:
    crew, teacher = crew_of(), learner()
    for index, batches in enumerate(expected):
        assert same(crew.collect(teacher.brain(), STEPS, GAMMA), batches)
        teacher.learn(batches, index / 3)
    crew.close()
    found = crew.throughput()
    print("\n".join(f"node {node}: {steps} steps, {rate:.0f} steps/s a pool" for node, _, _, steps, rate in found))
    assert len(found) >= 2
    assert sum(steps for _, _, _, steps, _ in found) == 3 * 4 * ROWS * STEPS
    assert all(rate > 0 for *_, rate in found)
    assert crew.restarts == 0


def test_actors_that_die(cluster: Any, expected: list[list[Batch]]) -> None:
    """Losing an actor between two rollouts and another one during a rollout changes no bit."""
    crew, teacher = crew_of(), learner()
    for index, batches in enumerate(expected):
        if index == 1:
            kill(crew.pools[2])
        if index == 2:
            # It dies after the batch was requested, but before it begins.
            victim = crew.pools[1]
            process = ray.get(victim.__ray_call__.remote(lambda self: os.getpid()))
            os.kill(process, signal.SIGSTOP)
            calls = crew.begin(teacher.brain(), STEPS, GAMMA)
            os.kill(process, signal.SIGKILL)
            assert same(crew.end(calls), batches)
        else:
            assert same(crew.collect(teacher.brain(), STEPS, GAMMA), batches)
        teacher.learn(batches, index / 3)
    crew.close()
    assert crew.restarts == 2


def test_a_crew_gives_up(cluster: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """When every attempt fails, the driver gets an error."""
    crew = crew_of(1)
    crew.collect(learner().brain(), 2, GAMMA)
    start = crew._start

    def doomed(index: int) -> Any:
        pool = start(index)
        ray.kill(pool)
        return pool

    monkeypatch.setattr(crew, "_start", doomed)
    kill(crew.pools[0])
    with pytest.raises(ray.exceptions.RayActorError):
        crew.collect(learner().brain(), 2, GAMMA)


def test_training_and_a_lost_node(cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """When a node is lost during a training, curve and policy equal those of a training without the loss."""
    monkeypatch.setitem(SETTINGS, ID, distributed.Settings(rollout=64, epochs=2))
    torch.set_num_threads(1)
    whole = distributed.train(ID, 2, ROWS, 4, SEED, tmp_path / "whole")
    assert whole.restarts == 0

    extra = cluster.add_node(num_cpus=2, resources={"extra": 1})
    collect, rollouts = Crew.collect, []

    def lossy(crew: Crew, *request: Any) -> list[Batch]:
        if len(rollouts) == 2:
            moved = ray.remote(num_cpus=1, resources={"extra": 0.1})(Pool)
            crew.pools[0] = moved.remote(ID, ROWS, 0, crew._states[0])
            calls = crew.begin(*request)
            rollouts.append(crew.end(calls))
            cluster.remove_node(extra, allow_graceful=False)
        else:
            rollouts.append(collect(crew, *request))
        return rollouts[-1]

    monkeypatch.setattr(Crew, "collect", lossy)
    torn = distributed.train(ID, 2, ROWS, 4, SEED, tmp_path / "torn")
    assert torn.restarts >= 1  # the node may have held both pools

    def curve(folder: str) -> list[list[str]]:
        rows = [line.split(",") for line in (tmp_path / folder / "curve.csv").read_text().splitlines()]
        return [[steps, mean] for steps, _, mean in rows]

    assert curve("whole") == curve("torn")
    assert (tmp_path / "whole" / "policy.txt").read_bytes() == (tmp_path / "torn" / "policy.txt").read_bytes()


def test_rllib(cluster: Any) -> None:
    """The runners step mjenv's vector environment, and their samples equal Gymnasium's and suffice to learn."""
    import rllib_ppo

    algorithm = rllib_ppo.config("InvertedPendulum-v5", runners=2, rows=4).build_algo()
    kinds = algorithm.env_runner_group.foreach_env_runner(
        lambda runner: (type(runner.env.unwrapped).__module__, runner.env.unwrapped.num_envs), local_env_runner=False
    )
    assert kinds == [("mjenv.gym.vector", 4)] * 2
    start = time.perf_counter()
    returns = []
    for _ in range(3):
        result = algorithm.train()["env_runners"]
        returns.append(result["episode_return_mean"])
    steps = result["num_env_steps_sampled_lifetime"]
    print(f"{steps:.0f} steps in {time.perf_counter() - start:.1f} s, returns {np.round(returns, 1)}")
    assert steps >= 3 * 4096
    assert returns[-1] > returns[0]
    algorithm.stop()
