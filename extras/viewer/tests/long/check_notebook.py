"""The viewer and an environment's picture in JupyterLab, as a user opens a notebook there.

Needs what tests/run view --long installs. The screenshot is build/view-screenshots/notebook.png.
"""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from waiting import HANGS, wait_until

SCREENSHOTS = Path(__file__).parents[4] / "build" / "view-screenshots"
CELLS = (
    'import mjenv\nenvs = mjenv.make_vec("Ant-v5", 4, ctrl_cost_weight=0.25)\nenvs.reset(seed=0)\nenvs',
    "mjenv.view(envs, port=0, quiet=True)",
    "for _ in range(30):\n    envs.step(envs.action_space.sample())\nprint('stepped', 30)",
)


@pytest.fixture
def lab(tmp_path: Path) -> Any:
    """The address of a notebook in a running JupyterLab."""
    cells = [
        {"cell_type": "code", "source": code, "metadata": {}, "outputs": [], "execution_count": None} for code in CELLS
    ]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 4}
    (tmp_path / "robots.ipynb").write_text(json.dumps(notebook))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    settings = {"ServerApp.port": port, "ServerApp.root_dir": tmp_path, "IdentityProvider.token": ""}
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root"]
    command += [f"--{name}={value}" for name, value in settings.items()]
    log = (tmp_path / "log").open("w")
    server = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)

    def answers() -> bool:
        assert server.poll() is None, (tmp_path / "log").read_text()
        try:
            return bool(urllib.request.urlopen(f"http://127.0.0.1:{port}/api").status == 200)
        except OSError:
            return False

    wait_until(answers, "JupyterLab")
    yield f"http://127.0.0.1:{port}/lab/tree/robots.ipynb"
    server.terminate()
    server.wait(HANGS)
    log.close()


def test_a_notebook_shows_environments_and_the_viewer(lab: str, browser: Browser) -> None:
    page = browser.new_page(viewport={"width": 1200, "height": 1400})
    page.set_default_timeout(1000 * HANGS)
    page.goto(lab)
    page.get_by_text("Python 3", exact=False).first.wait_for()
    page.get_by_role("menuitem", name="Run", exact=True).click()
    page.get_by_text("Run All Cells", exact=True).click()
    outputs = page.locator(".jp-OutputArea-output")
    outputs.get_by_text("stepped 30").wait_for()

    table = outputs.locator("table").first
    assert table.locator("tr", has_text="ctrl_cost_weight").inner_text().split() == ["ctrl_cost_weight", "0.25"]
    assert table.locator("tr", has_text="engine").inner_text().split() == ["engine", "MuJoCo", "2.2.2"]
    image = outputs.locator("img").first
    assert image.evaluate("image => [image.naturalWidth, image.naturalHeight]") == [200, 200]

    assert outputs.get_by_text("viser").count() == 0  # it would print where it listens

    viewer = page.frame_locator(".jp-OutputArea-output iframe")
    viewer.get_by_role("tab", name="Draw").wait_for()
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    page.wait_for_timeout(10_000)  # until the frame has drawn the robots
    page.screenshot(path=SCREENSHOTS / "notebook.png")
    page.close()
