"""Owners of the handles of libmjenv-learn: Learner, and PolicyHandle."""

from __future__ import annotations

import ctypes
import math
import os
import sys
from collections.abc import Mapping, Sequence
from ctypes import byref, c_char_p, c_double, c_float, c_int64, c_uint8, c_void_p
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mjenv
from mjenv import errors
from mjenv.capi.declarations import Role, mjenv_batch, mjenv_space
from mjenv.capi.dtypes import Float64Array, laid_out
from mjenv.capi.engine import ENGINES, Engine
from mjenv.capi.handle import Rows, encoded, pointer_to
from mjenv.capi.owned import Owned
from mjenv_learn import declarations
from mjenv_learn.declarations import Learned, Precision

FILE = "libmjenv-learn.dll" if sys.platform == "win32" else "libmjenv-learn.so"

# The members of mjenv_learn_calls, each the address of the engine's function of that name.
_CALLS = tuple(name for name, _ in declarations.mjenv_learn_calls._fields_ if name not in ("struct_size", "reserved"))


class Library(declarations.Library):
    """The loaded libmjenv-learn."""

    def check(self, status: int) -> None:
        """Raises unless the status is MJENV_OK."""
        if status:
            raise errors.error_of(status, self.mjenv_learn_last_error().decode("utf-8", "replace"))


@cache
def library() -> Library:
    """The library beside that of the default engine, or inside the package."""
    folders = [Path(ENGINES.get().path).absolute().parent, Path(str(mjenv.__file__)).parent]
    file = next((folder / FILE for folder in folders if (folder / FILE).exists()), None)
    if file is None:
        raise errors.EngineError(f"training and policies need {FILE}, which is not in {' or '.join(map(str, folders))}")
    try:
        loaded = Library(str(file))
    except (AttributeError, OSError) as error:
        raise errors.EngineError(f"{file} is not the library of this package: {error}") from error
    number = loaded.mjenv_learn_abi_version()
    if number != declarations.ABI_VERSION:
        raise errors.EngineError(f"{file} has ABI version {number}; this package needs {declarations.ABI_VERSION}")
    return loaded


def sized(kind: type[Any]) -> Any:
    """A struct of this kind, with its struct_size."""
    value = kind()
    value.struct_size = ctypes.sizeof(kind)
    return value


def calls_of(engine: Engine) -> Any:
    """The functions of an engine that the library calls."""
    calls = sized(declarations.mjenv_learn_calls)
    for name in _CALLS:
        setattr(calls, name, ctypes.cast(getattr(engine, f"mjenv_{name}"), c_void_p).value)
    return calls


