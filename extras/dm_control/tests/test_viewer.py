"""dm_control's own viewer on mjenv's environments: the same states and pictures as on dm_control's."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from display import virtual_display
from dm_control import suite as theirs
from dm_control.viewer import application, gui, user_input, util
from numpy.typing import NDArray
from test_suite import assert_same_step

from conftest import flat
from mjenv_dm_control import suite as ours

WIDTH, HEIGHT = 160, 120
PERIOD = 1 / 30  # s
PATIENCE = 300.0  # s


class Clock:
    """The module `time` of the viewer, which passes by PERIOD with each frame."""

    def __init__(self) -> None:
        self.now = 0.0

    def time(self) -> float:
        return self.now


@dataclass
class Mouse:
    position: NDArray[np.int64] = field(default_factory=lambda: np.zeros(2, np.int64))
    on_move: util.QuietSet = field(default_factory=util.QuietSet)
    on_click: util.QuietSet = field(default_factory=util.QuietSet)
    on_double_click: util.QuietSet = field(default_factory=util.QuietSet)
    on_scroll: util.QuietSet = field(default_factory=util.QuietSet)


@dataclass
class Keyboard:
    on_key: util.QuietSet = field(default_factory=util.QuietSet)


def tell(receivers: util.QuietSet, *event: Any) -> None:
    for receiver in list(receivers):
        receiver(*event)


@dataclass
class Frame:
    """What the user sees, and the state of the simulation."""

    pixels: NDArray[np.uint8]
    time: float
    state: NDArray[np.float64]
    qacc_warmstart: NDArray[np.float64]
    xpos: NDArray[np.float64]
    cvel: NDArray[np.float64]
    selected: int
    camera: str


class User:
    """A window without a screen, and the hands of its user."""

    shape = (WIDTH, HEIGHT)

    def __init__(self, clock: Clock, plays: Callable[[User], Iterator[Any]]) -> None:
        self.clock, self.plays = clock, plays
        self.mouse, self.keyboard = Mouse(), Keyboard()
        self.app: Any = None
        self.frames: list[Frame] = []

    def event_loop(self, tick_func: Callable[[], NDArray[np.uint8]]) -> None:
        """Shows frames. After each, the user does something."""
        for _ in self.plays(self):
            self.clock.now += PERIOD
            pixels = tick_func().copy()
            physics, camera = self.app._environment.physics, self.app._viewer.camera
            of_data = (np.array(getattr(physics.data, name)) for name in ("qacc_warmstart", "xpos", "cvel"))
            frame = Frame(pixels, physics.time(), physics.state(), *of_data, self.selected, camera.name)
            self.frames.append(frame)

    def close(self) -> None:
        pass

    @property
    def selected(self) -> int:
        return self.app._viewer._manipulator.selected_body_id

    def press(self, key: int, modifiers: int = 0) -> None:
        tell(self.keyboard.on_key, key, user_input.PRESS, modifiers)
        tell(self.keyboard.on_key, key, user_input.RELEASE, modifiers)

    def select(self, body: int) -> None:
        """Double-clicks on a body."""
        camera, viewport = self.app._viewer.camera, self.app._viewport
        pixels = [np.array([x, y]) for x in range(0, WIDTH, 4) for y in range(0, HEIGHT, 4)]
        self.mouse.position = next(p for p in pixels if camera.raycast(viewport, p)[0] == body)
        tell(self.mouse.on_double_click, user_input.MOUSE_BUTTON_LEFT, 0)
        assert self.selected == body

    def drag(self, button: int, modifiers: int, x: int, y: int, frames: int = 4) -> Iterator[None]:
        tell(self.mouse.on_click, button, user_input.PRESS, modifiers)
        for _ in range(frames):
            step = np.array([x, y])
            self.mouse.position = self.mouse.position + step
            tell(self.mouse.on_move, self.mouse.position, step)
            yield
        tell(self.mouse.on_click, button, user_input.RELEASE, modifiers)
        yield


class Policy:
    """Random actions, from the beginning again after each restart."""

    def __init__(self, env: Any) -> None:
        self.spec, self.random = env.action_spec(), np.random.RandomState(1)
        self.timesteps: list[Any] = []

    def reset(self) -> None:
        self.random = np.random.RandomState(2)

    def __call__(self, timestep: Any) -> NDArray[np.float64]:
        self.timesteps.append(timestep)
        low, high = np.maximum(self.spec.minimum, -1), np.minimum(self.spec.maximum, 1)
        return self.random.uniform(low, high)


def watch(
    monkeypatch: pytest.MonkeyPatch, env: Any, plays: Callable[[User], Iterator[Any]]
) -> tuple[list[Frame], list[Any]]:
    """The frames that a user sees in dm_control's viewer, and the timesteps that the policy sees."""
    clock = Clock()
    user, policy = User(clock, plays), Policy(env)
    monkeypatch.setattr(util, "time", clock)
    monkeypatch.setattr(gui, "RenderWindow", lambda *_: user)
    user.app = application.Application(width=WIDTH, height=HEIGHT)
    user.app.launch(env, policy)
    user.app._renderer.release()
    return user.frames, policy.timesteps


def watch_both(
    monkeypatch: pytest.MonkeyPatch, task: tuple[str, str], plays: Callable[[User], Iterator[Any]], **kwargs: Any
) -> list[Frame]:
    """The frames, which are the same on both environments, as is what the policies see."""
    (got, mine), (want, wanted) = (
        watch(monkeypatch, suite.load(*task, {"random": 3}, **kwargs), plays) for suite in (ours, theirs)
    )
    for number, (frame, other) in enumerate(zip(got, want, strict=True)):
        for name, value in vars(frame).items():
            np.testing.assert_array_equal(value, getattr(other, name), f"{name} of frame {number}")
    assert len(mine) == len(wanted) > 0
    for timestep, other in zip(mine, wanted, strict=True):
        assert_same_step(timestep, other)
    return got


