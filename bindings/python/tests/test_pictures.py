"""render(): shapes, refusals, wrappers, ownership. Whether pictures are Gymnasium's is compared in tests/pictures."""

from __future__ import annotations

import ctypes
import os
import pickle
import sys
import threading
from pathlib import Path
from typing import Any

# Read when the first picture is drawn.
os.environ.setdefault("MUJOCO_GL", "wgl" if sys.platform == "win32" else "egl")

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import AddRenderObservation, RenderCollection

import mjenv
from systems import WINDOWS

SIZE = {"width": 61, "height": 43}


def make(mode: str | None = "rgb_array", id: str = "Hopper-v5", **keywords: Any) -> Any:
    env = mjenv.make(id, render_mode=mode, **{**SIZE, **keywords})
    env.reset(seed=3)
    return env


def test_modes() -> None:
    rgb, depth, both = (make(mode).render() for mode in ("rgb_array", "depth_array", "rgbd_tuple"))
    assert (rgb.dtype, rgb.shape) == (np.uint8, (43, 61, 3))
    assert (depth.dtype, depth.shape) == (np.float32, (43, 61))
    assert isinstance(both, tuple)
    assert np.array_equal(both[0], rgb)
    assert np.array_equal(both[1], depth)
    assert len(np.unique(rgb.reshape(-1, 3), axis=0)) > 50
    assert 0 < depth.min() < depth.max() <= 1
    assert make(width=480, height=480).render().shape == (480, 480, 3)


def test_pictures_are_fresh() -> None:
    env = make()
    first = env.render()
    kept = first.copy()
    first.flags.writeable = True  # the caller's own
    for _ in range(20):
        env.step(np.ones(3))
    later = env.render()
    assert not np.array_equal(later, kept)
    assert np.array_equal(first, kept)
    assert np.array_equal(env.render(), later)


def test_drawing_changes_nothing() -> None:
    drawn, plain = make(), make(None)
    for _ in range(30):
        drawn.render()
        for a, b in zip(drawn.step(np.full(3, 0.1)), plain.step(np.full(3, 0.1)), strict=True):
            assert np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b


def test_metadata() -> None:
    env = make()
    assert env.render_mode == "rgb_array"
    assert env.metadata["render_fps"] == 125


def test_no_mode() -> None:
    env = make(None)
    with pytest.raises(AttributeError, match=r"render_mode None.*rgbd_tuple"):
        env.render()
    assert env.step(np.zeros(3))[0].shape == (11,)


def test_before_reset_and_after_close() -> None:
    env = mjenv.make("Hopper-v5", render_mode="rgb_array")
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.render()
    env.reset()
    env.render()
    env.close()
    env.close()
    with pytest.raises(mjenv.ClosedError):
        env.render()


@pytest.mark.parametrize(
    ("keywords", "kind", "word"),
    [
        ({"width": 0}, ValueError, "width"),
        ({"height": -3}, ValueError, "height"),
        ({"width": 10**6}, ValueError, "width"),
        ({"max_geom": -1}, ValueError, "max_geom"),
        ({"camera_id": 1}, ValueError, "camera"),
        ({"camera_id": -2}, ValueError, "camera_id"),
        ({"visual_options": {99: True}}, IndexError, "99"),
        ({"visual_options": {"shadow": True}}, TypeError, "shadow"),
        ({"geomgroup": {6: True}}, IndexError, r"geomgroup has the group 6; there are 0\.\.5"),
        ({"sitegroup": {-1: True}}, IndexError, "group -1"),
        ({"skingroup": {"all": True}}, TypeError, "all"),
        ({"geomgroup": [True, True]}, ValueError, "6 bools"),
        ({"tendongroup": "111111"}, TypeError, "tendongroup"),
        ({"jointgroup": 3}, TypeError, "jointgroup"),
        ({"default_camera_config": {"zoom": 2}}, AttributeError, "zoom"),
        ({"default_camera_config": {"distance": "far"}}, TypeError, "far"),
        ({"default_camera_config": {"lookat": (1, 2)}}, ValueError, "lookat"),
        ({"default_camera_config": {"azimuth": np.nan}}, ValueError, "azimuth"),
    ],
)
def test_refused_at_the_first_picture(keywords: dict[str, Any], kind: type[Exception], word: str) -> None:
    env = make(**keywords)
    with pytest.raises(kind, match=word) as caught:
        env.render()
    assert isinstance(caught.value, mjenv.Error)
    assert env.step(np.zeros(3))[0].shape == (11,)


