"""Every byte that render() of the Python classes returns equals Gymnasium's."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.envs.mujoco.mujoco_rendering import MujocoRenderer

import mjenv

TASKS = Path(__file__).resolve().parent.parent / "tasks"
SIZE = {"width": 157, "height": 93}

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::UserWarning")


def parts(picture: Any) -> tuple[Any, ...]:
    return picture if isinstance(picture, tuple) else (picture,)


def assert_equal(ours: Any, theirs: Any) -> None:
    assert isinstance(ours, tuple) == isinstance(theirs, tuple)
    for mine, wanted in zip(parts(ours), parts(theirs), strict=True):
        assert (mine.dtype, mine.shape) == (wanted.dtype, wanted.shape)
        assert np.array_equal(mine, wanted)


def compare(ours: Any, theirs: Any, steps: int) -> None:
    ours.reset(seed=4)
    theirs.reset(seed=4)
    theirs.action_space.seed(4)
    for step in range(steps + 1):
        if step:
            action = theirs.action_space.sample()
            ours.step(action)
            theirs.step(action)
        if step in (0, 1, steps):
            assert_equal(ours.render(), theirs.render())
    ours.close()
    theirs.close()


@pytest.mark.parametrize("id", mjenv.ids())
def test_modes(id: str, long: bool) -> None:
    for mode in ("rgb_array", "depth_array", "rgbd_tuple") if long else ("rgbd_tuple",):
        keywords = {"render_mode": mode, **SIZE}
        theirs = gymnasium.make(id, disable_env_checker=True, **keywords)
        keywords["strict"] = False  # steps go on after the end, as Gymnasium's do
        ours = (
            gymnasium.make(f"mjenv/{id}", disable_env_checker=True, **keywords) if long else mjenv.make(id, **keywords)
        )
        assert ours.metadata == theirs.metadata
        compare(ours, theirs, 20 if long else 3)


@pytest.mark.parametrize("mode", ["rgb_array", "depth_array"])
def test_default_size(mode: str) -> None:
    compare(mjenv.make("Walker2d-v5", render_mode=mode), gymnasium.make("Walker2d-v5", render_mode=mode), 1)


@pytest.mark.parametrize(
    ("id", "keywords"),
    [
        ("Humanoid-v5", {"camera_id": 1}),
        ("Humanoid-v4", {"camera_id": -1}),
        ("Ant-v4", {"camera_name": "track"}),
        ("Ant-v5", {"camera_name": "nobody"}),
        ("Reacher-v5", {"camera_name": "track"}),
        ("Hopper-v5", {"max_geom": 4}),
        ("Ant-v5", {"visual_options": {mujoco.mjtVisFlag.mjVIS_CONTACTPOINT: True, 2: 1, 1: False}}),
        ("Walker2d-v5", {"camera_id": -1, "default_camera_config": {"distance": 7.0, "azimuth": 30}}),
        ("Walker2d-v5", {"camera_id": -1, "default_camera_config": {"lookat": np.array((0.1, 0.2, 1.0)), "type": 1}}),
        ("InvertedPendulum-v5", {"default_camera_config": {"lookat": [0.1, 0.2, 0.3], "trackbodyid": 1}}),
        ("Pusher-v5", {"default_camera_config": None}),
        ("Pusher-v5", {"default_camera_config": {}}),
    ],
)
def test_keywords(id: str, keywords: dict[str, Any]) -> None:
    keywords = {"render_mode": "rgbd_tuple", **SIZE, **keywords}
    compare(mjenv.make(id, **keywords), gymnasium.make(id, **keywords), 2)


# A cart with a pole that has an object of each kind in each group.
GROUPED = """
<mujoco>
  <asset>
    <texture name="grid" type="2d" builtin="checker" rgb1="0.9 0.3 0.2" rgb2="0.2 0.3 0.9" width="8" height="8"/>
    <material name="grid" texture="grid"/>
    <skin name="cloth" material="grid" vertex="-1 1 1  1 1 1  1 1 2  -1 1 2" texcoord="0 0 1 0 1 1 0 1"
          face="0 1 2 0 2 3" group="{}">
      <bone body="pole" bindpos="0 0 1" bindquat="1 0 0 0" vertid="0 1 2 3" vertweight="1 1 1 1"/>
    </skin>
  </asset>
  <worldbody>
    <light pos="0 -1 4"/>
    <geom name="floor" type="plane" size="3 3 0.5" rgba="0.8 0.9 0.8 1"/>
    <body name="cart" pos="0 0 1">
      <joint name="slider" type="slide" axis="1 0 0" group="{}"/>
      {}
      <body name="pole">
        <joint name="hinge" axis="0 1 0" group="4"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.6" size="0.05" group="3"/>
      </body>
    </body>
  </worldbody>
  <tendon>{}</tendon>
  <actuator><motor joint="slider" ctrlrange="-3 3" ctrllimited="true" group="3"/></actuator>
