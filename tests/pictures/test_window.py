"""Tests the window on a virtual display (Xvfb), with keys and mouse simulated by xdotool."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from ctypes import byref, c_void_p, sizeof
from pathlib import Path
from typing import Any

import gymnasium
import imageio.v3 as imageio
import mujoco
import numpy as np
import pytest
from display import virtual_display
from library import LIBRARY, Env, Renderer, check
from numpy.typing import NDArray

import mjenv
from mjenv.capi import declarations

WIDTH, HEIGHT = 301, 203
PATIENCE = 60.0  # s


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as name:
        yield name


@pytest.fixture(autouse=True)
def on_display(display: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.setenv("TMPDIR", str(tmp_path))


def tell(*what: str) -> None:
    """Has xdotool press, move or click in our window."""
    subprocess.run(["xdotool", "search", "--sync", "--name", "^mjenv$", "windowfocus", "--sync", *what], check=True)


class Window:
    def __init__(self, env: Env) -> None:
        settings = declarations.mjenv_render_settings(struct_size=sizeof(declarations.mjenv_render_settings))
        check(LIBRARY.mjenv_render_defaults(env.handle, byref(settings)))
        settings.width, settings.height = WIDTH, HEIGHT
        self.handle = c_void_p()
        check(LIBRARY.mjenv_window_create(env.handle, byref(settings), byref(self.handle)))
        self.draw()

    def close(self) -> None:
        LIBRARY.mjenv_window_destroy(self.handle)

    @property
    def is_open(self) -> bool:
        return bool(LIBRARY.mjenv_window_is_open(self.handle))

    def draw(self) -> None:
        check(LIBRARY.mjenv_window_draw(self.handle, 0))

    def draw_until(self, done: Callable[[], Any]) -> None:
        draw_until(self.draw, done)

    def screenshot(self, folder: Path) -> NDArray[np.uint8]:
        return screenshot(self.draw, folder)


def draw_until(draw: Callable[[], Any], done: Callable[[], Any]) -> None:
    """Events arrive when they do."""
    end = time.monotonic() + PATIENCE
    while not done():
        assert time.monotonic() < end
        draw()
        time.sleep(0.01)


def screenshot(draw: Callable[[], Any], folder: Path) -> NDArray[np.uint8]:
    known = set(folder.glob("frame_*.png"))
    tell("key", "t")
    draw_until(draw, lambda: set(folder.glob("frame_*.png")) - known)
    (path,) = set(folder.glob("frame_*.png")) - known
    return imageio.imread(path)


def theirs_as_drawn(env: gymnasium.Env) -> NDArray[np.uint8]:
    """What Gymnasium's window shows, without its menu."""
    viewer = env.unwrapped.mujoco_renderer.viewer
    viewer.make_context_current()
    mujoco.mjr_render(viewer.viewport, viewer.scn, viewer.con)
    rgb = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    mujoco.mjr_readPixels(rgb, None, viewer.viewport, viewer.con)
    return rgb[::-1]


def play(env: gymnasium.Env) -> gymnasium.Env:
    env.reset(seed=4)
    for _ in range(3):
        env.step(np.full(3, 0.5, np.float32))
    return env


def test_picture_and_keys(tmp_path: Path) -> None:
    theirs = play(gymnasium.make("Hopper-v5", render_mode="human", width=WIDTH, height=HEIGHT))
    expected = theirs_as_drawn(theirs)
    theirs.close()
    ours = Env("Hopper-v5", strict=0)
    ours.reset(4)
    for _ in range(3):
        ours.step(np.full(3, 0.5, np.float32))

    with closing(ours), closing(Window(ours)) as window:
        with_menu = window.screenshot(tmp_path)
        assert with_menu.shape == expected.shape
        assert not np.array_equal(with_menu, expected)
        tell("key", "h")
        picture = window.screenshot(tmp_path)
        assert np.array_equal(picture, expected)

        for key in ("Tab", "c", "e", "r"):
            tell("key", key)
            assert not np.array_equal(window.screenshot(tmp_path), picture) or key == "c"  # C: there is no contact
            tell("key", key)
        assert np.array_equal(window.screenshot(tmp_path), expected)

        # Each by itself, as the press asks where the pointer is by then.
        for what in ("mousemove --window %1 100 100", "mousedown 1", "mousemove_relative 40 0"):
            tell(*what.split())
            window.screenshot(tmp_path)
        tell("mouseup", "1")
        turned = window.screenshot(tmp_path)
        assert not np.array_equal(turned, expected)
        tell("click", "4")
        assert not np.array_equal(window.screenshot(tmp_path), turned)

        tell("key", "Escape")
        window.draw_until(lambda: not window.is_open)
        window.draw()
        ours.step(np.zeros(3, np.float32))


