"""The tab that chooses what is drawn."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mjenv_viewer.panels.common import on_user
from mjenv_viewer.picture import Picture
from mjenv_viewer.scene import GROUPS

Do = Callable[[Callable[[], None]], None]

_COUNTS = {"geom": "ngeom", "site": "nsite", "tendon": "ntendon", "joint": "njnt", "skin": "nskin"}


class DrawPanel:
    def __init__(self, gui: Any, picture: Callable[[], Picture], do: Do, changed: Callable[[], None]) -> None:
        """picture: returns the present picture. changed: is called after the user has changed what is drawn."""
        self._picture, self._changed = picture, changed
        self._run = do
        if hint := picture().hint:
            gui.add_markdown(hint)
        self._dark = gui.add_checkbox("Dark", False)
        on_user(self._dark, self._do, self._darken)
        for name, initial in picture().switches.items():
            box = gui.add_checkbox(name.capitalize(), initial)
            on_user(box, self._do, self._switch, name)
        for kind, shown in picture().stage.groups.items():
            prefix = "jnt" if kind == "joint" else kind
            model = picture().rows[0].model
            if not int(getattr(model, _COUNTS[kind])):
                continue
            found = np.clip(np.asarray(getattr(model, f"{prefix}_group")), 0, GROUPS - 1)
            with gui.add_folder(f"Groups of {kind}s", expand_by_default=False):
                for group in sorted({*found.tolist(), 0, 1, 2}):
                    box = gui.add_checkbox(f"{kind}s of group {group}", shown[group])
                    on_user(box, self._do, self._group, kind, group)

    def _do(self, function: Callable[..., None], *arguments: Any) -> None:
        self._run(lambda: function(*arguments))

    def _darken(self, value: bool) -> None:
        self._picture().set_dark(bool(value))

    def _switch(self, name: str, value: bool) -> None:
        self._picture().switches[name] = bool(value)
        self._changed()

    def _group(self, kind: str, group: int, value: bool) -> None:
        self._picture().stage.show_group(kind, group, bool(value))
        self._changed()