</mujoco>
""".format(
    4,
    3,
    "".join(
        f'<geom size="0.1" pos="{0.25 * group - 0.6} 0 -0.2" group="{group}"/>'
        f'<site name="low{group}" size="0.04" pos="{0.25 * group - 0.6} -0.3 -0.3" group="{group}" rgba="1 0 0 1"/>'
        f'<site name="high{group}" size="0.04" pos="{0.25 * group - 0.6} -0.3 0.3" group="{5 - group}" rgba="0 0 1 1"/>'
        for group in range(6)
    ),
    "".join(
        f'<spatial width="0.02" group="{group}"><site site="low{group}"/><site site="high{group}"/></spatial>'
        for group in range(6)
    ),
)
GROUPS = ("geomgroup", "sitegroup", "jointgroup", "tendongroup", "actuatorgroup", "skingroup")


def test_groups(tmp_path: Path) -> None:
    """Gymnasium has no keyword for groups: the mjvOption of its viewer is set."""
    path = tmp_path / "grouped.xml"
    path.write_text(GROUPED)
    # So that joints and actuators are drawn, too.
    flags = {int(mujoco.mjtVisFlag.mjVIS_JOINT): True, int(mujoco.mjtVisFlag.mjVIS_ACTUATOR): True}
    keywords: dict[str, Any] = {"render_mode": "rgb_array", "xml_file": str(path), "visual_options": flags, **SIZE}
    theirs = gymnasium.make("InvertedPendulum-v5", **keywords)
    theirs.reset(seed=4)
    shown = theirs.render()
    option = theirs.unwrapped.mujoco_renderer.viewer.vopt
    choices: list[dict[str, Any]] = [{name: {3: True}} for name in GROUPS]
    choices += [{name: {0: False, 4: True, 5: 1}} for name in GROUPS]
    choices += [dict.fromkeys(GROUPS, (0, 1, 0, 1, 0, 1)), dict.fromkeys(GROUPS, np.zeros(6, bool))]
    pictures = []
    for groups in choices:
        for name in GROUPS:
            chosen = groups.get(name, {})
            for group in range(6):
                default = group < 3
                wanted = chosen.get(group, default) if isinstance(chosen, dict) else chosen[group]
                getattr(option, name)[group] = wanted
        ours = mjenv.make("InvertedPendulum-v5", **keywords, **groups)
        ours.reset(seed=4)
        pictures.append(theirs.render())
        assert_equal(ours.render(), pictures[-1])
        ours.close()
    theirs.close()
    for name, first, second in zip(GROUPS, pictures, pictures[len(GROUPS) :], strict=False):
        assert not np.array_equal(first, shown) or not np.array_equal(second, shown), name


@pytest.mark.parametrize("id", ["HalfCheetah-v5", "Reacher-v5"])
def test_vector(id: str) -> None:
    keywords = {"num_envs": 3, "render_mode": "rgb_array", **SIZE}
    ours, theirs = mjenv.make_vec(id, **keywords), gymnasium.make_vec(id, vectorization_mode="sync", **keywords)
    assert ours.metadata == theirs.metadata
    for envs in (ours, theirs):
        envs.reset(seed=7)
        envs.action_space.seed(7)
    for _ in range(3):
        pictures, expected = ours.render(), theirs.render()
        assert isinstance(pictures, type(expected))
        for picture, wanted in zip(pictures, expected, strict=True):
            assert_equal(picture, wanted)
        for envs in (ours, theirs):
            envs.step(envs.action_space.sample())
    ours.close()
    theirs.close()


HILLS = """
<mujoco>
  <statistic extent="2"/>
  <asset><hfield name="hills" nrow="6" ncol="7" size="1 1 0.4 0.1"/></asset>
  <worldbody>
    <light pos="0 0 3"/>
    <geom name="floor" type="plane" size="3 3 0.5" rgba="0.8 0.9 0.8 1"/>
    <geom type="hfield" hfield="hills" pos="0 1 0" contype="0" conaffinity="0"/>
    <body name="cart" pos="0 0 1">
      <joint name="slider" type="slide" axis="1 0 0"/>
      <geom size="0.1"/>
      <body name="pole">
        <joint name="hinge" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.6" size="0.05"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="slider" ctrlrange="-3 3" ctrllimited="true"/></actuator>