@pytest.mark.parametrize("make", [mjenv.make, lambda id, **keywords: gymnasium.make(f"mjenv/{id}", **keywords)])
def test_render_mode_human(make: Any, tmp_path: Path) -> None:
    """Python's environments show themselves after each reset and step, until the user closes the window."""
    keywords = {"render_mode": "human", "width": WIDTH, "height": HEIGHT, "default_camera_config": {"distance": 5.0}}
    theirs = play(gymnasium.make("Hopper-v5", **keywords))
    expected = theirs_as_drawn(theirs)
    theirs.close()

    ours = play(make("Hopper-v5", **keywords))
    tell("key", "h")
    assert ours.render() is None
    assert np.array_equal(screenshot(ours.render, tmp_path), expected)
    for show in (ours.reset, lambda: ours.step(np.zeros(3, np.float32))):
        known = len(list(tmp_path.glob("frame_*.png")))
        tell("key", "t")
        draw_until(show, lambda: len(list(tmp_path.glob("frame_*.png"))) > known)  # noqa: B023 called at once
    tell("key", "Escape")
    draw_until(ours.render, lambda: not windows())
    assert ours.step(np.zeros(3, np.float32))[0].shape == (11,)
    ours.close()


def windows() -> list[str]:
    """The visible windows of this process."""
    found = subprocess.run(
        ["xdotool", "search", "--onlyvisible", "--name", "^mjenv$"], stdout=subprocess.PIPE, text=True, check=False
    )
    return found.stdout.split()


def test_render_mode_human_of_many() -> None:
    """Each row has a window."""
    envs = mjenv.make_vec("Reacher-v5", 2, render_mode="human", width=WIDTH, height=HEIGHT)
    envs.reset(seed=1)
    assert len(windows()) == 2
    envs.step(envs.action_space.sample())
    assert envs.render() == (None, None)
    envs.send(envs.action_space.sample())
    envs.recv()
    envs.close()
    assert not windows()


def test_pause() -> None:
    """Drawing does not return in a pause, but for one step at a time."""
    ours = Env("Reacher-v5", strict=0)
    ours.reset(0)
    with closing(ours), closing(Window(ours)) as window:
        tell("key", "space")
        returned: list[float] = []

        def press_later(key: str) -> threading.Thread:
            def press() -> None:
                time.sleep(1)
                returned.append(time.monotonic())
                tell("key", key)

            thread = threading.Thread(target=press)
            thread.start()
            return thread

        keys = press_later("Right")
        end = time.monotonic() + PATIENCE
        while not returned or time.monotonic() < returned[0]:
            assert time.monotonic() < end
            window.draw()
        keys.join()
        keys = press_later("space")
        window.draw()
        assert len(returned) == 2
        keys.join()
        window.draw()


def test_several_windows_and_an_end_of_the_environment() -> None:
    first, second = Env("Reacher-v5"), Env("Swimmer-v5")
    first.reset(0)
    second.reset(0)
    with closing(second), closing(Window(first)) as one, closing(Window(second)) as other:
        for _ in range(3):
            one.draw()
            other.draw()
        first.close()
        with pytest.raises(RuntimeError, match=r"E_ARGUMENT.*destroyed"):
            one.draw()
        other.draw()


@pytest.mark.parametrize(("width", "height"), [(0, 5), (5, -1), (16385, 5)])
def test_sizes_refused(width: int, height: int) -> None:
    env = Env("Reacher-v5")
    settings = declarations.mjenv_render_settings(struct_size=sizeof(declarations.mjenv_render_settings))
    check(LIBRARY.mjenv_render_defaults(env.handle, byref(settings)))
    settings.width, settings.height = width, height
    with closing(env), pytest.raises(RuntimeError, match=r"E_VALUE: (width|height) is"):
        check(LIBRARY.mjenv_window_create(env.handle, byref(settings), byref(c_void_p())))


def test_screenshot_without_a_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    env = Env("Reacher-v5")
    env.reset(0)
    with closing(env), closing(Window(env)) as window:
        monkeypatch.setenv("TMPDIR", "/nowhere")
        tell("key", "t")
        with pytest.raises(RuntimeError, match=r'E_RENDER: .*TMPDIR is "/nowhere"'):
            window.draw_until(lambda: False)
        window.draw()


def test_pictures_of_an_invisible_window() -> None:
    """Equal to those without a display, of any size that OpenGL draws."""
    env = Env("Hopper-v5")
    env.reset(4)
    with closing(env):
        for width, height in ((WIDTH, HEIGHT), (1500, 1100)):
            with (
                closing(Renderer(env, width, height, gl=declarations.Gl.GLFW)) as ours,
                closing(Renderer(env, width, height, gl=declarations.Gl.EGL)) as other,
            ):
                for mine, theirs in zip(ours.render(), other.render(), strict=True):
                    assert np.array_equal(mine, theirs)


@pytest.mark.parametrize(("width", "height"), [(65535, 5), (65536, 5), (5, 65536), (65536, 65536)])
def test_sizes_refused_of_an_invisible_window(width: int, height: int) -> None:
    env = Env("Reacher-v5")
    with closing(env), pytest.raises(RuntimeError, match=r"E_VALUE: .* more than .* this OpenGL draws \(glfw,"):
        Renderer(env, width, height, gl=declarations.Gl.GLFW)