def use_everything(user: User) -> Iterator[Any]:
    left, right = user_input.MOUSE_BUTTON_LEFT, user_input.MOUSE_BUTTON_RIGHT
    ctrl, ctrl_shift = user_input.MOD_CONTROL, user_input.MOD_SHIFT_CONTROL
    yield from range(2)  # the viewer begins with a pause
    user.press(user_input.KEY_SPACE)
    yield from range(3)
    user.select(body=1)
    yield from user.drag(right, ctrl, 10, -25)
    yield from user.drag(left, ctrl, 30, 10)
    user.press(user_input.KEY_SPACE)
    yield
    # While the viewer pauses, the mouse moves a free body itself.
    yield from user.drag(right, ctrl_shift, 8, 12)
    yield from user.drag(left, ctrl, 10, 10)
    for _ in range(2):
        user.press(user_input.KEY_RIGHT)  # a single step
        yield
    user.press(user_input.KEY_RIGHT_BRACKET)  # the next camera
    user.press(user_input.KEY_F7)  # labels
    user.press(user_input.KEY_F6)  # frames
    yield
    user.press(user_input.KEY_SPACE)
    user.press(user_input.KEY_LEFT_BRACKET)
    tell(user.mouse.on_double_click, right, ctrl)  # the camera follows the body
    user.press(user_input.KEY_EQUAL)  # twice as fast
    yield from range(3)
    user.press(user_input.KEY_BACKSPACE)  # the next episode
    yield from range(3)


def test_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    frames = watch_both(monkeypatch, ("humanoid", "walk"), use_everything)
    times = [frame.time for frame in frames]
    assert times[0] == times[1] == 0 < times[2]
    moved = [
        frame for before, frame in pairwise(frames) if frame.time == before.time and (frame.state != before.state).any()
    ]
    assert len(moved) >= 8, "the mouse has moved a body during the pause"
    assert {frame.camera for frame in frames} == {"Free", "back", 'Tracking body "torso"'}
    assert {frame.selected for frame in frames} == {-1, 1}
    assert any(after < before for before, after in pairwise(times)), "an episode has begun again"
    assert len({frame.pixels.tobytes() for frame in frames}) > len(frames) / 2


def watch_two_episodes(user: User) -> Iterator[Any]:
    user.press(user_input.KEY_SPACE)
    yield from range(3)
    user.press(user_input.KEY_BACKSPACE)
    yield from range(2)


# Models that change: resets draw the place of a target, and colours show the reward.
@pytest.mark.parametrize(
    ("task", "kwargs"),
    [
        (("reacher", "hard"), {}),
        (("cartpole", "balance"), {"visualize_reward": True}),
    ],
    ids=str,
)
def test_tasks(monkeypatch: pytest.MonkeyPatch, task: tuple[str, str], kwargs: dict[str, Any]) -> None:
    frames = watch_both(monkeypatch, task, watch_two_episodes, **kwargs)
    assert {len(np.unique(frame.pixels)) > 10 for frame in frames} == {True}


def test_the_viewer_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without pushes and pauses, the episode is the same as without the viewer. (In a pause, the viewer calls
    mj_forward, which in MuJoCo 2.2.2 changes where the solver begins in the next step.)"""
    env = theirs.load("humanoid", "walk", {"random": 3})
    _, seen = watch(monkeypatch, ours.load("humanoid", "walk", {"random": 3}), watch_two_episodes)
    policy, timestep = Policy(env), env.reset()
    episode = next(i for i, timestep in enumerate(seen[1:], 1) if timestep.first())
    for number in range(episode):
        assert_same_step(seen[number], timestep)
        timestep = env.step(policy(timestep))
    assert episode > 3


def test_errors(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """An action that is not finite ends the episode; the viewer goes on."""
    monkeypatch.setattr(Policy, "__call__", lambda *_: np.full(6, np.nan))
    for suite in (ours, theirs):
        frames, _ = watch(monkeypatch, suite.load("cheetah", "run", {"random": 3}), watch_two_episodes)
        assert len(frames) == 5
        assert capsys.readouterr().err.count("Physics state is invalid. Warning(s) raised: mjWARN_BADCTRL") == 2


def test_launch() -> None:
    """viewer.launch in a window: the same episode as without the viewer."""
    steps = 20
    script = Path(__file__).with_name("launch_viewer.py")
    with virtual_display() as name:
        environment = {**os.environ, "DISPLAY": name, "MUJOCO_GL": "glfw"}
        environment.pop("PYOPENGL_PLATFORM", None)  # dm_control sets it for EGL
        with subprocess.Popen(
            [sys.executable, script, str(steps)], env=environment, stdout=subprocess.PIPE
        ) as launched:
            try:
                press = [
                    "xdotool",
                    "search",
                    "--sync",
                    "--onlyvisible",
                    "--name",
                    "^Explorer$",
                    "windowfocus",
                    "--sync",
                ]
                subprocess.run([*press, "key", "space"], env=environment, check=True, timeout=PATIENCE)
                printed, _ = launched.communicate(timeout=PATIENCE)
            finally:
                launched.kill()
    env, random = theirs.load("cartpole", "swingup", {"random": 3}), np.random.RandomState(1)
    wanted = [env.reset()]
    while len(wanted) < steps:
        wanted.append(env.step(random.uniform(-1, 1, 1)))
    assert json.loads(printed) == [flat(timestep.observation).tolist() for timestep in wanted]
