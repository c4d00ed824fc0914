"""The tab with which the user runs, pauses, resets and acts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mjenv_viewer.panels.common import on_click, on_user

if TYPE_CHECKING:
    from mjenv_viewer.session import Session

SPEEDS = {"1/16": 1 / 16, "1/8": 1 / 8, "1/4": 1 / 4, "1/2": 1 / 2, "1": 1.0, "2": 2.0, "4": 4.0, "8": 8.0}
PLAY, PAUSE = "Play", "Pause"
STEPS = ("-100", "-10", "-1", "+1", "+10")


class RunPanel:
    def __init__(self, gui: Any, session: Session) -> None:
        self._session = session
        self._status = gui.add_markdown("")
        self._play = gui.add_button(PAUSE, hint="Stop the time, and let it go on")
        self._steps = gui.add_button_group(
            "Steps",
            STEPS,
            hint="-: the followed row goes back, by up to 1,000 steps in all; +: all rows take steps",
        )
        self._seed = gui.add_number("Seed", session.seed, min=0, step=1, hint="Row i gets this seed + i")
        self._reset = gui.add_button("Reset", hint="Begin episodes with this seed")
        self._speed = gui.add_dropdown("Speed", tuple(SPEEDS), initial_value="1", hint="1 is real time")
        self._row: Any = None
        if session.count > 1:
            self._row = gui.add_slider("Row", 0, session.count - 1, 1, 0, hint="The row that is followed")
        self._track = gui.add_checkbox("Move with the row", True)
        self._source = gui.add_dropdown(
            "Actions",
            (*(("policy",) if session.policy else ()), "zero", "random"),
            initial_value=session.source,
            hint="The sliders add to these",
        )
        with gui.add_folder("Actuators", expand_by_default=False):
            self._sliders = list(self._actuators(gui))
            zero = gui.add_button("All to zero")
        self._connect(zero)

    def _actuators(self, gui: Any) -> Any:
        space, model = self._session.envs.single_action_space, self._session.envs.envs[0].model
        for number, (low, high) in enumerate(zip(space.low.tolist(), space.high.tolist(), strict=True)):
            low, high = (bound if np.isfinite(bound) else sign for bound, sign in ((low, -1.0), (high, 1.0)))
            width = max(high - low, 1e-6)
            name = str(model.actuator(number).name) if number < int(model.nu) else ""
            # The sliders' values are added to the actions, so 0 changes nothing.
            yield gui.add_slider(name or f"actuator {number}", -width, width, width / 100, 0.0)

    def _connect(self, zero: Any) -> None:
        session = self._session
        on_click(self._play, lambda: session.do(self._switch))
        on_click(self._steps, lambda: self._go(int(self._steps.value)))
        on_click(self._reset, lambda: session.do(lambda: session.reset(int(self._seed.value))))
        on_user(self._speed, lambda value: session.do(lambda: setattr(session, "speed", SPEEDS[value])))
        if self._row is not None:
            on_user(self._row, lambda value: session.do(lambda: session.choose_row(int(value))))
        on_user(self._track, lambda value: session.do(lambda: setattr(session.picture, "tracks", bool(value))))
        on_user(self._source, lambda value: session.do(lambda: setattr(session, "source", value)))
        for number, slider in enumerate(self._sliders):
            on_user(slider, self._push, number)
        on_click(zero, lambda: session.do(self._release))

    def _switch(self) -> None:
        self._session.playing = not self._session.playing
        self.refresh()

    def _go(self, steps: int) -> None:
        session = self._session

        def go() -> None:
            session.playing = False
            session.back(max(-steps, 0))
            for _ in range(steps):
                session.step()
            self.refresh()

        session.do(go)

    def _push(self, number: int, value: float) -> None:
        self._session.do(lambda: self._session.sliders.__setitem__(number, value))

    def _release(self) -> None:
        self._session.sliders[:] = 0
        for slider in self._sliders:
            slider.value = 0.0

    def refresh(self) -> None:
        """Shows where the row is."""
        session = self._session
        row = session.picture.follow
        self._play.label = PAUSE if session.playing else PLAY
        seconds = session.steps[row] * session.envs.dt
        ended = " · ended" if session.ended[row] else ""
        self._status.content = (
            f"**{session.id}** · MuJoCo {session.envs.engine}\n\n"
            f"row {row} · step {session.steps[row]} · {seconds:.2f} s · return {session.totals[row]:.3f}{ended}"
        )
