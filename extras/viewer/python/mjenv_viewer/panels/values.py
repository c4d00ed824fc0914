"""The tab that multiplies values of the model, as mjenv randomize does at resets."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mjenv_viewer.panels.common import on_click, on_user

if TYPE_CHECKING:
    from mjenv_viewer.session import Session

Array = NDArray[Any]

# For each slider: its label, the arrays that it multiplies, their columns (None: all), and whether mj_setConst must
# then compute again what MuJoCo derives from them.
SCALED: dict[str, tuple[tuple[str, ...], int | None, bool]] = {
    "Masses": (("body_mass", "body_inertia"), None, True),
    "Friction": (("geom_friction",), 0, False),
    "Damping": (("dof_damping",), None, False),
    "Strength": (("actuator_gear",), None, False),
    "Stiffness": (("jnt_stiffness",), None, False),
    "Gravity": (("opt.gravity",), None, False),
}
_LEAST = {"Gravity": 0.0}  # the other values stay positive
_MOST = 4.0


class ValuesPanel:
    def __init__(self, gui: Any, session: Session) -> None:
        self._session = session
        gui.add_markdown("Factors of the model's own values, in all rows. Resets keep them.")
        model = session.envs.envs[0].model
        self._own: dict[str, Array] = {}
        self._factors: dict[str, float] = {}
        self._sliders: dict[str, Any] = {}
        for label, (arrays, _, _) in SCALED.items():
            if np.asarray(_of(model, arrays[0])).any():
                least, hint = _LEAST.get(label, 0.05), f"{' and '.join(arrays)}, scaled"
                self._sliders[label] = gui.add_slider(label, least, _MOST, 0.05, 1.0, hint=hint)
        self._text = gui.add_markdown("")
        own = gui.add_button("The model's own values")
        for label, slider in self._sliders.items():
            on_user(slider, self._asked, label)
        on_click(own, lambda: session.do(self._reset))
        self.forget()

    def _asked(self, label: str, factor: float) -> None:
        self._session.do(lambda: self.scale(label, float(factor)))

    def forget(self) -> None:
        """Called when the environment was replaced by one with the model's own values."""
        model = self._session.envs.envs[0].model
        self._factors = {}
        self._own = {array: np.array(_of(model, array)) for label in self._sliders for array in SCALED[label][0]}
        for slider in self._sliders.values():
            slider.value = 1.0
        self._show()

    def scale(self, label: str, factor: float) -> None:
        """Multiplies values of the model by a factor, in all rows."""
        self._factors[label] = factor
        arrays, column, derived = SCALED[label]
        envs = self._session.envs

        def write() -> None:
            for array in arrays:
                values = self._own[array].copy()
                if column is None:
                    values = values * factor
                else:
                    values[:, column] *= factor
                owner, name = (envs.model.opt, array.removeprefix("opt.")) if "." in array else (envs.model, array)
                setattr(owner, name, np.broadcast_to(values, (envs.num_envs, *values.shape)))

        if derived:
            self._keep_state(write)
        else:
            write()
        self._session.changed()
        self._show()

    def _keep_state(self, write: Callable[[], None]) -> None:
        """mj_setConst leaves the rows in another position, so their states are set again."""
        envs = self._session.envs
        qpos, qvel = np.array(envs.data.qpos), np.array(envs.data.qvel)
        write()
        envs.set_constants()
        envs.set_state(qpos, qvel)

    def _reset(self) -> None:
        for label, slider in self._sliders.items():
            slider.value = 1.0
            if self._factors.get(label, 1.0) != 1.0:
                self.scale(label, 1.0)

    def _show(self) -> None:
        """Shows the factors that are not 1 as arguments of mjenv randomize."""
        lines = []
        for label, factor in self._factors.items():
            if factor == 1.0:
                continue
            arrays, column, derived = SCALED[label]
            for array in arrays:
                parts = [f"{array}=scale", f"{min(factor, 1.0):.2f}", f"{max(factor, 1.0):.2f}"]
                parts += [f"columns={column}"] if column is not None else []
                parts += ["set_constants"] if derived else []
                lines.append(":".join(parts))
        text = "\n".join(lines)
        self._text.content = f"As draws of `mjenv randomize`:\n```\n{text}\n```" if lines else ""


def _of(model: Any, array: str) -> Any:
    owner, _, name = array.rpartition(".")
    return getattr(getattr(model, owner) if owner else model, name)
