"""The tab that plots rewards, infos and observations of the row that is followed, by name."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mjenv_viewer.panels.common import on_user
from mjenv_viewer.parts import observation_parts

if TYPE_CHECKING:
    from mjenv_viewer.session import Session

Array = NDArray[Any]

LENGTH = 300  # steps
_LINES = 12  # in one plot
_COLOURS = ("#3b7dd8 #e0533d #45a35c #b07cc6 #d9a441 #4cb5ae #8c6d5a #d46a9f #7a8793 #a3b547 #5c5fc4 #c77b4a").split()
_NOTHING, _REWARDS = "nothing", "reward and its terms"


class PlotsPanel:
    def __init__(self, gui: Any, session: Session) -> None:
        self._gui, self._session = gui, session
        self._past: dict[str, deque[float]] = {}
        self.times: deque[int] = deque(maxlen=LENGTH)
        self._plots: dict[tuple[Any, ...], Any] = {}  # by place, title and series
        self._shown: list[tuple[Any, ...]] = []
        names = tuple(self._choices())
        self._choosers = [
            gui.add_dropdown("Upper plot", names, initial_value=_REWARDS),
            gui.add_dropdown("Lower plot", names, initial_value=_NOTHING),
        ]
        self._folder = gui.add_folder("Plots")
        for chooser in self._choosers:
            on_user(chooser, lambda value: session.do(self._choose))
        self.forget()

    def _choices(self) -> dict[str, list[str]]:
        """The choices of what can be plotted, each with the names of its series."""
        session = self._session
        envs = session.envs
        infos = [name for name in _scalars(session.infos) if not name.startswith("_")]
        terms = [name for name in infos if name.startswith("reward")]
        found: dict[str, list[str]] = {_NOTHING: [], _REWARDS: ["reward", *terms]}
        found |= {f"info {name}": [name] for name in infos}
        for part, place in observation_parts(envs.envs[0]).items():
            found[f"observation {part}"] = [f"{part}[{i}]" for i in range(place.stop - place.start)]
        return found

    def _choose(self) -> None:
        """Shows the chosen plots. Hides others instead of removing them, because a page reports an error if an update
        reaches it after the removal."""
        choices = self._choices()
        chosen = [
            (slot, chooser.value, *choices.get(chooser.value, [])[:_LINES])
            for slot, chooser in enumerate(self._choosers)
        ]
        self._shown = [key for key in chosen if len(key) > 2]
        for key in self._shown:
            if key not in self._plots:
                self._plots[key] = self._made(key[1], key[2:])
        for key, plot in self._plots.items():
            plot.visible = key in self._shown
        self.refresh()

    def _made(self, title: str, series: tuple[str, ...]) -> Any:
        lines: list[dict[str, Any]] = [{"label": "step"}]
        lines += [{"label": name, "stroke": _COLOURS[i], "width": 1.5} for i, name in enumerate(series)]
        empty = tuple(np.zeros(1) for _ in lines)
        with self._folder:
            return self._gui.add_uplot(empty, tuple(lines), title=title, aspect=1.5, scales={"x": {"time": False}})

    def add(self) -> None:
        """After a step."""
        session = self._session
        row = session.picture.follow
        self.times.append(int(session.steps[row]))
        values = {"reward": float(session.rewards[row])}
        values |= {name: float(array[row]) for name, array in _scalars(session.infos).items()}
        for part, place in self._parts.items():
            values |= {f"{part}[{i}]": float(value) for i, value in enumerate(session.flat_obs[row, place][:_LINES])}
        count = len(self.times)
        for name, value in values.items():
            past = self._past.setdefault(name, deque([np.nan] * (count - 1), maxlen=LENGTH))
            past.append(value)
        for name, past in self._past.items():
            if name not in values:
                past.append(np.nan)

    def drop(self, steps: int) -> None:
        """After steps back."""
        for _ in range(min(steps, len(self.times))):
            self.times.pop()
            for past in self._past.values():
                past.pop()
        self.refresh()

    def forget(self) -> None:
        """Called when another episode, row or environment is followed."""
        self.times.clear()
        self._past.clear()
        self._parts = observation_parts(self._session.envs.envs[0])

    def learn(self) -> None:
        """Adds the infos to the choices, because a step has shown which there are."""
        names = tuple(self._choices())
        for chooser in self._choosers:
            if tuple(chooser.options) != names:
                chosen = chooser.value
                chooser.options = names
                chooser.value = chosen if chosen in names else _NOTHING
        self._choose()

    def refresh(self) -> None:
        if not self.times:
            return
        times = np.array(self.times, float)
        if (np.diff(times) <= 0).any():  # a reset lies between
            times = np.arange(len(times), dtype=float)
        for key in self._shown:
            plot, series = self._plots[key], key[2:]
            lines = [
                np.array(self._past[name]) if name in self._past else np.full(len(times), np.nan) for name in series
            ]
            plot.data = (times, *lines)


def _scalars(infos: dict[str, Any]) -> dict[str, Array]:
    """The infos that are one number for each row."""
    return {
        name: array
        for name, array in infos.items()
        if not name.startswith("_") and isinstance(array, np.ndarray) and array.ndim == 1 and array.dtype.kind in "biuf"
    }
