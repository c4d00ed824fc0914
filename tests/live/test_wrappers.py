"""The options history, time_aware, clip_actions and rescale_actions, against Gymnasium's wrappers, every bit."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import (
    ClipAction,
    FrameStackObservation,
    RescaleAction,
    TimeAwareObservation,
    TransformObservation,
)
from numpy.typing import NDArray

import mjenv
from conftest import IDS
from mjenv import Delay, Noise, Push
from mjenv.verify import check_same
from test_live_vector import check_results
from test_randomisation import Perturbed

Array = NDArray[Any]
Wrap = Callable[[Any], Any]

# Options, and the wrappers that do the same.
CASES: list[tuple[dict[str, Any], Wrap]] = [
    ({"history": 1}, lambda env: FrameStackObservation(env, 1)),
    ({"history": 3}, lambda env: FrameStackObservation(env, 3)),
    ({"history": 4, "history_padding": "zero"}, lambda env: FrameStackObservation(env, 4, padding_type="zero")),
    ({"time_aware": True}, lambda env: TimeAwareObservation(env, normalize_time=True)),
    ({"time_aware": True, "normalize_time": False}, TimeAwareObservation),
    (
        {"time_aware": True, "history": 3},
        lambda env: FrameStackObservation(TimeAwareObservation(env, normalize_time=True), 3),
    ),
    (
        {"time_aware": True, "normalize_time": False, "history": 2, "history_padding": "zero"},
        lambda env: FrameStackObservation(TimeAwareObservation(env), 2, padding_type="zero"),
    ),
    ({"clip_actions": True}, ClipAction),
    ({"rescale_actions": (-0.3, 0.7)}, lambda env: RescaleAction(env, -0.3, 0.7)),
    ({"rescale_actions": (-2, 1)}, lambda env: RescaleAction(env, -2, 1)),
    (
        {"rescale_actions": (-1, 1), "clip_actions": True, "history": 2},
        lambda env: FrameStackObservation(ClipAction(RescaleAction(env, -1, 1)), 2),
    ),
]
NAMES = [" ".join(f"{name}={value}" for name, value in options.items()) for options, _ in CASES]


def actions_of(space: Any, count: int, seed: int, dtype: Any = np.float32) -> Array:
    """Actions in the space, some of them on its bounds; and beyond, if it has none."""
    rng = np.random.default_rng(seed)
    low, high = np.maximum(space.low, -3), np.minimum(space.high, 3)
    actions = rng.uniform(low, high, (count, *space.shape)).astype(dtype)
    actions[::5], actions[1::5], actions[2::7] = low, high, 0.0
    return actions


def pair(id: str, options: dict[str, Any], wrap: Wrap, limit: int = 9) -> tuple[Any, Any]:
    return mjenv.make(id, max_episode_steps=limit, **options), wrap(gymnasium.make(id, max_episode_steps=limit))


@pytest.mark.parametrize("id", IDS)
@pytest.mark.parametrize(("options", "wrap"), CASES, ids=NAMES)
def test_single(id: str, options: dict[str, Any], wrap: Wrap) -> None:
    ours, theirs = pair(id, options, wrap)
    assert ours.observation_space == theirs.observation_space
    assert ours.observation_space.dtype == theirs.observation_space.dtype
    assert ours.action_space == theirs.action_space
    for seed, dtype in ((1, np.float32), (None, np.float64)):
        check_same("reset", ours.reset(seed=seed), theirs.reset(seed=seed))
        for t, action in enumerate(actions_of(ours.action_space, 9, 5, dtype)):
            ours_step, theirs_step = ours.step(action), theirs.step(action)
            check_same(f"step {t}", ours_step, theirs_step)
            if ours_step[2] or ours_step[3]:
                break
    ours.close(), theirs.close()


def check_vectors(ours: Any, theirs: Any, steps: int) -> None:
    """Plays the same actions in both vector environments, and resets finished rows if they do not reset themselves."""
    assert ours.single_observation_space == theirs.single_observation_space
    assert ours.observation_space == theirs.observation_space
    check_results("reset", ours.reset(seed=3), theirs.reset(seed=3))
    ended = np.zeros(ours.num_envs, bool)
    for t, actions in enumerate(actions_of(ours.action_space, steps, 4)):
        if theirs.metadata["autoreset_mode"] == AutoresetMode.DISABLED and ended.any():
            mask = {"reset_mask": ended}
            check_results(f"reset {t}", ours.reset(options=dict(mask)), theirs.reset(options=dict(mask)))
        step = theirs.step(actions)
        check_results(f"step {t}", ours.step(actions), step)
        ended = step[2] | step[3]
    ours.close(), theirs.close()


@pytest.mark.parametrize("options", [{}, {"num_threads": 2}, {"lanes": 0}], ids=["one", "threads", "alone"])
@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("id", ["HalfCheetah-v5", "Hopper-v4", "Humanoid-v5"])
def test_vector(id: str, mode: AutoresetMode, options: dict[str, Any]) -> None:
    """Rows whose episodes end at different times: final_obs, and observations of new episodes."""
    rows, case = 9, {"history": 3, "time_aware": True, "rescale_actions": (-1, 1), "clip_actions": True}
    ours = mjenv.make_vec(id, rows, autoreset_mode=mode, max_episode_steps=13, **options, **case)

    def one() -> Any:
        env = ClipAction(RescaleAction(gymnasium.make(id, max_episode_steps=13), -1, 1))
        return FrameStackObservation(TimeAwareObservation(env, normalize_time=True), 3)

    check_vectors(ours, SyncVectorEnv([one] * rows, autoreset_mode=mode), steps=60)


def test_terms() -> None:
    """A history of single terms is what FrameStackObservation stacks, term by term."""
    lengths = {"qpos": 2, "cvel": 3, "time": 4}
    text = " ".join(f"{name}={length}" for name, length in lengths.items())
    ours = mjenv.make("Humanoid-v5", history=text, time_aware=True, max_episode_steps=12)
    theirs = FrameStackObservation(
        TimeAwareObservation(gymnasium.make("Humanoid-v5", max_episode_steps=12), normalize_time=True), 4
    )
    counts = {f.name: f.count for f in mjenv.make("Humanoid-v5").fields("observation")} | {"time": 1}

    def by_terms(frames: Array) -> Array:
        parts, start = [], 0
        for name, count in counts.items():
            parts.append(frames[-lengths.get(name, 1) :, start : start + count].reshape(-1))
            start += count
        return np.concatenate(parts)

    fields = {field.name: field for field in ours.fields("observation")}
    assert {name: fields[name].shape for name in ("qpos", "qvel", "cvel", "time")} == {
        "qpos": (2, counts["qpos"]),
        "qvel": (counts["qvel"],),
        "cvel": (3, counts["cvel"]),
        "time": (4, 1),
    }
    assert ours.observation_space.shape == (sum(field.count for field in fields.values()),)
    time = fields["time"]
    assert ours.observation_space.high[time.offset : time.offset + time.count].tolist() == [1] * 4
    assert np.isinf(np.delete(ours.observation_space.high, np.arange(time.offset, time.offset + time.count))).all()
    for seed in (0, None):
        obs, frames = ours.reset(seed=seed)[0], theirs.reset(seed=seed)[0]
        check_same("reset", obs, by_terms(frames))
        for action in actions_of(ours.action_space, 8, 1):
            check_same("step", ours.step(action)[0], by_terms(theirs.step(action)[0]))


def test_fields_of_frames() -> None:
    """The fields of stacked observations name each part of each frame, where it stands."""
    env = mjenv.make("HalfCheetah-v5", history=3, time_aware=True)
    obs = env.reset(seed=1)[0]
    for action in actions_of(env.action_space, 3, 1):
        obs = env.step(action)[0]
    fields = {field.name: field for field in env.fields("observation")}
    assert list(fields) == [
        *("qpos[-2]", "qvel[-2]", "time[-2]", "qpos[-1]", "qvel[-1]", "time[-1]", "qpos", "qvel", "time")
    ]
    parts = {name: obs.reshape(-1)[f.offset : f.offset + f.count] for name, f in fields.items()}
    check_same("qpos", parts["qpos"], np.array(env.data.qpos[1:]))
    times = np.concatenate([parts[name] for name in ("time[-2]", "time[-1]", "time")])
    check_same("time", times, (np.array([1, 2, 3]) / 1000).astype(np.float32).astype(np.float64))


def test_float32() -> None:
    """Observations of float32 are those of float64, rounded."""
    options = {"history": 3, "time_aware": True}
    wide, narrow = (mjenv.make_vec("Ant-v5", 4, dtype=d, **options) for d in (np.float64, np.float32))
    check_same("reset", narrow.reset(seed=1)[0], wide.reset(seed=1)[0].astype(np.float32))
    for actions in actions_of(wide.action_space, 6, 1):
        check_same("step", narrow.step(actions)[0], wide.step(actions)[0].astype(np.float32))


@pytest.mark.parametrize("options", [{"history": 3}, {"history": "qvel=3", "time_aware": True}], ids=str)
def test_images_and_copies(options: dict[str, Any]) -> None:
    """The older observations are part of a row."""
    options = {"max_episode_steps": 20, "num_threads": 1, **options}
    first, other = (mjenv.make_vec("Walker2d-v5", 9, **options) for _ in range(2))
    first.reset(seed=1), other.reset(seed=50)
    actions = actions_of(first.action_space, 40, 2)
    for t in range(7):
        obs = first.step(actions[t])[0]
    image = first.snapshot()
    copied = pickle.loads(pickle.dumps(first))
    other.restore(image)
    check_same("observe", other.observe(), obs)
    check_same("observe", copied.observe(), obs)
    for t in range(7, 40):
        want = first.step(actions[t])
        check_same("restored", other.step(actions[t]), want)
        check_same("pickled", copied.step(actions[t]), want)
    one = first.snapshot(4)
    mask = np.arange(9) % 2 == 1
    first.copy_row(4, mask)
    other.restore(one, 7)
    seen = first.observe()
    for row in (*np.flatnonzero(mask), 4):
        check_same("copy", seen[row], want[0][4])
    same = np.broadcast_to(actions[0][4], actions[0].shape).copy()
    stepped = first.step(same)[0]
    check_same("copies", stepped[mask], np.repeat(stepped[4:5], mask.sum(), 0))
    check_same("image of a row", other.step(same)[0][7], stepped[4])


def test_set_state() -> None:
    """Gymnasium's wrapper does not see set_state: the frame of the state before it stays in the history."""
    ours, theirs = pair("HalfCheetah-v5", {"history": 3}, lambda env: FrameStackObservation(env, 3), 50)
    ours.reset(seed=2), theirs.reset(seed=2)
    actions = actions_of(ours.action_space, 20, 3)
    for action in actions[:4]:
        frames = ours.step(action)[0]
        check_same("step", frames, theirs.step(action)[0])
    qpos, qvel = ours.data.qpos + 0.01, ours.data.qvel * 0.5
    ours.set_state(qpos, qvel), theirs.unwrapped.set_state(qpos, qvel)
    vector = mjenv.make_vec("HalfCheetah-v5", 1, history=3, max_episode_steps=50)
    vector.reset(seed=2)
    for action in actions[:4]:
        vector.step(action[None])
    vector.set_state(qpos[None], qvel[None])
    check_same("observe", vector.observe()[0], np.stack([frames[0], frames[1], theirs.unwrapped._get_obs()]))
    for action in actions[4:]:
        want = theirs.step(action)
        check_same("step", ours.step(action), want)
        check_same("step", vector.step(action[None])[0][0], want[0])


