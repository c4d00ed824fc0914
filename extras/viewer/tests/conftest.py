"""Chromium, which looks at the viewer's pages."""

from __future__ import annotations

import io
import re
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Locator, Page, sync_playwright

from waiting import HANGS

# Draws without a graphics card, and asks nothing of the network.
ARGUMENTS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
# What viser's page says while a body is dragged, which changes nothing.
HARMLESS = "Unable to preventDefault inside passive event listener invocation."
SIZE = {"width": 640, "height": 300}
PIXELS = 0.5  # for each of these, in both directions: the fewer, the less time
# Without a graphics card, drawing takes nearly all of the time, so the page draws a few pictures a second.
SELDOM = """{
  const soon = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (draw) => setTimeout(() => soon(draw), 150);
  window.cancelAnimationFrame = (number) => clearTimeout(number);
}"""


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=ARGUMENTS)
        yield started
        started.close()


@pytest.fixture
def plain_light(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lights the scene without surroundings, for which a page computes longer than for all else."""
    monkeypatch.setattr("mjenv_viewer.picture.SURROUNDINGS", None)


class Tab:
    """A tab of the browser, with the lists of what must stay empty: errors, and requests to other places."""

    def __init__(self, browser: Browser, address: str, width: int = SIZE["width"]) -> None:
        self.errors: list[str] = []
        self.strangers: list[str] = []
        size = {"width": width, "height": SIZE["height"]}
        self.page: Page = browser.new_page(viewport=size, device_scale_factor=PIXELS)  # type: ignore[arg-type]
        self.page.set_default_timeout(1000 * HANGS)
        self.page.add_init_script(SELDOM)
        self.page.on("console", lambda message: self._said(message.type, message.text))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self._asked(request.url, address))
        self.page.goto(address)
        self.page.get_by_role("tab", name="Run").wait_for()

    def _said(self, kind: str, text: str) -> None:
        if kind == "error" and text != HARMLESS:
            self.errors.append(text)

    def _asked(self, url: str, address: str) -> None:
        if not url.startswith((address, "data:", "blob:")):
            self.strangers.append(url)

    def picture(self) -> Any:
        """The page without its panel: uint8[height, width, 3]."""
        return self._screenshot()[:, : int(240 * PIXELS)]

    def pixel(self, x: float, y: float) -> Any:
        """The colour of a place of the page: int[3]."""
        return self._screenshot()[int(y * PIXELS), int(x * PIXELS)].astype(int)

    def _screenshot(self) -> Any:
        return np.array(Image.open(io.BytesIO(self.page.screenshot())).convert("RGB"))

    def wait_for_picture(self) -> Any:
        """The first picture with more than a background: a robot and a floor have many colours."""
        end = time.monotonic() + HANGS
        while time.monotonic() < end:
            found = self.picture()
            if len(np.unique(found[int(120 * PIXELS) :].reshape(-1, 3), axis=0)) > 60:
                return found
            self.page.wait_for_timeout(250)
        raise AssertionError("nothing was drawn")

    def field(self, label: str) -> Locator:
        """The input to the right of a label, which the page does not tie to it."""
        return self.page.locator("label", has_text=re.compile(f"^{label}$")).locator("xpath=following::input[1]")

    def open(self, name: str) -> None:
        self.page.get_by_role("tab", name=name, exact=True).click()

    def close(self) -> None:
        self.page.close()
        assert self.errors == []
        assert self.strangers == []


@pytest.fixture
def tab(browser: Browser) -> Iterator[Any]:
    tabs = []

    def opened(address: str, **settings: int) -> Tab:
        tabs.append(Tab(browser, address, **settings))
        return tabs[-1]

    yield opened
    for one in tabs:
        if not one.page.is_closed():
            one.close()
