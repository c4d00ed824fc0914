"""Policies as text, for evaluation without a learning library, here and in C++ (examples/cpp/deploy.cpp).

A policy is evaluated in float64. The order of the operations is fixed, each multiplication and addition is rounded, and
tanh is that of the C library, so that every language gives the same bits. docs/training.md describes the format.
"""

from __future__ import annotations

import json
import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi.declarations import Status
from mjenv.capi.dtypes import Float64Array
from mjenv.capi.engine import ENGINES
from mjenv.capi.handle import Options, open_rows, spec_of
from mjenv.capi.keywords import RANDOMIZING
from mjenv.errors import InvalidValueError
from mjenv.registration import own_id
from mjenv_learn import saved
from mjenv_learn.learner import PolicyHandle, terms_of

HEADS = ("mjenv-policy 1", "mjenv-policy 2")  # the second has names
ACTIVATIONS: dict[str, Callable[[float], float]] = {
    "tanh": math.tanh,
    "relu": lambda x: max(x, 0.0),
    "elu": lambda x: x if x > 0 else math.expm1(x),
    "identity": float,
}


SEEN = ("policy", "actor")  # the group that a policy sees if it does not see all groups


@dataclass(frozen=True)
class Layer:
    """Computes activation(bias + weights x inputs). Each sum adds its terms from left to right."""

    activation: str
    weights: list[list[float]]  # [outputs][inputs]
    bias: list[float]

    def __call__(self, inputs: Float64Array) -> Float64Array:
        """The outputs [rows, outputs] for the inputs [rows, inputs]."""
        totals = np.tile(np.array(self.bias, np.float64), (len(inputs), 1))
        for weights, values in zip(self._columns, inputs.T, strict=True):
            totals += weights * values[:, None]
        return totals if self.activation == "identity" else self._activate(totals).astype(np.float64)

    @cached_property
    def _columns(self) -> Float64Array:
        return np.array(self.weights, np.float64).T

    @cached_property
    def _activate(self) -> np.ufunc:
        return np.frompyfunc(ACTIVATIONS[self.activation], 1, 1)  # because NumPy's functions give other bits


@dataclass(frozen=True)
class Input:
    """A term of the observation that a policy sees: its `count` numbers, or some of them."""

    name: str
    count: int
    elements: tuple[int, ...] = ()  # which of them; (): all