def test_no_opengl(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "vulkan")
    env = make()
    with pytest.raises(ValueError, match=r"vulkan.*egl"):
        env.render()
    monkeypatch.setenv("MUJOCO_GL", "wgl" if WINDOWS else "egl")
    assert env.render().shape == (43, 61, 3)


def test_no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    env = mjenv.make("Hopper-v5", render_mode="human")
    with pytest.raises(mjenv.RenderError, match="shows no windows" if WINDOWS else "glfw"):
        env.reset(seed=3)
    assert env.data.qpos.shape == (6,)


def test_fast() -> None:
    """Other pixels of the same scene."""
    fast, plain = (make(render_fast=fast).render().astype(int) for fast in (True, False))
    assert not np.array_equal(fast, plain)
    assert np.abs(fast - plain).mean() < 10
    envs = mjenv.make_vec("Hopper-v5", 1, render_mode="rgb_array", render_fast=True, **SIZE)
    envs.reset(seed=3)
    assert np.array_equal(envs.render()[0], fast)


def test_unknown_camera_name_is_the_free_camera() -> None:
    free, named = make(camera_id=-1), make(camera_name="nobody")
    assert np.array_equal(free.render(), named.render())
    assert not np.array_equal(free.render(), make(camera_name="track").render())


def test_default_camera_config_of_a_model_without_a_task() -> None:
    """Model-v0 and users' tasks take it, as Gymnasium's MujocoEnv does."""
    configs = {"distance": 3.0}, {"distance": 9.0}, {"distance": 3.0}
    envs = [make(id="Model-v0", xml_file="hopper.xml", default_camera_config=config) for config in configs]
    near, far, again = (env.render() for env in envs)
    assert np.array_equal(near, again)
    assert not np.array_equal(near, far)


def test_groups() -> None:
    """Hopper's geoms are in group 0. tests/pictures compares with what MuJoCo draws."""
    shown, hidden = make().render(), make(geomgroup={0: False}).render()
    assert not np.array_equal(shown, hidden)
    assert np.array_equal(make(geomgroup=(True,) * 6).render(), shown)
    assert np.array_equal(make(geomgroup=np.zeros(6)).render(), hidden)
    assert np.array_equal(make(geomgroup=None).render(), shown)
    assert np.array_equal(pickle.loads(pickle.dumps(make(geomgroup={0: False}))).render(), hidden)
    envs = mjenv.make_vec("Hopper-v5", 1, render_mode="rgb_array", geomgroup={0: False}, **SIZE)
    envs.reset(seed=3)
    assert np.array_equal(envs.render()[0], hidden)
    made = gymnasium.make("mjenv/Hopper-v5", render_mode="rgb_array", geomgroup={0: False}, **SIZE)
    made.reset(seed=3)
    assert np.array_equal(made.render(), hidden)


def test_pickle() -> None:
    """The copy draws the same from where it stands."""
    env = make(visual_options={14: True}, camera_id=-1)
    env.render()
    copy = pickle.loads(pickle.dumps(env))
    for _ in range(3):
        env.step(np.ones(3))
        copy.step(np.ones(3))
    assert (copy.render_mode, copy.width) == ("rgb_array", 61)
    # A free camera that looks at a given point is not moved by the state that it sees first.
    assert np.array_equal(copy.render(), env.render())