def test_rollout() -> None:
    """A rollout stacks as steps do, and observations repeat after an episode's end."""
    envs, steps = mjenv.make_vec("Hopper-v5", 5, history=3, time_aware=True, max_episode_steps=20), 30
    envs.reset(seed=1)
    actions = actions_of(envs.single_action_space, 5 * steps, 3).reshape(5, steps, -1)
    image = envs.snapshot()
    obs = envs.rollout(actions, observations=True)[3]
    last = envs.observe()
    envs.restore(image)
    envs.rollout(actions)
    check_same("without observations", envs.observe(), last)
    check_same("the last", obs[:, -1], last)
    theirs = [
        FrameStackObservation(
            TimeAwareObservation(gymnasium.make("Hopper-v5", max_episode_steps=20), normalize_time=True), 3
        )
        for _ in range(5)
    ]
    for row, env in enumerate(theirs):
        env.reset(seed=1 + row)
        for t in range(steps):
            want = env.step(actions[row, t])
            check_same(f"row {row}, step {t}", obs[row, t], want[0])
            if want[2] or want[3]:
                check_same("afterwards", obs[row, t:], np.repeat(want[0][None], steps - t, 0))
                break


def test_send_and_receive() -> None:
    """What recv reports equals what step returns."""
    options = {"history": 2, "rescale_actions": (-1.0, 1.0), "max_episode_steps": 11, "autoreset_mode": "SameStep"}
    envs, sent = (mjenv.make_vec("Ant-v4", 6, num_threads=2, **options) for _ in range(2))
    check_same("reset", sent.reset(seed=1), envs.reset(seed=1))
    for actions in actions_of(envs.action_space, 25, 1):
        want = envs.step(actions)
        sent.send(actions)
        rows, *got = sent.recv()
        assert rows.tolist() == list(range(6))
        check_results("recv", tuple(got), want)


