"""The settings of the learner. The library lists them, and knows their defaults and bounds."""

from __future__ import annotations

import numbers
from collections.abc import Iterator, Mapping
from ctypes import byref
from typing import Any

from mjenv import errors
from mjenv.capi.declarations import Kind, Status, mjenv_option
from mjenv.capi.handle import encoded
from mjenv_learn.learner import library, sized, text_of

# Arguments of their own of train and Training.
OWN_ARGUMENTS = ("seed", "threads")


def described() -> dict[str, Any]:
    """The mjenv_option of each setting by its name: its kind, bounds and meaning."""
    found = {}
    for index in range(library().mjenv_learn_setting_count()):
        setting = sized(mjenv_option)
        library().check(library().mjenv_learn_setting_at(index, byref(setting)))
        found[setting.name.decode()] = setting
    return {name: setting for name, setting in found.items() if name not in OWN_ARGUMENTS}


def bounds_of(setting: Any) -> str:
    """The valid values of a setting in words."""
    if setting.choices:
        return str(setting.choices, "ascii").replace(" ", ", ")
    if setting.kind == Kind.FLAG:
        return "true or false"
    low = "greater than 0" if 0 < setting.low < 1e-300 else f"{setting.low:.15g} or more"
    numbers = low if setting.high > 1e15 else f"{setting.low:.15g} to {setting.high:.15g}"
    return f"numbers with commas between them, each {numbers}" if setting.count > 1 else numbers


class Settings(Mapping[str, Any]):
    """The settings of PPO for an id, by their names and as attributes. `mjenv train --help` describes them."""

    def __init__(self, id: str, words: str = "") -> None:
        """words: NAME=VALUE, which replace defaults of the id."""
        self.id = id
        given = encoded(id, "the id"), encoded(words, "the settings")
        text = text_of(library().mjenv_learn_settings, *given).decode()
        values = dict(word.split("=", 1) for word in text.split(" "))
        self._values = {name: _value(setting, values[name]) for name, setting in described().items()}

    @classmethod
    def of(cls, id: str) -> Settings:
        """The tuned settings of a v5 id of Gymnasium; for all other ids one set of defaults."""
        return cls(id)

    def with_values(self, values: Mapping[str, Any]) -> Settings:
        """These settings with some others. Raises an error if there is no such setting, or if a value is not valid."""
        for name in values:
            if name in OWN_ARGUMENTS:
                raise errors.OptionError(f"{name} is an argument of its own, not a setting", Status.E_NAME)
        return Settings(self.id, f"{words_of(self)} {words_of(values)}")

    def __getitem__(self, name: str) -> Any:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __getattr__(self, name: str) -> Any:
        values = self.__dict__.get("_values", {})
        if name not in values:
            raise AttributeError(f"there is no setting {name!r}")
        return values[name]

    def __repr__(self) -> str:
        return f"Settings({self.id!r}, {words_of(self)!r})"


def words_of(values: Mapping[str, Any]) -> str:
    """Settings as the library reads them."""
    return " ".join(f"{name}={_text(name, value)}" for name, value in values.items())


def _text(name: str, value: Any) -> str:
    """A value as text. Raises OptionError if it has blanks, because settings stand between blanks."""
    if hasattr(value, "tolist"):  # NumPy's
        value = value.tolist()
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (list, tuple)):
        return ",".join(_text(name, int(one) if isinstance(one, bool) else one) for one in value)
    text = repr(float(value)) if isinstance(value, numbers.Real) and not isinstance(value, int) else str(value)
    if not isinstance(value, (str, numbers.Real)) or any(letter.isspace() for letter in text):
        raise errors.OptionError(f"the setting {name} cannot be {value!r}", Status.E_TYPE)
    return text


def _value(setting: Any, text: str) -> Any:
    """The value in a text of the library."""
    if setting.kind == Kind.STRING:
        return text
    if setting.kind == Kind.FLAG:
        return text == "true"
    if setting.count > 1:
        return tuple(map(int, text.split(","))) if text else ()
    return float(text) if setting.kind == Kind.REALS else int(text)