class Learner:
    """An owned learner. It steps the rows of an environment itself, or leaves that to the caller (act, feed)."""

    def __init__(self, rows: Rows, settings: str, first: Float64Array | None = None) -> None:
        """settings: words NAME=VALUE. first: the first observations if the caller steps the rows, else None."""
        self._library = library()
        handle = c_void_p()
        self._owned: Owned | None = Owned(self._library.mjenv_learner_destroy, handle)
        self.rows, self.itself = rows, first is None
        if first is None:
            rows.call(self._create, settings.encode(), handle)
        else:
            spaces = (space_of(rows, Role.OBSERVATION), space_of(rows, Role.ACTION))
            # The library, which has no environment here, could not name the actuator.
            for i, field in enumerate(rows.fields(Role.ACTION)):
                low, high = spaces[1].low[i], spaces[1].high[i]
                if not (math.isfinite(low) and math.isfinite(high)):
                    raise errors.InvalidValueError(
                        f"the bounds of action {i} ({field.name}) are {low:g} and {high:g}; a policy needs finite ones "
                        "(ctrlrange in the model)"
                    )
            self._library.check(
                self._library.mjenv_learner_create_apart(
                    byref(spaces[0]),
                    byref(spaces[1]),
                    rows.id.encode(),
                    settings.encode(),
                    pointer_to(first, c_double),
                    first.size,
                    byref(handle),
                )
            )
            self._action = np.zeros((rows.count, spaces[1].count), np.float32)
        self._pointer = handle

    def _create(self, env: int, settings: bytes, handle: c_void_p) -> int:
        calls, id = calls_of(self.rows.engine), self.rows.id.encode()
        self._library.check(self._library.mjenv_learner_create(byref(calls), env, id, settings, byref(handle)))
        return 0

    def close(self) -> None:
        self._owned = None

    def train(self) -> None:
        """Plays a rollout and updates the networks."""
        self.rows.call(self._train)

    def _train(self, env: int) -> int:
        self._library.check(self._library.mjenv_learner_train(self._pointer, 1))
        return 0

    def act(self) -> NDArray[np.float32]:
        """The next actions of all rows, in an array that the next call overwrites."""
        self._library.check(
            self._library.mjenv_learner_act(self._pointer, pointer_to(self._action, c_float), self._action.size)
        )
        return self._action

    def feed(
        self,
        obs: Float64Array,
        final_obs: Float64Array,
        reward: Float64Array,
        terminated: NDArray[np.bool_],
        truncated: NDArray[np.bool_],
    ) -> None:
        """Takes the outcome of the last actions."""
        batch = sized(mjenv_batch)
        batch.obs_dtype, batch.rows, batch.obs_count = 1, len(obs), obs.shape[1]
        batch.obs, batch.final_obs = obs.ctypes.data, final_obs.ctypes.data
        batch.reward = pointer_to(reward, c_double)
        batch.terminated, batch.truncated = pointer_to(terminated, c_uint8), pointer_to(truncated, c_uint8)
        self._library.check(self._library.mjenv_learner_feed(self._pointer, byref(batch)))

    def restart(self, first: Float64Array) -> None:
        """Drops the unfinished rollout, and continues from the first observations of new episodes."""
        self._library.check(self._library.mjenv_learner_restart(self._pointer, pointer_to(first, c_double), first.size))

    def set_rows(self, rows: Rows) -> None:
        """Continues in the rows of another environment."""
        rows.call(self._set_env)
        self.rows = rows

    def _set_env(self, env: int) -> int:
        self._library.check(self._library.mjenv_learner_set_env(self._pointer, env))
        return 0

    def set(self, settings: str) -> None:
        self._library.check(self._library.mjenv_learner_set(self._pointer, settings.encode()))

    def report(self, update: int | None = None) -> Any:
        """The mjenv_learn_report after an update, by default the last."""
        report = sized(declarations.mjenv_learn_report)
        if update is None:
            self._library.check(self._library.mjenv_learner_report(self._pointer, byref(report)))
        else:
            self._library.check(self._library.mjenv_learner_report_at(self._pointer, update, byref(report)))
        return report

    def save(self, path: str | os.PathLike[str], note: str = "") -> None:
        """note: a text that note_of reads."""
        self._library.check(self._library.mjenv_learner_save(self._pointer, _path(path), note.encode()))

    def load(self, path: str | os.PathLike[str]) -> None:
        if self.itself:
            self.rows.call(self._load, _path(path))
        else:
            self._load(0, _path(path))

    def _load(self, env: int, path: bytes) -> int:
        self._library.check(self._library.mjenv_learner_load(self._pointer, path))
        return 0

    def describe(self, about: str, terms: Mapping[str, int]) -> None:
        """Says what the policies tell of the environment: a line of text, and the terms of the observation with their
        counts."""
        names, counts = _arrays(terms)
        self._library.check(
            self._library.mjenv_learner_describe(self._pointer, about.encode(), names, counts, len(terms))
        )

    def policy(self, which: Learned) -> str:
        """The text of a policy."""
        return text_of(self._library.mjenv_learner_policy, self._pointer, which).decode()


def _arrays(terms: Mapping[str, int]) -> tuple[Any, Any]:
    """The names and the counts as arrays of C."""
    names = (c_char_p * len(terms))(*[name.encode() for name in terms])
    return names, (c_int64 * len(terms))(*terms.values())


def terms_of(rows: Rows) -> dict[str, int]:
    """The terms of the observation, with their counts."""
    return {field.name: field.count for field in rows.fields(Role.OBSERVATION)}


def _path(path: str | os.PathLike[str]) -> bytes:
    return encoded(os.fsdecode(path), "the path")


def note_of(path: str | os.PathLike[str]) -> bytes:
    """The note in a checkpoint."""
    return text_of(library().mjenv_checkpoint_note, _path(path))