def test_noise_comes_before_the_history() -> None:
    """The frames of a history have the noise and the delay with which each was seen first; the time has none."""
    noise, delay, push = (
        Noise(action=0.1, observation=0.05),
        Delay(action=2, observation=1),
        [Push("torso", every=(2, 4))],
    )
    case: dict[str, Any] = {"history": 3, "time_aware": True, "rescale_actions": (-1, 1), "clip_actions": True}
    ours = mjenv.make("Ant-v5", noise=noise, delay=delay, push=push, max_episode_steps=20, **case)
    perturbed = Perturbed(gymnasium.make("Ant-v5", max_episode_steps=20), None, noise, delay, push)
    theirs = FrameStackObservation(
        TimeAwareObservation(ClipAction(RescaleAction(perturbed, -1, 1)), normalize_time=True), 3
    )
    for seed in (4, None):
        check_same("reset", ours.reset(seed=seed), theirs.reset(seed=seed))
        for t, action in enumerate(actions_of(ours.action_space, 15, 1)):
            check_same(f"step {t}", ours.step(action), theirs.step(action))


def test_infinite_actions() -> None:
    """ClipAction makes infinity the bound. NaN stays, and is refused."""
    ours, theirs = pair("Hopper-v5", {"clip_actions": True}, ClipAction)
    ours.reset(seed=1), theirs.reset(seed=1)
    action = np.array([np.inf, -np.inf, 0.5], np.float32)
    check_same("step", ours.step(action), theirs.step(action))
    with pytest.raises(mjenv.InvalidValueError, match=r"action\[1\] is nan, but must be finite"):
        ours.step(np.array([0, np.nan, 0], np.float32))


