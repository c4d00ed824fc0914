"""Inputs for the live parameters of a task, the numbers that a program may change while rows go on."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

import mjenv
from mjenv.capi.schema import Field
from mjenv_viewer.panels.common import on_user

Do = Callable[[Callable[[], None]], None]


class ParametersPanel:
    """A slider for each number that has bounds, and a field for each of the others. Shows those of one row."""

    def __init__(
        self,
        gui: Any,
        options: Mapping[str, mjenv.Option],
        rows: Callable[[], Sequence[Any]],
        followed: Callable[[], int],
        do: Do,
        changed: Callable[[], None],
    ) -> None:
        """options: those of the id, which have the bounds of live parameters. rows: returns the environment's rows.

        followed: returns the number of the row whose numbers are shown. changed: is called after a write.
        """
        self._rows, self._followed, self._do, self._changed = rows, followed, do, changed
        self.inputs: dict[tuple[str, int], Any] = {}
        row = rows()[0]
        fields = row.fields("parameters")
        if not fields:
            return
        with gui.add_folder("Live parameters"):
            self.everywhere: Any = None
            if len(rows()) > 1:
                self.everywhere = gui.add_checkbox("In all rows", True, hint="Otherwise in the row that is followed")
            for name, index, handle in self._made(gui, options, row, fields):
                self.inputs[name, index] = handle
                on_user(handle, self._asked, name, index)

    @staticmethod
    def _made(
        gui: Any, options: Mapping[str, mjenv.Option], row: Any, fields: Sequence[Field]
    ) -> Iterator[tuple[str, int, Any]]:
        for field in fields:
            name = field.name.removeprefix("parameters.")
            option = options.get(name)
            low, high = (option.low, option.high) if option else (-math.inf, math.inf)
            for index, value in enumerate(np.ravel(row.parameters[name]).tolist()):
                label = f"{name}[{index}]" if field.count > 1 else name
                if math.isfinite(low) and math.isfinite(high) and low < high:
                    handle = gui.add_slider(label, low, high, (high - low) / 200, value, hint=field.doc)
                else:
                    # The step also decides how many digits can be written.
                    step = 10.0 ** (math.floor(math.log10(abs(value) or 1.0)) - 2)
                    handle = gui.add_number(label, value, step=step, hint=field.doc)
                yield name, index, handle

    def _asked(self, name: str, index: int, value: float) -> None:
        self._do(lambda: self.write(name, index, float(value)))

    def write(self, name: str, index: int, value: float) -> None:
        """Writes one number, in all rows or in the one that is followed."""
        rows = self._rows()
        chosen = rows if self.everywhere is None or self.everywhere.value else [rows[self._followed()]]
        try:
            for row in chosen:
                numbers = np.array(row.parameters[name], float)
                numbers.reshape(-1)[index] = value
                row.parameters[name] = numbers
        finally:
            self._changed()
            self.refresh()

    def refresh(self) -> None:
        """Shows the numbers of the row that is followed."""
        if not self.inputs:
            return
        row = self._rows()[self._followed()]
        numbers = {name: np.ravel(row.parameters[name]) for name in row.parameters}
        for (name, index), handle in self.inputs.items():
            value = float(numbers[name][index])
            if handle.value != value:
                handle.value = value