</mujoco>
"""


@pytest.mark.parametrize("is_first", [True, False])
def test_what_the_first_picture_fixes(is_first: bool, tmp_path: Path) -> None:
    """Gymnasium makes MuJoCo's context at the first picture, with its planes and extent; here also with its height
    fields, unless they are uploaded again, which mjenv does by itself."""

    def upload(env: Any) -> None:
        viewer = env.unwrapped.mujoco_renderer.viewer if env is envs[1] else None
        if viewer:
            viewer.make_context_current()
            mujoco.mjr_uploadHField(env.unwrapped.model, viewer.con, 0)

    path = tmp_path / "hills.xml"
    path.write_text(HILLS)
    keywords: dict[str, Any] = {"render_mode": "rgbd_tuple", "xml_file": str(path), **SIZE}
    envs = mjenv.make("InvertedPendulum-v5", **keywords), gymnasium.make("InvertedPendulum-v5", **keywords)
    heights = np.random.default_rng(1).uniform(0, 1, 42)
    pictures: list[list[Any]] = []
    for env in envs:
        env.reset(seed=4)
        pictures.append([] if is_first else [env.render()])
        model: Any = env.unwrapped.model
        model.hfield_data[...] = heights
        model.hfield_size[0] = [0.8, 0.9, 0.5, 0.1]
        model.geom_size[0] = [2, 2.5, 0.7]
        model.stat.extent = 1.3
        upload(env)
        pictures[-1].append(env.render())
        env.step([0.5])
        model.hfield_data[...] = 0
        upload(env)
        pictures[-1].append(env.render())
        env.close()
    for ours, theirs in zip(*pictures, strict=True):
        assert_equal(ours, theirs)


def test_height_fields_that_a_task_writes() -> None:
    """A picture of such a row shows its own terrain and colours, as a renderer shows them that is made for it."""
    mjenv.load_tasks(Path(os.environ["MJENV_LIBRARY"]).parent / "tests" / "tasks" / "libterrain.so")
    env = mjenv.make("tests/Terrain-v0", render_mode="rgbd_tuple", **SIZE)
    pictures = []
    for step in range(5):
        env.reset(seed=step) if step % 2 == 0 else env.step(np.array([0.5, -0.5]))
        ours: Any = env.unwrapped
        model = mujoco.MjModel.from_xml_path(str(TASKS / "terrain.xml"))
        for name in ("hfield_data", "geom_rgba"):
            array = getattr(model, name)
            array[...] = np.array(getattr(ours.model, name)).reshape(array.shape)
        data = mujoco.MjData(model)
        data.qpos[:] = ours.data.qpos
        mujoco.mj_forward(model, data)
        theirs = MujocoRenderer(model, data, None, SIZE["width"], SIZE["height"])
        pictures.append(env.render())
        if step == 0:
            camera = {"distance": model.stat.extent, "lookat": np.median(data.geom_xpos, axis=0)}
        theirs.default_cam_config = camera
        assert_equal(pictures[-1], theirs.render("rgbd_tuple"))
        theirs.close()
    assert not np.array_equal(pictures[0][1], pictures[2][1])
    env.close()


PAINTED = """
<mujoco>
  <asset>
    <hfield name="hills" nrow="6" ncol="7" size="1 1 0.4 0.1"/>
    <texture name="grid" type="2d" builtin="checker" rgb1="0.9 0.3 0.2" rgb2="0.2 0.3 0.9" width="8" height="8"/>
    <texture name="dots" type="2d" builtin="flat" rgb1="0.9 0.9 0.2" width="8" height="4" mark="random" random="0.3"/>
    <texture name="cube" type="cube" builtin="gradient" rgb1="1 0 0" rgb2="0 1 0" width="4" height="4"/>
    <texture type="skybox" builtin="gradient" rgb1="0.3 0.5 0.7" rgb2="0 0 0" width="4" height="24"/>
    <material name="grid" texture="grid" texrepeat="2 2"/>
    <material name="cube" texture="cube"/>
  </asset>
  <worldbody>
    <light pos="0 0 3"/>
    <camera pos="0 -3 2" xyaxes="1 0 0 0 0.5 0.8"/>
    <geom type="plane" size="3 3 0.5" material="grid"/>
    <geom type="hfield" hfield="hills" pos="0 1 0.1"/>
    <body pos="0 0 1"><freejoint/><geom type="box" size="0.3 0.2 0.2" material="cube"/></body>
  </worldbody>
