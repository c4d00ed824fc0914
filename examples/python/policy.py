"""Policies as text, for evaluation without a learning library; docs/training.md describes the format.

A policy is evaluated in float64, one operation after the other in a stated order, so that every language gives the
same bits: multiplications and additions are rounded one by one, and tanh is that of the C library.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np

HEAD = "mjenv-policy 1"
ACTIVATIONS = {"tanh": math.tanh, "identity": lambda x: x}


@dataclass(frozen=True)
class Layer:
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
    """Observations to actions: (observation - mean) / scale, clipped, then the layers, then clipped to the bounds."""

    id: str
    mean: list[float]
    scale: list[float]
    clip: float
    low: list[float]
    high: list[float]
    layers: list[Layer]

    def act(self, observation: Sequence[float]) -> np.ndarray[Any, Any]:
        """The deterministic action, float32."""
        values = [
            min(max((x - mean) / scale, -self.clip), self.clip)
            for x, mean, scale in zip(observation, self.mean, self.scale, strict=True)
        ]
        for layer in self.layers:
            values = layer(values)
        bounded = [min(max(x, low), high) for x, low, high in zip(values, self.low, self.high, strict=True)]
        return np.array(bounded, np.float32)

    def save(self, path: Path) -> None:
        with path.open("w") as file:
            print(HEAD, file=file)
            print("id", self.id, file=file)
            for name in ("mean", "scale", "low", "high"):
                _write(file, name, getattr(self, name))
            _write(file, "clip", [self.clip])
            for layer in self.layers:
                print("layer", len(layer.bias), len(layer.weights[0]), layer.activation, file=file)
                _write(file, "bias", layer.bias)
                for row in layer.weights:
                    _write(file, "weights", row)

    @classmethod
    def load(cls, path: Path) -> Policy:
        lines = [line.split() for line in path.read_text().splitlines()]
        if " ".join(lines[0]) != HEAD:
            raise ValueError(f"{path} does not begin with {HEAD!r}")
        numbers: dict[str, list[float]] = {}
        layers: list[Layer] = []
        for name, *words in lines[2:]:
            if name == "layer":
                layers.append(Layer(words[2], [], []))
            elif name == "bias":
                layers[-1].bias.extend(map(float, words))
            elif name == "weights":
                layers[-1].weights.append([*map(float, words)])
            else:
                numbers[name] = [*map(float, words)]
        [clip] = numbers.pop("clip")
        return cls(id=lines[1][1], clip=clip, layers=layers, **numbers)


def _write(file: TextIO, name: str, numbers: Sequence[float]) -> None:
    """The shortest decimal that reads back as the same float64."""
    print(name, *map(repr, numbers), file=file)


def layers_of(*modules: Any) -> list[Layer]:
    """PyTorch's Linear modules with tanh between them."""
    last = len(modules) - 1
    return [
        Layer("identity" if index == last else "tanh", module.weight.tolist(), module.bias.tolist())
        for index, module in enumerate(modules)
    ]
