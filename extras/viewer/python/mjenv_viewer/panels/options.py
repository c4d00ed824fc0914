"""The tab with the options of the id. Applying them builds the environment anew."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mjenv
from mjenv import Kind
from mjenv_viewer.panels.common import on_click

if TYPE_CHECKING:
    from mjenv_viewer.session import Session

# Options that the viewer decides: how rows are computed.
_HIDDEN = ("autoreset_mode", "cpu_affinity", "lanes", "max_contacts", "norm", "num_threads")


def _is_shown(option: mjenv.Option) -> bool:
    """Which files are read, and how much they are trusted, the command line decides alone, and no page."""
    names_file = option.name == "trust_xml" or (option.kind == Kind.STRING and not option.choices)
    return option.name not in _HIDDEN and not names_file


class OptionsPanel:
    def __init__(self, gui: Any, session: Session) -> None:
        self._session = session
        schema = mjenv.options(session.id, session.options.get("engine"))
        self._inputs: dict[str, tuple[mjenv.Option, Any]] = {}
        for name, option in schema.items():
            if _is_shown(option):
                self._inputs[name] = option, _input(gui, option, session.options.get(name, option.default))
        apply = gui.add_button("Apply", hint="Build the environment with these options, and reset it")
        defaults = gui.add_button("Defaults", hint="Show the defaults, which Apply then takes")
        on_click(apply, lambda: session.do(lambda: session.rebuild(self._chosen())))
        on_click(defaults, self._show_defaults)

    def _chosen(self) -> dict[str, Any]:
        """The options for make_vec: those that the tab does not show, and those that differ from their defaults."""
        found = {name: value for name, value in self._session.options.items() if name not in self._inputs}
        for name, (option, handle) in self._inputs.items():
            value = _value(option, handle.value)
            if value != option.default:
                found[name] = value
        return found

    def _show_defaults(self) -> None:
        for option, handle in self._inputs.values():
            handle.value = _shown(option, option.default)


def _input(gui: Any, option: mjenv.Option, value: Any) -> Any:
    shown = _shown(option, value)
    if option.kind == Kind.FLAG:
        return gui.add_checkbox(option.name, shown, hint=option.doc)
    if option.choices:
        return gui.add_dropdown(option.name, option.choices, initial_value=shown, hint=option.doc)
    return gui.add_text(option.name, shown, hint=option.doc)


def _shown(option: mjenv.Option, value: Any) -> Any:
    if option.kind == Kind.FLAG:
        return bool(value)
    if isinstance(value, (tuple, list)):
        return ", ".join(map(str, value))
    return str(value)


def _value(option: mjenv.Option, shown: Any) -> Any:
    """The value of an input. Raises an OptionError that names the option."""
    if option.kind == Kind.FLAG:
        return bool(shown)
    text = str(shown).strip()
    try:
        if option.kind == Kind.INTEGER:
            return int(text)
        if option.kind == Kind.REALS:
            numbers = tuple(_number(part) for part in text.split(","))
            return numbers if isinstance(option.default, tuple) or len(numbers) > 1 else numbers[0]
    except ValueError:
        raise mjenv.OptionError(f"option {option.name!r} takes numbers, not {text!r}") from None
    return int(text) if option.kind == Kind.STRING_OR_INT and text.isdigit() else text


def _number(text: str) -> int | float:
    """Keeps ints as ints, because Gymnasium's infos show whether a weight was an int."""
    try:
        return int(text)
    except ValueError:
        return float(text)