def text_of(function: Any, *arguments: Any) -> bytes:
    """The text that a function of the library delivers."""
    size = c_int64()
    library().check(function(*arguments, None, 0, byref(size)))
    text = ctypes.create_string_buffer(size.value)
    library().check(function(*arguments, text, size.value, byref(size)))
    return text.value


def space_of(rows: Rows, role: Role) -> Any:
    """The mjenv_space of a role. Its bounds belong to the environment."""
    if not isinstance(rows, Rows):  # an OtherVector
        return rows.space(role)
    space = sized(mjenv_space)
    rows.call(rows.engine.mjenv_space_of, role, byref(space))
    return space


class PolicyHandle:
    """An owned policy of the library."""

    def __init__(self, text: str) -> None:
        content = text.encode("utf-8", "surrogatepass")
        self._hold(library().mjenv_policy_parse, content, len(content))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> PolicyHandle:
        policy = cls.__new__(cls)
        policy._hold(library().mjenv_policy_load, _path(path))
        return policy

    def _hold(self, function: Any, *arguments: Any) -> None:
        self._library = library()
        handle = c_void_p()
        self._owned = Owned(self._library.mjenv_policy_destroy, handle)
        self._library.check(function(*arguments, byref(handle)))
        self._pointer = handle

    @property
    def id(self) -> str:
        return str(self._library.mjenv_policy_id(self._pointer), "ascii")

    def sizes(self) -> tuple[int, int]:
        """How many numbers an observation has, and how many an action."""
        sizes = c_int64(), c_int64()
        self._library.check(self._library.mjenv_policy_sizes(self._pointer, byref(sizes[0]), byref(sizes[1])))
        return sizes[0].value, sizes[1].value

    def spec(self) -> Any:
        """The mjenv_policy_spec. Its arrays belong to this policy."""
        spec = sized(declarations.mjenv_policy_spec)
        self._library.check(self._library.mjenv_policy_spec_of(self._pointer, byref(spec)))
        return spec

    def layer(self, index: int) -> Any:
        """The mjenv_policy_layer. Its arrays belong to this policy."""
        layer = sized(declarations.mjenv_policy_layer)
        self._library.check(self._library.mjenv_policy_layer_at(self._pointer, index, byref(layer)))
        return layer

    def input(self, index: int) -> Any:
        """The mjenv_policy_input. Its array belongs to this policy."""
        found = sized(declarations.mjenv_policy_input)
        self._library.check(self._library.mjenv_policy_input_at(self._pointer, index, byref(found)))
        return found

    def find(self, terms: Mapping[str, int]) -> list[int]:
        """Where the numbers that the policy sees are in an observation of these terms."""
        places = (c_int64 * self.sizes()[0])()
        names, counts = _arrays(terms)
        self._library.check(
            self._library.mjenv_policy_find(self._pointer, names, counts, len(terms), places, len(places))
        )
        return [*places]

    def act(self, obs: Float64Array, actuators: int, precision: Precision) -> NDArray[np.float32]:
        """The actions (rows, actuators) for observations (rows, n)."""
        obs = laid_out(obs, np.float64)
        action = np.zeros((len(obs), actuators), np.float32)
        self._library.check(
            self._library.mjenv_policy_act(
                self._pointer,
                precision,
                len(obs),
                pointer_to(obs, c_double),
                obs.size,
                pointer_to(action, c_float),
                action.size,
            )
        )
        return action

    def evaluate(
        self, rows: Rows, precision: Precision, seed: int, episodes: int
    ) -> tuple[Float64Array, NDArray[np.int64]]:
        """Plays episodes in an environment with autoreset_mode "disabled". Returns their returns and lengths."""
        returns, lengths = np.zeros(episodes), np.zeros(episodes, np.int64)
        rows.call(self._evaluate, calls_of(rows.engine), (precision, seed, episodes), (returns, lengths))
        return returns, lengths

    def _evaluate(self, env: int, calls: Any, how: Sequence[int], results: tuple[Any, Any]) -> int:
        returns, lengths = results
        precision, seed, episodes = how
        self._library.check(
            self._library.mjenv_evaluate(
                byref(calls),
                env,
                self._pointer,
                precision,
                seed,
                episodes,
                pointer_to(returns, c_double),
                pointer_to(lengths, c_int64),
            )
        )
        return 0
