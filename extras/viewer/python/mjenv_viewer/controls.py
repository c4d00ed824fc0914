"""The panel of a session: its tabs, and the changes that each tab is notified of."""

from __future__ import annotations

import time
from typing import Any

import mjenv
from mjenv_viewer.panels.draw import DrawPanel
from mjenv_viewer.panels.files import FilesPanel
from mjenv_viewer.panels.options import OptionsPanel
from mjenv_viewer.panels.parameters import ParametersPanel
from mjenv_viewer.panels.plots import PlotsPanel
from mjenv_viewer.panels.run import RunPanel
from mjenv_viewer.panels.values import ValuesPanel
from mjenv_viewer.session import Session

_OFTEN = 0.1  # seconds between two updates of texts and plots


class Page(Session):
    """A session with its panel. Takes the arguments of Session."""

    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        try:
            self.controls = Controls(self)
        except BaseException:
            self.close()
            raise


class Controls:
    def __init__(self, session: Session) -> None:
        self._session = session
        gui: Any = session.server.viser.gui
        self._updated = 0.0
        self._learned = False
        self._envs = session.envs
        tabs = gui.add_tab_group()
        with tabs.add_tab("Run"):
            self.run = RunPanel(gui, session)
        with tabs.add_tab("Draw"):
            self.draw = DrawPanel(gui, lambda: session.picture, session.do, session.picture_anew)
        # The tab "Model" has what can change while rows go on, and "Options" what needs a new environment.
        with tabs.add_tab("Options"):
            self.options = OptionsPanel(gui, session)
        with tabs.add_tab("Model"):
            self.parameters = ParametersPanel(
                gui,
                mjenv.options(session.id, session.envs.engine),
                lambda: session.picture.rows,
                lambda: session.picture.follow,
                session.do,
                session.changed,
            )
            self.values = ValuesPanel(gui, session)
        with tabs.add_tab("Plots"):
            self.plots = PlotsPanel(gui, session)
        with tabs.add_tab("Save"):
            self.files = FilesPanel(gui, session)
        session.on_step.append(self._stepped)
        session.on_change = self._changed
        session.on_back = self._went_back
        session.on_tick = self._tick
        self.run.refresh()

    def _stepped(self) -> None:
        self.plots.add()
        self.files.recorder.add()
        if not self._learned:
            self._learned = True
            self.plots.learn()

    def _changed(self) -> None:
        """Called when another row is followed, or the state or the environment was replaced."""
        session = self._session
        if session.envs is not self._envs:
            self._envs, self._learned = session.envs, False
            self.values.forget()
            self.files.forget()
        self.plots.forget()
        self.parameters.refresh()
        self.run.refresh()

    def _went_back(self, steps: int) -> None:
        self.plots.drop(steps)
        self.files.recorder.drop(steps)
        self.parameters.refresh()
        self.run.refresh()

    def _tick(self) -> None:
        now = time.monotonic()
        if now - self._updated < _OFTEN:
            return
        self._updated = now
        self.run.refresh()
        self.plots.refresh()
        self.files.refresh()