@pytest.mark.parametrize("make_env", [mjenv.make, lambda id, **keywords: gymnasium.make(f"mjenv/{id}", **keywords)])
def test_list(make_env: Any) -> None:
    env = make_env("Hopper-v5", render_mode="rgb_array_list", **SIZE)
    assert isinstance(env, RenderCollection)
    env.reset(seed=3)
    for _ in range(4):
        env.step(np.ones(3))
    frames = env.render()
    assert len(frames) == 5
    assert np.array_equal(frames[0], make().render())
    assert not np.array_equal(frames[0], frames[4])
    assert env.render() == []


def test_plug_in() -> None:
    env = gymnasium.make("mjenv/Hopper-v5", render_mode="rgbd_tuple", **SIZE)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.render()
    env.reset(seed=3)
    rgb, depth = env.render()
    assert np.array_equal(rgb, make().render())
    assert np.array_equal(depth, make("depth_array").render())


def test_pixels_as_observations() -> None:
    env = AddRenderObservation(make(), render_only=True)
    obs, _ = env.reset(seed=3)
    assert env.observation_space.contains(obs)
    assert np.array_equal(obs, make().render())
    obs = env.step(np.ones(3))[0]
    assert obs.shape == (43, 61, 3)


@pytest.mark.parametrize("id", ["HalfCheetah-v5", "Reacher-v4"])
def test_vector(id: str) -> None:
    """Each row as an environment of its own, whose free camera stays where it first looked."""
    envs = mjenv.make_vec(id, 3, render_mode="rgbd_tuple", **SIZE)
    singles = [make("rgbd_tuple", id) for _ in range(3)]
    envs.reset(seed=5)
    for row, env in enumerate(singles):
        env.reset(seed=5 + row)
    for _ in range(2):
        for shown, env in zip(envs.render(), singles, strict=True):
            for part, expected in zip(shown, env.render(), strict=True):
                assert np.array_equal(part, expected)
        actions = envs.action_space.sample()
        envs.step(actions)
        for env, action in zip(singles, actions, strict=True):
            env.step(action)
    assert envs.render_mode == "rgbd_tuple"
    assert np.array_equal(envs.call("render")[1][0], envs.render()[1][0])
    envs.send(envs.action_space.sample())
    with pytest.raises(mjenv.AlreadyPendingCallError):
        envs.render()
    envs.recv()
    envs.close()
    with pytest.raises(mjenv.ClosedError):
        envs.render()


def test_threads() -> None:
    """Environments draw at the same time on different threads."""
    envs = [make(id=id) for id in ("Hopper-v5", "Ant-v5", "Reacher-v5", "Swimmer-v4")]
    expected = [env.render() for env in envs]
    found: list[Any] = [None] * len(envs)

    def draw(index: int) -> None:
        found[index] = [envs[index].render() for _ in range(10)]

    threads = [threading.Thread(target=draw, args=(index,)) for index in range(len(envs))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for pictures, one in zip(found, expected, strict=True):
        assert all(np.array_equal(picture, one) for picture in pictures)


def resident() -> int:
    """Bytes of memory in use."""
    if sys.platform == "win32":
        counters = (ctypes.c_size_t * 9)()  # PROCESS_MEMORY_COUNTERS: two numbers of 32 bits before WorkingSetSize
        kernel = ctypes.windll.kernel32
        process = ctypes.c_void_p(kernel.GetCurrentProcess())
        assert kernel.K32GetProcessMemoryInfo(process, counters, ctypes.sizeof(counters))
        return counters[2]
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_memory_is_freed() -> None:
    def draw(times: int) -> None:
        for _ in range(times):
            env = make(id="Reacher-v5")
            env.render()
            env.close()

    draw(3)
    before = resident()
    draw(12)
    assert resident() - before < 24 << 20  # one renderer with its shadow map takes more


def test_pictures_leave_no_memory_behind() -> None:
    env = make("rgbd_tuple")
    for _ in range(20):
        env.render()
    before = resident()
    for _ in range(100):
        env.render()
    assert resident() - before < 1 << 20