</mujoco>
"""


def test_what_rows_draw() -> None:
    """A picture shows the row's own height fields, materials and textures, as a renderer that is made for them does."""
    model: Any = mujoco.MjModel.from_xml_string(PAINTED)
    pixels = "tex_data" if hasattr(model, "tex_data") else "tex_rgb"
    textures = np.flatnonzero(model.mat_texid.reshape(-1) >= 0)
    draws = {
        "hfield_data": mjenv.Value(0, 1),
        "geom_matid": mjenv.Value(choices=(-1, 0, 1)),
        "mat_texid": mjenv.Value(choices=(-1, 0, 1, 2), elements=textures.tolist()),
        pixels: mjenv.Value(choices=(0, 90, 255), elements=range(0, model.ntexdata, 2)),
    }
    envs = mjenv.make_vec("Model-v0", 2, xml_string=PAINTED, render_mode="rgbd_tuple", camera_id=0, **SIZE)
    envs.reset(seed=0)
    shown = []
    for step in range(5):
        if step == 1:
            envs.randomize(draws)
        if step in (1, 2):
            envs.reset(seed=10 * step)
        elif step == 3:
            envs.envs[1].model.geom_matid[0] = 0
            getattr(envs.envs[1].model, pixels)[...] = 7
        for row, picture in enumerate(envs.render()):
            for name in draws:
                own = np.asarray(getattr(envs.envs[row].model, name))
                getattr(model, name)[...] = own.reshape(getattr(model, name).shape)
            data = mujoco.MjData(model)
            data.qpos[:] = envs.envs[row].data.qpos
            mujoco.mj_forward(model, data)
            theirs = MujocoRenderer(model, data, None, SIZE["width"], SIZE["height"], camera_id=0)
            assert_equal(picture, theirs.render("rgbd_tuple"))
            theirs.close()
            shown.append(picture[0].tobytes())
    assert len(set(shown)) == 6  # the model's own, two draws of each row, and what row 1 writes
    envs.envs[0].model.geom_matid[0] = 2
    with pytest.raises(ValueError, match=r"geom_matid\[0\] is 2, but must be an integer from -1 to 1"):
        envs.render()
    envs.close()


def test_list() -> None:
    pair = [gymnasium.make(id, render_mode="rgb_array_list", **SIZE) for id in ("mjenv/Swimmer-v5", "Swimmer-v5")]
    for env in pair:
        env.reset(seed=1)
        for _ in range(3):
            env.step(np.full(2, 0.7))
    ours, theirs = (env.render() for env in pair)
    assert len(ours) == len(theirs) == 4
    for picture, wanted in zip(ours, theirs, strict=True):
        assert_equal(picture, wanted)
