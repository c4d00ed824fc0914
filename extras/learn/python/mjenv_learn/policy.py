"""Policies as text, for evaluation without a learning library, here and in C++ (examples/cpp/deploy.cpp).

A policy is evaluated in float64. The order of the operations is fixed, each multiplication and addition is rounded, and
tanh is that of the C library, so that every language gives the same bits. docs/training.md describes the format.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi.declarations import Status
from mjenv.capi.dtypes import Float64Array
from mjenv.errors import InvalidValueError
from mjenv_learn import saved
from mjenv_learn.learner import PolicyHandle

HEAD = "mjenv-policy 1"
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
class Policy:
    """Turns an observation into an action: (observation - mean) / scale is clipped, goes through the layers, and is
    clipped to the bounds of the action."""

    id: str
    mean: list[float]
    scale: list[float]
    clip: float
    low: list[float]
    high: list[float]
    layers: list[Layer]

    def act(self, observation: Any) -> NDArray[np.float32]:
        """The deterministic action, or the actions [rows, actuators] for the observations of many rows.

        observation: what the environment returns, an array (or a list) or a dict of groups. If the policy sees less
        than all groups together, it sees the group "policy" (or "actor").
        """
        rows, single = self._seen(observation)
        with np.errstate(all="ignore"):
            values = _bounded((rows - self.mean) / self.scale, -self.clip, self.clip)
            for layer in self.layers:
                values = layer(values)
            actions = _bounded(values, self.low, self.high).astype(np.float32)
        return actions[0] if single else actions

    def _seen(self, observation: Any) -> tuple[Float64Array, bool]:
        """What the policy sees [rows, numbers], and whether it is the observation of a single environment."""
        size = len(self.mean)
        for parts in _choices(observation):
            arrays = [np.asarray(part, np.float64) for part in parts]
            sizes = [math.prod(array.shape[1:]) for array in arrays]  # if there are many rows
            counts = {len(array) if array.ndim > 1 else None for array in arrays}
            if sum(sizes) == size and len(counts) == 1 and None not in counts:
                return np.concatenate([a.reshape(len(a), n) for a, n in zip(arrays, sizes, strict=True)], axis=1), False
            if sum(array.size for array in arrays) == size:
                return np.concatenate([array.reshape(1, -1) for array in arrays], axis=1), True
        shapes = ", ".join(str(np.shape(part)) for part in next(_choices(observation)))
        raise InvalidValueError(
            f"this policy of {self.id} sees {size} numbers, not an observation of the shape {shapes}", Status.E_SIZE
        )

    def text(self) -> str:
        """The policy as text; parse gives back every bit."""
        lines = [HEAD, f"id {self.id}"]
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
        return cls(
            id=policy.id,
            mean=spec.mean[:observations],
            scale=spec.scale[:observations],
            clip=spec.clip,
            low=spec.low[:actuators],
            high=spec.high[:actuators],
            layers=[_layer(policy.layer(index)) for index in range(spec.layer_count)],
        )


def _layer(layer: Any) -> Layer:
    """The Layer of an mjenv_policy_layer, whose weights are [inputs][outputs]."""
    weights = layer.weights[: layer.inputs * layer.outputs]
    rows = [weights[output :: layer.outputs] for output in range(layer.outputs)]
    return Layer(layer.activation.decode(), rows, layer.bias[: layer.outputs])


def _choices(observation: Any) -> Iterator[list[Any]]:
    """The parts of an observation that a policy may see: all of them, or one group."""
    if not isinstance(observation, Mapping):
        yield [observation]
        return
    yield [*observation.values()]
    yield from ([observation[name]] for name in SEEN if name in observation)


def _bounded(values: Float64Array, low: Any, high: Any) -> Float64Array:
    """As std::clamp, also for -0, whose sign np.clip and np.maximum may change."""
    values = np.where(values < low, low, values)
    return np.where(values > high, high, values)


def _line(name: str, numbers: Sequence[float]) -> str:
    """A name, and numbers as the shortest decimals that read back as the same float64."""
    return " ".join([name, *map(repr, numbers)])


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