MODEL = '<mujoco><worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody><actuator>{}</actuator></mujoco>'


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("actuators", [1, 3])
def test_zeros_at_bounds(actuators: int, dtype: Any) -> None:
    """Where an action equals a bound, NumPy returns the bound: 0 for -0."""
    motors = "".join('<motor joint="j" ctrllimited="true" ctrlrange="0 1"/>' for _ in range(actuators))
    model = MODEL.format(motors)
    env = mjenv.make("Model-v0", xml_string=model, clip_actions=True, max_episode_steps=100)
    env.reset(seed=0)
    for action in ([-0.0] * actuators, [1.0] * actuators, [-1.0] * actuators, [0.25] * actuators):
        given = np.array(action, dtype)
        env.step(given)
        want = np.clip(given, np.zeros(actuators, np.float32), np.ones(actuators, np.float32))
        check_same("ctrl", np.array(env.data.ctrl), want.astype(np.float64))


@pytest.mark.parametrize(
    ("options", "error", "match"),
    [
        ({"history": -1}, mjenv.InvalidValueError, "history"),
        ({"history": "qpos"}, mjenv.InvalidValueError, 'history": "qpos" is not TERM=COUNT'),
        ({"history": "qpos=0"}, mjenv.InvalidValueError, '"qpos=0" is not TERM=COUNT'),
        ({"history": "qpos=99999999999"}, mjenv.InvalidValueError, '"qpos=99999999999" is not'),
        ({"history": "qpos=2 qpos=3"}, mjenv.InvalidValueError, '"qpos" is named twice'),
        ({"history": "speed=2"}, mjenv.UnknownNameError, 'no term or group "speed"; there are qpos, qvel'),
        ({"history": "time=2"}, mjenv.UnknownNameError, 'no term or group "time"'),
        ({"history": 2.5}, mjenv.OptionError, "a str or an int"),
        ({"history": 2, "history_padding": "last"}, mjenv.InvalidValueError, "reset, zero"),
        ({"time_aware": True, "max_episode_steps": -1}, mjenv.InvalidValueError, "max_episode_steps is 0"),
        ({"time_aware": True, "normalize_time": False, "max_episode_steps": 2**31}, mjenv.InvalidValueError, "int32"),
        ({"rescale_actions": (1.0, -1.0)}, mjenv.InvalidValueError, "lowest action below the highest"),
        ({"rescale_actions": (-math.inf, 1.0)}, mjenv.InvalidValueError, "finite"),
        ({"rescale_actions": 1.0}, mjenv.OptionError, "2 floats"),
    ],
)
def test_refusals(options: dict[str, Any], error: type[Exception], match: str) -> None:
    with pytest.raises(error, match=match):
        mjenv.make("Hopper-v5", **options)


