"""physics.render equals dm_control's pixel for pixel, drawn by the same OpenGL."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from dm_control import suite as theirs
from dm_control.mujoco.wrapper import MjvOption
from dm_control.suite.wrappers import pixels
from test_suite import assert_same_step, pair

from mjenv_dm_control import suite as ours

SIZE = {"height": 60, "width": 84}


def assert_same_picture(got: Any, want: Any, **arguments: Any) -> None:
    mine, wanted = (env.physics.render(**arguments) for env in (got, want))
    assert (mine.shape, mine.dtype) == (wanted.shape, wanted.dtype)
    assert (mine != wanted).sum() == 0, f"{arguments}: {(mine != wanted).sum()} of {mine.size} numbers differ"
    assert len(np.unique(mine)) > 2


def test_tasks(drawn_task: tuple[str, str]) -> None:
    envs = pair(drawn_task, 4)
    assert_same_picture(*envs, **SIZE)
    assert_same_picture(*envs, **SIZE, camera_id=0)
    assert_same_picture(*envs, **SIZE, depth=True)
    assert_same_picture(*envs, **SIZE, segmentation=True)
    for env in envs:
        env.reset()
    assert_same_picture(*envs)


def options(**changes: Any) -> MjvOption:
    """dm_control's options of a scene with changes: {index: value} of an array, or a number."""
    option = MjvOption()
    for name, value in changes.items():
        if isinstance(value, dict):
            for index, shown in value.items():
                getattr(option, name)[index] = shown
        else:
            setattr(option, name, value)
    return option


VIS, LABEL, FRAME, RND = mujoco.mjtVisFlag, mujoco.mjtLabel, mujoco.mjtFrame, mujoco.mjtRndFlag


@pytest.mark.parametrize(
    "option",
    [
        options(flags={VIS.mjVIS_JOINT: True, VIS.mjVIS_ACTUATOR: True, VIS.mjVIS_COM: True}),
        options(flags={VIS.mjVIS_TRANSPARENT: True, VIS.mjVIS_CONTACTPOINT: True, VIS.mjVIS_LIGHT: True}),
        options(geomgroup={0: False, 3: True, 4: True}, sitegroup={3: True, 4: True}, tendongroup={1: False}),
        options(label=LABEL.mjLABEL_BODY.value),
        options(label=LABEL.mjLABEL_SITE.value, frame=FRAME.mjFRAME_GEOM.value),
        options(frame=FRAME.mjFRAME_WORLD.value, flags={VIS.mjVIS_INERTIA: True}),
    ],
    ids=["joints", "transparent", "groups", "labels", "frames", "inertia"],
)
def test_scene_options(option: Any) -> None:
    envs = pair(("quadruped", "walk"), 10)
    for _ in range(2):
        assert_same_picture(*envs, scene_option=option, height=200, width=200)


@pytest.mark.parametrize(
    "flags",
    [
        {"wireframe": True},
        {RND.mjRND_SHADOW: False, "reflection": False},
        {"skybox": False, "haze": False},
        {"fog": True},
        {"additive": True, RND.mjRND_CULL_FACE: False},
    ],
    ids=str,
)
def test_render_flags(flags: dict[Any, bool]) -> None:
    envs = pair(("humanoid", "stand"), 10)
    # Where a line leaves the picture, its last pixel depends on the size of OpenGL's buffer, which in dm_control is the
    # model's.
    size = {"height": 480, "width": 640} if "wireframe" in flags else SIZE
    assert_same_picture(*envs, **size, camera_id="back", render_flag_overrides=flags)
    assert_same_picture(*envs, **SIZE, camera_id="back")


@pytest.mark.parametrize("pixels_only", [True, False])
def test_wrapper(pixels_only: bool) -> None:
    got, want = (
        pixels.Wrapper(suite.load("reacher", "easy", {"random": 2}), pixels_only, {**SIZE, "camera_id": 0})
        for suite in (ours, theirs)
    )
    assert got.observation_spec() == want.observation_spec()
    for _ in range(2):
        assert_same_step(got.reset(), want.reset())
        for _ in range(3):
            assert_same_step(got.step([0.3, -0.2]), want.step([0.3, -0.2]))


def test_before_the_first_reset() -> None:
    assert_same_picture(ours.load("cheetah", "run"), theirs.load("cheetah", "run"), **SIZE)
    got, want = (suite.load("reacher", "hard", {"random": 4}) for suite in (ours, theirs))
    assert got.physics.position().tolist() == want.physics.position().tolist()
    assert_same_step(got.reset(), want.reset())


def test_visualize_reward() -> None:
    envs = [suite.load("cartpole", "balance", {"random": 2}, visualize_reward=True) for suite in (ours, theirs)]
    for _ in range(2):
        for env in envs:
            env.reset()
        assert_same_picture(*envs, **SIZE)
        for env in envs:
            env.step([0.2])
        assert_same_picture(*envs, **SIZE)


def test_many_sizes() -> None:
    """More sizes than renderers are kept."""
    envs = pair(("pendulum", "swingup"), 2)
    for height in (*range(20, 40, 2), 20):
        assert_same_picture(*envs, height=height, width=30)
