"""What a user sees and does in the viewer's page."""

from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser

import mjenv
from commands import Command
from mjenv_learn.policy import Policy
from mjenv_viewer.controls import Page
from waiting import HANGS, wait_until

PLUGINS = Path(os.environ["MJENV_LIBRARY"]).resolve().parent / "tests" / "tasks"
POLICIES = Path(__file__).parents[3] / "extras/curricula/policies"


# Only the command's page has the light of users' pages, because that is in another process. The pages of all ids are in
# long/check_pages.py.
pytestmark = pytest.mark.usefixtures("plain_light")


def test_buttons_pause_step_back_and_reset(tab: Any) -> None:
    with Page("Hopper-v5", 2, {"terminate_when_unhealthy": False}, port=0) as session:
        page = tab(session.address).page
        wait_until(lambda: session.steps[0] > 5, "steps")
        page.get_by_role("button", name="Pause").click()
        page.get_by_role("button", name="Play").wait_for()
        states = [session.ask(lambda: session.envs.snapshot(0))]
        steps = int(session.steps[0])
        for _ in range(3):
            before = int(session.steps[0])
            page.get_by_role("button", name="+1", exact=True).click()
            wait_until(lambda before=before: session.steps[0] == before + 1, "a step")
            states.append(session.ask(lambda: session.envs.snapshot(0)))
        for state in states[-2::-1]:
            before = int(session.steps[0])
            page.get_by_role("button", name="-1", exact=True).click()
            wait_until(lambda before=before: session.steps[0] == before - 1, "a step back")
            assert session.ask(lambda: session.envs.snapshot(0)) == state
        assert session.steps[0] == steps

        page.get_by_label("Seed").fill("41")
        page.get_by_label("Seed").press("Enter")
        page.get_by_role("button", name="Reset").click()
        wait_until(lambda: session.seed == 41, "the reset")
        found = session.ask(lambda: (session.envs.envs[1].data.qpos, session.obs[1]))
    with mjenv.make("Hopper-v5") as env:
        obs, _ = env.reset(seed=42)
        assert np.array_equal(found[0], env.data.qpos)
        assert np.array_equal(found[1], obs)


@pytest.mark.parametrize("end", ["the user lets go", "the tab is closed"])
def test_pulling_moves_the_body(end: str, tab: Any) -> None:
    with ball() as session:
        tab = tab(session.address, width=1200)  # viser's word about software rendering must not hide the ball
        page = tab.page
        box = page.locator("canvas").first.bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2 - 20  # above the ball's dark side
        wait_until(lambda: is_blue(tab.pixel(x, y)), "the ball in the middle of the picture")
        before = session.ask(lambda: session.envs.envs[0].data.qpos.copy())
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x - 60, y, steps=6)
        wait_until(lambda: session.picture.pull.grip is not None, "the grip")
        grip = session.picture.pull.grip
        assert grip is not None
        assert grip.body == 1
        wait_until(lambda: np.abs(session.ask(lambda: session.envs.envs[0].data.xfrc_applied)).max() > 0, "a force")
        wait_until(lambda: np.abs(session.ask(lambda: session.envs.envs[0].data.qpos) - before).max() > 0.05, "a move")
        if end == "the user lets go":
            page.mouse.up()
        else:
            tab.close()
        wait_until(lambda: session.picture.pull.grip is None, "the release")
        wait_until(lambda: not session.ask(lambda: session.envs.envs[0].data.xfrc_applied).any(), "no force")


def is_blue(pixel: Any) -> bool:
    return bool(pixel[2] > pixel[0] + 30)


def test_the_policy_walks_with_the_bits_of_play() -> None:
    policy = Policy.load(POLICIES / "HalfCheetah-v5.txt")
    with Page("HalfCheetah-v5", 2, policy=policy.act, port=0) as session:
        session.do(lambda: setattr(session, "speed", 8.0))
        wait_until(lambda: session.steps[0] >= 100, "100 steps")
        session.ask(lambda: setattr(session, "playing", False))
        steps = int(session.steps[1])
        found = session.ask(lambda: (session.obs[1], session.totals[1], session.envs.envs[1].data.qpos[0]))
    with mjenv.make("HalfCheetah-v5") as env:
        obs, _ = env.reset(seed=1)
        total = 0.0
        for _ in range(steps):
            obs, reward, *_ = env.step(policy.act(obs))
            total += reward
    assert np.array_equal(found[0], obs)
    assert found[1] == total
    assert found[2] > 5  # it has run


