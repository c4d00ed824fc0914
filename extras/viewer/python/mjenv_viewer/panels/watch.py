"""The panel of an environment that a program steps."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import mjenv
from mjenv_viewer.panels.common import on_click, on_user
from mjenv_viewer.panels.draw import DrawPanel
from mjenv_viewer.panels.parameters import ParametersPanel

if TYPE_CHECKING:
    from mjenv_viewer.watch import View

_OFTEN = 0.5  # seconds between two updates of the text


class WatchPanel:
    def __init__(self, view: View) -> None:
        self._view = view
        self._updated, self._counted = time.monotonic(), 0
        gui: Any = view.server.viser.gui
        tabs = gui.add_tab_group()
        with tabs.add_tab("Run"):
            gui.add_markdown(
                f"**{view.id}**\n\nA program steps these environments. Pausing makes it wait. Pulling a body "
                "and writing live parameters change what it computes."
            )
            self._status = gui.add_markdown("")
            self._pause = gui.add_button("Pause")
            step = gui.add_button("Step")
            real = gui.add_checkbox(
                "Real time", False, hint="The program waits, so that a simulated second takes a real one"
            )
            drawn = len(view.picture.rows)
            row: Any = gui.add_slider("Row", 0, drawn - 1, 1, 0) if drawn > 1 else None
            track = gui.add_checkbox("Move with the row", True)
            self.parameters = ParametersPanel(
                gui,
                mjenv.options(view.id, view.rows[0].engine),
                lambda: view.rows,
                lambda: view.picture.follow,
                view.do,
                lambda: None,
            )
        with tabs.add_tab("Draw"):
            DrawPanel(gui, lambda: view.picture, view.do, lambda: None)
        view.on_draw = self.refresh
        on_click(self._pause, lambda: view.do(self._switch))
        on_click(step, lambda: view.do(view.go_one_step))
        on_user(real, lambda value: view.do(lambda: setattr(view, "real_time", bool(value))))
        on_user(track, lambda value: view.do(lambda: setattr(view.picture, "tracks", bool(value))))
        if row is not None:
            on_user(row, lambda value: view.do(lambda: self._follow(int(value))))

    def _follow(self, row: int) -> None:
        self._view.picture.choose(row)
        self.parameters.refresh()

    def _switch(self) -> None:
        self._view.paused = not self._view.paused

    def refresh(self) -> None:
        now = time.monotonic()
        passed = now - self._updated
        if passed < _OFTEN:
            return
        view = self._view
        rate = (view.steps - self._counted) / passed
        self._updated, self._counted = now, view.steps
        self.parameters.refresh()
        self._pause.label = "Continue" if view.paused else "Pause"
        self._status.content = f"step {view.steps} · {rate:.0f} steps a second"