@pytest.mark.parametrize("history", [2**31 - 1, "qvel=2147483647"])
@pytest.mark.parametrize("rows", [1, 1 << 20])
def test_history_beyond_memory(history: Any, rows: int) -> None:
    with pytest.raises(MemoryError, match='option "history"'):
        mjenv.make_vec("Humanoid-v5", rows, history=history)


def test_actuators_without_bounds() -> None:
    model = MODEL.format('<motor name="free" joint="j" ctrllimited="false"/>')
    env = mjenv.make("Model-v0", xml_string=model, clip_actions=True)
    env.reset(seed=0)
    env.step(np.array([3.0]))
    low, high = mjenv.make("Model-v0", xml_string=model).action_space.low, env.action_space.high
    assert env.data.ctrl[0] == np.clip(3.0, low, -low)[0]
    assert high[0] == np.inf
    # In Gymnasium, such an actuator has the bounds 0 and 0, and RescaleAction divides by 0. Here it has none.
    with pytest.raises(mjenv.ModelError, match="the bounds -inf and inf, to which no action can be rescaled"):
        mjenv.make("Model-v0", xml_string=model, rescale_actions=(-1, 1))


def test_images_of_other_options_are_refused() -> None:
    image = mjenv.make_vec("Hopper-v5", 1, history=3).snapshot()
    with pytest.raises(mjenv.SnapshotError, match="other options"):
        mjenv.make_vec("Hopper-v5", 1, history=2).restore(image)


def test_transformed_observations_compose() -> None:
    """Gymnasium's own wrappers take the stacked space."""
    env = TransformObservation(mjenv.make("Hopper-v5", history=3), lambda obs: obs[-1], None)
    plain = mjenv.make("Hopper-v5")
    check_same("newest", env.reset(seed=1)[0], plain.reset(seed=1)[0])