def test_the_command_shows_a_task_of_a_file_and_its_policy(tab: Any) -> None:
    folder = Path(__file__).parents[3] / "extras/curricula/reach"
    task, policy = folder / "reach.py", folder / "policy.txt"
    with Command("Reach-v0", "--tasks", task, "--policy", policy, "--rows", 4, "--option", "effort=0.02") as command:
        page = tab(command.address)
        page.wait_for_picture()
        page.page.get_by_text("Reach-v0").first.wait_for()
        assert page.field("Actions").input_value() == "policy"


def test_live_parameters_are_sliders(tab: Any) -> None:
    mjenv.load_tasks(PLUGINS / "liblive.so")
    with Page("CppLive-v0", 2, port=0) as session:
        page = tab(session.address)
        page.open("Model")
        page.field("gains\\[1\\]").fill("4.5")
        page.field("gains\\[1\\]").press("Enter")
        written = lambda: session.envs.parameters["gains"][:, 1].tolist() == [4.5, 4.5]  # noqa: E731
        wait_until(lambda: session.ask(written), "the new numbers")


def test_a_notebook_shows_the_page_in_a_frame(tab: Any, browser: Browser) -> None:
    envs = mjenv.make_vec("Swimmer-v5", 2)
    with mjenv.view(envs, port=0, quiet=True) as view:
        envs.reset(seed=0)
        page = browser.new_page()
        page.set_default_timeout(1000 * HANGS)
        # What Jupyter writes into its own page.
        page.set_content(f"<h1>Cells</h1>{view._repr_html_()}{envs._repr_html_()}")
        page.frame_locator("iframe").get_by_role("tab", name="Draw").wait_for()
        assert not page.get_by_text("forward_reward_weight").is_visible()
        page.get_by_text("Options with their defaults").click()
        assert page.get_by_text("forward_reward_weight").is_visible()
        assert page.locator("img").count() == 1
        page.close()


def test_options_are_applied_or_refused(tab: Any) -> None:
    with Page("Ant-v5", 1, port=0) as session:
        page = tab(session.address)
        page.wait_for_picture()
        page.open("Options")
        page.field("frame_skip").fill("7")
        page.page.get_by_role("button", name="Apply").click()
        wait_until(lambda: session.envs.frame_skip == 7, "the new environment")
        page.field("frame_skip").fill("0")
        page.page.get_by_role("button", name="Apply").click()
        page.page.get_by_text('InvalidValueError: option "frame_skip"').wait_for()
        assert session.envs.frame_skip == 7
        steps = session.steps[0]
        wait_until(lambda: session.steps[0] > steps, "a step")


def test_a_browser_that_leaves_changes_nothing(tab: Any) -> None:
    with Page("Swimmer-v5", 1, port=0) as session:
        page = tab(session.address)
        wait_until(lambda: session.server.is_watched, "the browser")
        page.close()
        wait_until(lambda: not session.server.is_watched, "the browser's end")
        steps = session.steps[0]
        wait_until(lambda: session.steps[0] > steps, "a step")
        tab(session.address)
        wait_until(lambda: session.server.is_watched, "another browser")


def test_closing_leaves_no_thread_and_no_port(tab: Any) -> None:
    before = set(threading.enumerate())
    session = Page("Reacher-v5", 1, port=0)
    session.start()
    tab(session.address).wait_for_picture()
    session.close()
    session.close()
    wait_until(lambda: set(threading.enumerate()) <= before, "the end of the threads")
    again = Page("Reacher-v5", 1, port=session.server.port)
    again.close()


MODEL = """
<mujoco><option gravity="0 0 0"/><worldbody><geom type="plane" size="5 5 .1" pos="0 0 -2" rgba=".8 .6 .4 1"/>
<body><freejoint/><geom type="sphere" size=".5" rgba=".2 .5 .9 1"/></body></worldbody></mujoco>"""


def ball() -> Page:
    """A ball in the middle of the picture."""
    session = Page("Model-v0", 1, {"xml_string": MODEL, "frame_skip": 5}, port=0)
    camera = session.server.viser.initial_camera
    camera.position, camera.look_at = (0.0, -4.0, 0.5), (0.0, 0.0, 0.0)
    return session
