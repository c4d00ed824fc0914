"""Every byte of a picture equals Gymnasium's, drawn by the same OpenGL."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from library import LIBRARY, Env, Picture, Renderer

IDS = [LIBRARY.mjenv_id_at(i).decode() for i in range(LIBRARY.mjenv_id_count())]
ODD, DEFAULT = (157, 93), (480, 480)
MOMENTS = (0, 1, 10, 100)
FREE = -1

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

# Where NumPy 2 reads the cameras of MuJoCo 2.2.2, Gymnasium's own pictures are wrong.
assert np.__version__.startswith("1.") or mujoco.__version__ != "2.2.2"


def reference(id: str, size: tuple[int, int] = ODD, **options: Any) -> gymnasium.Env:
    return gymnasium.make(
        id, render_mode="rgbd_tuple", width=size[0], height=size[1], disable_env_checker=True, **options
    )


def assert_equal(picture: Picture, expected: Picture, what: str) -> None:
    for part, array, wanted in zip(("rgb", "depth"), picture, expected, strict=True):
        assert (array.dtype, array.shape) == (wanted.dtype, wanted.shape)
        different = int((array != wanted).sum())
        assert different == 0, f"{what}: {different} of {array.size} numbers of {part} differ"


def cameras(id: str, long: bool) -> list[int | None]:
    """None: the one that is chosen by default, which is the free one."""
    with closing(gymnasium.make(id)) as env:
        return [None, *([FREE] if long else []), *range(env.unwrapped.model.ncam)]


@contextmanager
def pair(id: str, size: tuple[int, int], seed: int, camera: int | None) -> Iterator[tuple[Any, Env, Renderer]]:
    theirs, ours = reference(id, size, camera_id=camera), Env(id, strict=0)
    theirs.reset(seed=seed)
    theirs.action_space.seed(seed)
    ours.reset(seed)
    settings = {} if camera is None else {"camera": camera}
    with closing(theirs), closing(ours), closing(Renderer(ours, *size, **settings)) as renderer:
        yield theirs, ours, renderer


def step_both(theirs: Any, ours: Env) -> None:
    action = theirs.action_space.sample()
    theirs.unwrapped.step(action)
    ours.step(action)


def compare(id: str, size: tuple[int, int], camera: int | None, moments: tuple[int, ...]) -> None:
    with pair(id, size, 3, camera) as (theirs, ours, renderer):
        for t in range(moments[-1] + 1):
            if t:
                step_both(theirs, ours)
            if t in moments:
                assert_equal(renderer.render(), theirs.render(), f"{id}, camera {camera}, {size}, step {t}")


@pytest.mark.parametrize("id", IDS)
def test_after_reset_and_steps(id: str, long: bool) -> None:
    for camera in cameras(id, long):
        compare(id, ODD, camera, MOMENTS)
        if long or camera is None:
            compare(id, DEFAULT, camera, MOMENTS if long else MOMENTS[:2])


@pytest.mark.parametrize("id", ["Ant-v5", "Reacher-v4"])
def test_first_picture_late(id: str) -> None:
    """The free camera is placed when the first picture is drawn."""
    compare(id, ODD, FREE, (37, 40))


def test_modes() -> None:
    """rgb_array and depth_array are the parts of rgbd_tuple."""
    ours = Env("Hopper-v5")
    ours.reset(1)
    with closing(ours), closing(Renderer(ours, *ODD)) as renderer:
        for mode, part in (("rgb_array", 0), ("depth_array", 1)):
            env = gymnasium.make("Hopper-v5", render_mode=mode, width=ODD[0], height=ODD[1])
            env.reset(seed=1)
            assert np.array_equal(renderer.render()[part], env.render())
            env.close()


def test_visual_options(long: bool) -> None:
    flags = range(23) if long else (1, 2, 4, 10, 14, 15, 16, 17, 21)  # of mjenv_visual
    defaults = mujoco.MjvOption().flags
    # MuJoCo 3 inserted a flag.
    inserted = int(getattr(mujoco.mjtVisFlag, "mjVIS_ISLAND", mujoco.mjtVisFlag.mjNVISFLAG))
    ours = Env("Ant-v4")
    with closing(ours):
        for flag in flags:
            of_mujoco = flag + (flag >= inserted)
            point = int(mujoco.mjtVisFlag.mjVIS_CONTACTPOINT)
            options = {flag: not defaults[of_mujoco], point: True}
            theirs = reference("Ant-v4", visual_options={of_mujoco: options[flag], point: True})
            theirs.reset(seed=2)
            theirs.action_space.seed(2)
            ours.reset(2)
            for _ in range(30):
                step_both(theirs, ours)
            with closing(theirs), closing(Renderer(ours, *ODD, visual_options=options)) as renderer:
                assert_equal(renderer.render(), theirs.render(), f"flag {flag}")


@pytest.mark.parametrize(
    ("given", "settings"),
    [
        ({"camera_name": "track"}, {"camera_name": b"track"}),
        ({"max_geom": 9}, {"max_geom": 9}),
        ({"max_geom": 0}, {"max_geom": 0}),
        (
            {"camera_id": FREE, "default_camera_config": {"lookat": np.array((0.1, 0.2, 1.0)), "azimuth": 30.0}},
            {"camera": FREE, "lookat": (0.1, 0.2, 1.0), "azimuth": 30.0, "distance": np.nan, "elevation": np.nan},
        ),
        (
            {"camera_id": FREE, "default_camera_config": {"distance": 7.0, "elevation": -80.0}},
            {"camera": FREE, "lookat": (np.nan,) * 3, "distance": 7.0, "elevation": -80.0},
        ),
    ],
)
def test_settings(given: dict[str, Any], settings: dict[str, Any]) -> None:
    theirs, ours = reference("Walker2d-v5", **given), Env("Walker2d-v5")
    theirs.reset(seed=2)
    ours.reset(2)
    with closing(theirs), closing(ours), closing(Renderer(ours, *ODD, **settings)) as renderer:
        assert_equal(renderer.render(), theirs.render(), str(given))


def test_set_state() -> None:
    """A state that is set is drawn; Gymnasium then has its derived arrays afresh."""
    with pair("Hopper-v4", ODD, 4, None) as (theirs, ours, renderer):
        step_both(theirs, ours)
        qpos, qvel = np.array([0.3, 1.4, 0.1, -0.4, -0.2, 0.3]), np.full(6, 0.5)
        theirs.unwrapped.set_state(qpos, qvel)
        ours.set_state(qpos, qvel)
        assert_equal(renderer.render(), theirs.render(), "after set_state")
        step_both(theirs, ours)
        assert_equal(renderer.render(), theirs.render(), "and a step")


def test_rows() -> None:
    """A row's picture does not depend on the rows that its thread has stepped since."""
    rows, ours = 5, Env("Hopper-v5", 5)  # whose free camera does not look at what the renderer sees first
    ours.reset(20)
    theirs = [reference("Hopper-v5") for _ in range(rows)]
    for row, env in enumerate(theirs):
        env.reset(seed=20 + row)
        env.action_space.seed(row)
    for _ in range(3):
        actions = [env.action_space.sample() for env in theirs]
        ours.step(np.concatenate(actions))
        for env, action in zip(theirs, actions, strict=True):
            env.step(action)
    with closing(ours), closing(Renderer(ours, *ODD)) as renderer:
        for row, env in enumerate(theirs):
            picture = renderer.render(row)
            assert_equal(picture, env.render(), f"row {row}")
            assert_equal(renderer.render(row), picture, f"row {row} again")
            env.close()


def test_no_drift(long: bool) -> None:
    """The last picture of many is as equal as the first, and the first can be drawn again."""
    count = 1000 if long else 50
    with pair("Humanoid-v5", ODD, 5, None) as (theirs, ours, renderer):
        first = renderer.render()
        for t in range(count):
            step_both(theirs, ours)
            picture = renderer.render()
            if t >= count - 3:
                assert_equal(picture, theirs.render(), f"picture {t}")
        ours.reset(5)
        assert_equal(renderer.render(), first, "the first again")
