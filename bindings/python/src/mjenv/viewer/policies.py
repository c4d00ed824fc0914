"""Policies that act in all rows at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.policy import ACTIVATIONS, Policy

Array = NDArray[Any]


def in_all_rows(policy: Policy) -> Callable[[Array], Array]:
    """The actions of a text policy for the observations [rows, n], with the bits of policy.act.

    Policy.act adds the terms of a sum one by one. Here each addition adds arrays over all rows and outputs, in the same
    order.
    """
    layers = [(np.array(layer.weights), np.array(layer.bias), layer.activation) for layer in policy.layers]
    mean, scale = np.array(policy.mean), np.array(policy.scale)
    low, high = np.array(policy.low), np.array(policy.high)
    functions = {
        name: np.frompyfunc(function, 1, 1) for name, function in ACTIVATIONS.items()
    }  # because NumPy's functions give other bits

    def act(observations: Array) -> Array:
        values = np.minimum(np.maximum((observations - mean) / scale, -policy.clip), policy.clip)
        for weights, bias, activation in layers:
            total = np.tile(bias, (len(values), 1))
            for index in range(weights.shape[1]):
                total += weights[:, index] * values[:, index, None]
            values = total if activation == "identity" else functions[activation](total).astype(float)
        bounded: Array = np.minimum(np.maximum(values, low), high).astype(np.float32)
        return bounded

    return act
