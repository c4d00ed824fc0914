"""The files that `mjenv play` and Gymnasium's RecordVideo write of episodes."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import imageio.v3 as imageio
import numpy as np
import pytest
from gymnasium.wrappers import RecordVideo
from PIL import Image

import mjenv
from mjenv_command import main

ROOT = Path(__file__).resolve().parents[4]
SIZE = {"width": 62, "height": 44}
STEPS = 30

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::UserWarning")


def play(*words: str | Path, size: dict[str, int] = SIZE) -> int:
    options = [word for name, value in size.items() for word in (f"--{name}", str(value))]
    return main(["play", *map(str, words), *options])


def frames(id: str = "Hopper-v5", seed: int = 3, actions: Any = None) -> list[Any]:
    """Gymnasium's pictures of an episode of random actions, or of these."""
    env = gymnasium.make(id, render_mode="rgb_array", camera_name="track", **SIZE)
    env.action_space.seed(seed)
    env.reset(seed=seed)
    found = [env.render()]
    for step in range(STEPS if actions is None else len(actions)):
        terminated = env.step(env.action_space.sample() if actions is None else actions[step])[2]
        found.append(env.render())
        if terminated:
            break
    env.close()
    return found


def assert_close(video: Any, expected: list[Any]) -> None:
    """Equal except for the loss by compression."""
    assert video.shape == (len(expected), *expected[0].shape)
    assert np.abs(video.astype(int) - np.array(expected)).mean() < 6


def test_mp4(capsys: pytest.CaptureFixture[str]) -> None:
    assert play("Hopper-v5", "--seed", "3", "--steps", str(STEPS), "--video", "a.mp4") == 0
    expected = frames()
    assert f"a.mp4: {len(expected) - 1} steps, return " in capsys.readouterr().out
    assert_close(imageio.imread("a.mp4"), expected)
    assert imageio.immeta("a.mp4")["fps"] == 125


def test_odd_size_and_rate() -> None:
    assert play("Hopper-v5", "--steps", "3", "--fps", "20", "--video", "a.mp4", size={"width": 61, "height": 43}) == 0
    assert imageio.immeta("a.mp4")["fps"] == 20
    assert imageio.imread("a.mp4").shape == (4, 44, 62, 3)


def test_gif() -> None:
    """A video has at most 30 pictures per second: every fifth of 125."""
    assert play("Hopper-v5", "--seed", "3", "--steps", str(STEPS), "--video", "a.gif") == 0
    expected = frames()[::5]
    assert_close(imageio.imread("a.gif"), expected)
    with Image.open("a.gif") as gif:
        assert (gif.n_frames, gif.info["duration"], gif.info["loop"]) == (len(expected), 40, 0)


def test_sheet() -> None:
    """Twelve pictures from the first to the last, four a row."""
    assert play("Hopper-v5", "--seed", "3", "--steps", str(STEPS), "--video", "a.png") == 0
    sheet, expected = imageio.imread("a.png"), frames()
    assert sheet.shape == (3 * 44 + 2 * 6, 4 * 62 + 3 * 6, 3)
    for tile, picture in ((sheet[:44, :62], expected[0]), (sheet[-44:, -62:], expected[-1])):
        assert np.array_equal(tile, picture)
    assert (sheet[44:50] == 255).all()


def test_recorded_actions(capsys: pytest.CaptureFixture[str]) -> None:
    actions = np.random.default_rng(0).uniform(-1, 1, (7, 6))
    np.save("a.npy", actions)
    env = gymnasium.make("HalfCheetah-v5", exclude_current_positions_from_observation=False)
    env.reset(seed=8)
    total = sum(env.step(action)[1] for action in actions)
    options = "--option", "exclude_current_positions_from_observation=false"
    assert play("HalfCheetah-v5", "--seed", "8", "--actions", "a.npy", "--video", "a.mp4", *options) == 0
    assert capsys.readouterr().out == f"a.mp4: 7 steps, return {total:.6g}\n"
    assert_close(imageio.imread("a.mp4"), frames("HalfCheetah-v5", 8, actions))


def test_camera_and_fast() -> None:
    for index, words in enumerate(([], ["--camera", "track"], ["--camera", "-1"], ["--fast"])):
        assert play("Walker2d-v5", "--steps", "1", "--video", f"{index}.png", *words) == 0
    default, track, free, fast = (imageio.imread(f"{index}.png") for index in range(4))
    assert np.array_equal(default, track)
    assert not np.array_equal(default, free)
    assert not np.array_equal(default, fast)


HIDDEN = """
<mujoco>
  <worldbody>
    <light pos="0 0 3"/>
    <geom type="plane" size="3 3 0.5"/>
    <body pos="0 0 1">
      <joint name="slider" type="slide" axis="1 0 0"/>
      <geom size="0.3" group="3"/>
      <body><joint name="hinge" axis="0 1 0"/><geom size="0.1" pos="0 0 0.5" group="4" rgba="1 0 0 1"/></body>
    </body>
  </worldbody>
  <actuator><motor joint="slider" ctrlrange="-3 3" ctrllimited="true"/></actuator>
</mujoco>
"""


