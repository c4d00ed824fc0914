"""Policies as text, for evaluation without a learning library, here and in C++ (examples/cpp/deploy.cpp).

A policy is evaluated in float64. The order of the operations is fixed, each multiplication and addition is rounded, and
tanh is that of the C library, so that every language gives the same bits. docs/training.md describes the format.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv._abi import Status
from mjenv.errors import InvalidValueError

HEAD = "mjenv-policy 1"
ACTIVATIONS: dict[str, Callable[[float], float]] = {
    "tanh": math.tanh,
    "relu": lambda x: max(x, 0.0),
    "elu": lambda x: x if x > 0 else math.expm1(x),
    "identity": float,
}


@dataclass(frozen=True)
class Layer:
    """Computes activation(bias + weights x inputs). Each sum adds its terms from left to right."""

    activation: str
    weights: list[list[float]]  # [outputs][inputs]
    bias: list[float]

    def __call__(self, inputs: list[float]) -> list[float]:
        activate = ACTIVATIONS[self.activation]
        outputs = []
        for row, bias in zip(self.weights, self.bias, strict=True):
            total = bias
            for weight, value in zip(row, inputs, strict=True):
                total += weight * value
            outputs.append(activate(total))
        return outputs


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

    def act(self, observation: Sequence[float]) -> NDArray[np.float32]:
        """The deterministic action."""
        values = [
            min(max((x - mean) / scale, -self.clip), self.clip)
            for x, mean, scale in zip(observation, self.mean, self.scale, strict=True)
        ]
        for layer in self.layers:
            values = layer(values)
        bounded = [min(max(x, low), high) for x, low, high in zip(values, self.low, self.high, strict=True)]
        return np.array(bounded, np.float32)

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
        """Writes the policy; load gives back every bit."""
        Path(path).write_text(self.text())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Policy:
        """Reads a policy. Raises InvalidValueError if the file holds none."""
        try:
            text = Path(path).read_text()
        except UnicodeDecodeError as error:
            raise InvalidValueError(f"{path} is no policy: {error}", Status.E_VALUE) from error
        return cls.parse(text, str(path))

    @classmethod
    def parse(cls, text: str, name: str = "the text") -> Policy:
        """Reads a policy from text. name: what error messages call the text."""
        try:
            policy = cls._parse(text.splitlines())
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise InvalidValueError(f"{name} is no policy: {error}", Status.E_VALUE) from error
        if not policy._fits():
            raise InvalidValueError(f"{name} is no policy: its arrays do not fit each other", Status.E_SIZE)
        return policy

    @classmethod
    def _parse(cls, lines: list[str]) -> Policy:
        if lines[0] != HEAD:
            raise ValueError(f"it does not begin with {HEAD!r}")
        numbers: dict[str, list[float]] = {}
        layers: list[Layer] = []
        for name, *words in map(str.split, lines[2:]):
            if name == "layer":
                layers.append(Layer(words[2], [], []))
            elif name == "bias":
                layers[-1].bias.extend(map(float, words))
            elif name == "weights":
                layers[-1].weights.append([*map(float, words)])
            else:
                numbers[name] = [*map(float, words)]
        [clip] = numbers.pop("clip")
        return cls(id=lines[1].removeprefix("id "), clip=clip, layers=layers, **numbers)

    def _fits(self) -> bool:
        width = len(self.mean)
        for layer in self.layers:
            if layer.activation not in ACTIVATIONS or len(layer.weights) != len(layer.bias):
                return False
            if any(len(row) != width for row in layer.weights):
                return False
            width = len(layer.bias)
        return len(self.scale) == len(self.mean) and len(self.low) == len(self.high) == width


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