@dataclass(frozen=True)
class Policy:
    """Turns an observation into an action: (observation - mean) / scale is clipped, goes through the layers, and is
    clipped to the bounds of the action.

    inputs: the terms that it sees, one after the other; [] if they are unknown. about: what the environment was made
    with: "engine", "options" and the "revision" of the task.
    """

    id: str
    mean: list[float]
    scale: list[float]
    clip: float
    low: list[float]
    high: list[float]
    layers: list[Layer]
    inputs: list[Input] = field(default_factory=list)
    about: dict[str, Any] = field(default_factory=dict)

    def act(self, observation: Any) -> NDArray[np.float32]:
        """The deterministic action, or the actions [rows, actuators] for the observations of many rows.

        observation: what the environment returns, an array (or a list) or a dict of groups or terms. If the policy sees
        less than all of them together, it sees the terms that it names, or else the group "policy" (or "actor").
        """
        rows, single = self._rows_of(observation, len(self.mean))
        return self._act(rows, single)

    def acting_in(self, env: Any) -> Callable[[Any], NDArray[np.float32]]:
        """The function `act` for whole observations of an environment, in which it finds by their names the terms that
        the policy sees."""
        if not self.inputs:
            return self.act
        terms = terms_of(env.unwrapped.handle)
        places, size = PolicyHandle(self.text()).find(terms), sum(terms.values())

        def act(observation: Any) -> NDArray[np.float32]:
            rows, single = self._rows_of(observation, size)
            return self._act(rows[:, places], single)

        return act

    def keywords(self, **given: Any) -> dict[str, Any]:
        """The keywords of make for the environment in which the policy was trained, of which `given` replaces some. A
        model that only the policy names is read with trust_xml="no"."""
        options, engine = self.about.get("options", {}), self.about.get("engine")
        if not isinstance(options, dict) or not isinstance(engine, (str, type(None))):
            raise InvalidValueError(f"this policy of {self.id} has options or an engine of a wrong type")
        theirs = {name: value for name, value in options.items() if name not in saved.RUNNING}
        library = ENGINES.get(given.get("engine", engine))
        for name in theirs.keys() - {*Options(library, own_id(self.id)).schema(), *RANDOMIZING}:
            raise InvalidValueError(f"this policy names the option {name!r}, which {self.id} does not have")
        if any(name in given for name in saved.MODEL_OPTIONS):
            theirs = {name: value for name, value in theirs.items() if name not in saved.MODEL_OPTIONS}
        made = {**saved.without_trust(theirs), **({} if engine is None else {"engine": engine}), **given}
        revision = spec_of(library, own_id(self.id)).revision
        if self.about.get("revision", revision) != revision:
            text = f"this policy of {self.id} is of the revision {self.about['revision']!r} of the task, not {revision}"
            warnings.warn(text, stacklevel=2)
        return made

    def _act(self, rows: Float64Array, single: bool) -> NDArray[np.float32]:
        with np.errstate(all="ignore"):
            values = _bounded((rows - self.mean) / self.scale, -self.clip, self.clip)
            for layer in self.layers:
                values = layer(values)
            actions = _bounded(values, self.low, self.high).astype(np.float32)
        return actions[0] if single else actions

    def _rows_of(self, observation: Any, size: int) -> tuple[Float64Array, bool]:
        """An observation of `size` numbers as [rows, size], and whether it is that of a single environment."""
        for parts in self._choices(observation):
            arrays = [np.asarray(part, np.float64) for part in parts]
            sizes = [math.prod(array.shape[1:]) for array in arrays]  # if there are many rows
            counts = {len(array) if array.ndim > 1 else None for array in arrays}
            if sum(sizes) == size and len(counts) == 1 and None not in counts:
                return np.concatenate([a.reshape(len(a), n) for a, n in zip(arrays, sizes, strict=True)], axis=1), False
            if sum(array.size for array in arrays) == size:
                return np.concatenate([array.reshape(1, -1) for array in arrays], axis=1), True
        shapes = ", ".join(str(np.shape(part)) for part in next(self._choices(observation)))
        names = ", ".join(f"{one.name} ({len(one.elements) or one.count})" for one in self.inputs)
        raise InvalidValueError(
            f"this policy of {self.id} sees {size} numbers{names and f' ({names})'}, not an observation of the shape "
            f"{shapes}",
            Status.E_SIZE,
        )

    def _choices(self, observation: Any) -> Iterator[list[Any]]:
        """The parts of an observation that the policy may see: all of them, those that it names, or one group."""
        if not isinstance(observation, Mapping):
            yield [observation]
            return
        yield [*observation.values()]
        if self.inputs and all(one.name in observation and not one.elements for one in self.inputs):
            yield [observation[one.name] for one in self.inputs]
        yield from ([observation[name]] for name in SEEN if name in observation)

    def text(self) -> str:
        """The policy as text; parse gives back every bit."""
        lines = [HEADS[bool(self.inputs)], f"id {self.id}"]
        if self.inputs and self.about:
            lines += [f"about {json.dumps(self.about)}"]
        lines += [" ".join(map(str, ("input", one.name, one.count, *one.elements))) for one in self.inputs]
        lines += [_line(name, getattr(self, name)) for name in ("mean", "scale", "low", "high")]
        lines += [_line("clip", [self.clip])]
        for layer in self.layers:
            lines += [f"layer {len(layer.bias)} {len(layer.weights[0])} {layer.activation}", _line("bias", layer.bias)]
            lines += [_line("weights", row) for row in layer.weights]
        return "\n".join([*lines, ""])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the policy; load gives back every bit. Raises InvalidValueError if load would refuse it."""
        text = self.text()
        PolicyHandle(text)
        saved.replace(Path(path), text)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Policy:
        """Reads a policy. Raises InvalidValueError if the file holds none."""
        return cls._of(PolicyHandle.load(path))

    @classmethod
    def parse(cls, text: str) -> Policy:
        """Reads a policy from text."""
        return cls._of(PolicyHandle(text))

    @classmethod
    def _of(cls, policy: PolicyHandle) -> Policy:
        (observations, actuators), spec = policy.sizes(), policy.spec()
        inputs = [policy.input(index) for index in range(spec.input_count)]
        return cls(
            id=policy.id,
            mean=spec.mean[:observations],
            scale=spec.scale[:observations],
            clip=spec.clip,
            low=spec.low[:actuators],
            high=spec.high[:actuators],
            layers=[_layer(policy.layer(index)) for index in range(spec.layer_count)],
            inputs=[
                Input(
                    one.name.decode("utf-8", "replace"),
                    one.count,
                    tuple(one.elements[: one.seen] if one.elements else ()),
                )
                for one in inputs
            ],
            about=_about(spec.about.decode()),
        )


def _layer(layer: Any) -> Layer:
    """The Layer of an mjenv_policy_layer, whose weights are [inputs][outputs]."""
    weights = layer.weights[: layer.inputs * layer.outputs]
    rows = [weights[output :: layer.outputs] for output in range(layer.outputs)]
    return Layer(layer.activation.decode(), rows, layer.bias[: layer.outputs])


def _about(text: str) -> dict[str, Any]:
    """What a policy tells of its environment. Anyone can have written it."""
    try:
        about = json.loads(text or "{}")
    except (RecursionError, ValueError) as error:
        raise InvalidValueError(f"the text is no policy: about is no JSON: {error}") from None
    if not isinstance(about, dict):
        raise InvalidValueError("the text is no policy: about is no object {...}")
    return about


def _bounded(values: Float64Array, low: Any, high: Any) -> Float64Array:
    """As std::clamp, also for -0, whose sign np.clip and np.maximum may change."""
    values = np.where(values < low, low, values)
    return np.where(values > high, high, values)


def _line(name: str, numbers: Sequence[float]) -> str:
    """A name, and numbers as the shortest decimals that read back as the same float64."""
    return " ".join([name, *map(repr, numbers)])


def needs_of(id: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """The members `inputs` and `about` of a policy that was trained on whole observations of this environment, or of
    Gymnasium's of the same id, whose observations are equal."""
    engine = ENGINES.get(None)
    rows = open_rows(engine, own_id(id), options)
    inputs = [Input(name, count) for name, count in terms_of(rows).items()]
    rows.close()
    plain = json.loads(json.dumps(dict(options), default=saved.plain))
    revision = spec_of(engine, own_id(id)).revision
    return {"inputs": inputs, "about": {"engine": engine.name, "options": plain, "revision": revision}}


def layers_of(*modules: Any) -> list[Layer]:
    """The layers for PyTorch's Linear modules with tanh between them.

    Each number becomes the shortest decimal that reads back as the same float32, which halves the length of the file.
    """
    last = len(modules) - 1
    return [
        Layer(
            "identity" if index == last else "tanh",
            [_shortest(row) for row in module.weight.detach().cpu().numpy()],
            _shortest(module.bias.detach().cpu().numpy()),
        )
        for index, module in enumerate(modules)
    ]


def _shortest(numbers: NDArray[np.float32]) -> list[float]:
    return [float(str(number)) for number in numbers]