def test_groups(capsys: pytest.CaptureFixture[str]) -> None:
    Path("hidden.xml").write_text(HIDDEN)
    keywords: dict[str, Any] = {"render_mode": "rgb_array", "xml_file": str(Path("hidden.xml").resolve()), **SIZE}
    env = gymnasium.make("InvertedPendulum-v5", **keywords)
    env.reset(seed=0)
    expected = [env.render()]
    env.unwrapped.mujoco_renderer.viewer.vopt.geomgroup[3] = 1
    expected.append(env.render())
    env.close()
    hint = "its geoms are in group 3,4: add --geomgroup 0,1,2,3,4"
    for words, picture, said in (([], expected[0], hint), (["--geomgroup", "0,1,2,3"], expected[1], "")):
        option = "--option", "xml_file=./hidden.xml"
        assert play("InvertedPendulum-v5", "--steps", "1", "--video", "a.png", *option, *words) == 0
        assert np.array_equal(imageio.imread("a.png")[:44, :62], picture)
        told = capsys.readouterr().err
        assert (said in told) if said else (told == "")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--video", "a.avi"], ".mp4"),
        (["--video", "a.png", "--geomgroup", "0,6"], "no group 6"),
        (["--video", "a.png", "--sitegroup", "all"], "sitegroup"),
        (["--video", "a.png", "--width", "0"], "less than 1"),
        (["--video", "a.png", "--width", "99999999"], "width"),
        (["--video", "a.png", "--camera", "7"], "camera"),
        (["--video", "a.png", "--camera", "nosuch"], "nosuch"),
        (["--video", "a.png", "--actions", "none.npy"], "none.npy"),
        (["--video", "a.png", "--actions", "wide.npy"], "which is 3 numbers"),
        (["--video", "a.png", "--actions", "text.npy"], "text.npy"),
        (["--video", "a.png", "--policy", "none.zip"], "none.zip"),
        (["--video", "none/a.mp4"], "none"),
    ],
)
def test_refusals(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    np.save("wide.npy", np.zeros((2, 4)))
    Path("text.npy").write_text("0 0 0")
    size = {} if "--width" in words else SIZE
    try:
        status = play("Hopper-v5", *words, size=size)
    except SystemExit as end:
        status = int(end.code or 0)
    assert status == 2
    told = capsys.readouterr().err
    assert message in told
    assert "Traceback" not in told


def test_without_the_extra() -> None:
    script = "import sys; sys.modules['imageio'] = None; from mjenv_command import main; sys.exit(main())"
    command = [sys.executable, "-c", script, "play", "Hopper-v5", "--video", "a.mp4"]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert 'pip install "mjenv[video]"' in done.stderr


def test_progress() -> None:
    main_end, end = pty.openpty()
    command = [sys.executable, "-m", "mjenv", "play", "Hopper-v5", "--steps", "4", "--video", "a.png"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=end) as process:
        os.close(end)
        shown = b""
        try:
            while part := os.read(main_end, 4096):
                shown += part
        except OSError:  # the other end is closed
            pass
    os.close(main_end)
    assert process.returncode == 0
    assert b"playing Hopper-v5" in shown
    assert b"4/4" in shown


@pytest.mark.parametrize("id", ["Hopper-v5", "Reacher-v4"])
def test_record_video(id: str) -> None:
    """Gymnasium's wrapper writes the same file."""
    files = []
    for folder, name in (("theirs", id), ("ours", f"mjenv/{id}")):
        env = RecordVideo(gymnasium.make(name, render_mode="rgb_array", **SIZE), folder, disable_logger=True)
        env.action_space.seed(5)
        env.reset(seed=5)
        for _ in range(20):
            env.step(env.action_space.sample())
        env.close()
        files.append(imageio.imread(f"{folder}/rl-video-episode-0.mp4"))
    assert len(files[0]) == 21
    assert np.array_equal(*files)


def test_record_video_of_many() -> None:
    files = []
    for folder, name in (("theirs", "Hopper-v5"), ("ours", "mjenv/Hopper-v5")):
        envs = gymnasium.make_vec(name, 3, render_mode="rgb_array", **SIZE)
        envs = gymnasium.wrappers.vector.RecordVideo(envs, folder, video_aspect_ratio=(1, 1), disable_logger=True)
        envs.action_space.seed(5)
        envs.reset(seed=5)
        for _ in range(12):
            envs.step(envs.action_space.sample())
        envs.close()
        (file,) = Path(folder).glob("*.mp4")
        files.append(imageio.imread(file))
    assert len(files[0]) > 10
    assert np.array_equal(*files)


def test_all_ids_have_their_rate() -> None:
    for id in mjenv.ids():
        theirs, ours = gymnasium.make(id), mjenv.make(id)
        assert ours.metadata["render_fps"] == theirs.metadata["render_fps"]
        theirs.close()
