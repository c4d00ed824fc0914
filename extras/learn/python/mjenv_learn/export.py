"""mjenv export: writes a policy as a C header for devices on which no library runs, or as ONNX."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mjenv.errors import OptionError
from mjenv_command.arguments import Commands
from mjenv_learn import saved
from mjenv_learn.policy import Input, Policy

# C's expressions with the bits of ACTIVATIONS in policy.py.
ACTIVATIONS = {"tanh": "tanh(y)", "relu": "y < 0 ? 0 : y", "elu": "y > 0 ? y : expm1(y)"}

HEAD = """\
/* The policy of {id}, written by mjenv export. It needs the C library's math.h, and no other file.
{inputs} *
 *     double observation[MJENV_POLICY_OBSERVATIONS];
 *     float action[MJENV_POLICY_ACTIONS];
 *     mjenv_policy_act(observation, action);
 *
 * The actions have the bits of Policy.act in Python if the C library has the same tanh and expm1. Compile with
 * -ffp-contract=off, because a fused multiply-add rounds once where the policy rounds twice. */
#include <math.h>

#define MJENV_POLICY_OBSERVATIONS {observations}
#define MJENV_POLICY_ACTIONS {actions}

static inline double mjenv_policy_bounded(double x, double low, double high) {{
  const double raised = x < low ? low : x;
  return high < raised ? high : raised;
}}

/* to[outputs] = bias + weights[outputs][inputs] * from[inputs] */
static inline void mjenv_policy_layer(int outputs, int inputs, const double *bias, const double *weights,
                                      const double *from, double *to) {{
  for (int o = 0; o < outputs; ++o) {{
    double sum = bias[o];
    for (int i = 0; i < inputs; ++i) sum += weights[o * inputs + i] * from[i];
    to[o] = sum;
  }}
}}

static inline void mjenv_policy_act(const double *observation, float *action) {{
"""
TAIL = """\
  for (int i = 0; i < MJENV_POLICY_ACTIONS; ++i)
    action[i] = (float)mjenv_policy_bounded(x{last}[i], low[i], high[i]);
}}
"""


def header(policy: Policy) -> str:
    """The C header of a policy, which load or parse has read: its numbers are finite, and its id has one line."""
    seen = "".join(f" * It sees {one.name}, {one.count} numbers{_elements(one)}.\n" for one in policy.inputs)
    id, inputs = (text.replace("*/", "* /") for text in (policy.id, seen))  # a stranger may have written them
    head = HEAD.format(id=id, inputs=inputs, observations=len(policy.mean), actions=len(policy.low))
    return head + "\n".join(_lines(policy)) + "\n" + TAIL.format(last=len(policy.layers))


def _elements(one: Input) -> str:
    return f", of which {', '.join(map(str, one.elements))}" if one.elements else ""


def _lines(policy: Policy) -> Iterator[str]:
    for name in ("mean", "scale", "low", "high"):
        yield _array(name, getattr(policy, name))
    for index, layer in enumerate(policy.layers, 1):
        yield _array(f"bias{index}", layer.bias)
        yield _array(f"weights{index}", [weight for row in layer.weights for weight in row])
    widths = [len(policy.mean), *(len(layer.bias) for layer in policy.layers)]
    yield f"  double {', '.join(f'x{index}[{width}]' for index, width in enumerate(widths))};"
    yield "  for (int i = 0; i < MJENV_POLICY_OBSERVATIONS; ++i)"
    yield f"    x0[i] = mjenv_policy_bounded((observation[i] - mean[i]) / scale[i], {-policy.clip!r}, {policy.clip!r});"
    for index, layer in enumerate(policy.layers, 1):
        sizes = f"{widths[index]}, {widths[index - 1]}"
        yield f"  mjenv_policy_layer({sizes}, bias{index}, weights{index}, x{index - 1}, x{index});"
        if layer.activation != "identity":
            yield f"  for (int i = 0; i < {widths[index]}; ++i) {{"
            yield f"    const double y = x{index}[i];"
            yield f"    x{index}[i] = {ACTIVATIONS[layer.activation]};"
            yield "  }"


def _array(name: str, numbers: Sequence[float]) -> str:
    """A constant array, whose decimals read back as the same float64."""
    lines = [", ".join(map(repr, numbers[at : at + 6])) for at in range(0, len(numbers), 6)]
    return f"  static const double {name}[{len(numbers)}] = {{\n    " + ",\n    ".join(lines) + "};"


def onnx_model(policy: Policy) -> Any:
    """The policy as an onnx.ModelProto: float64 observations [rows, n] become float32 actions."""
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    nodes, constants = [], []

    def constant(name: str, values: Any) -> str:
        constants.append(numpy_helper.from_array(np.array(values, np.float64), name))
        return name

    def add(operator: str, output: str, *inputs: str, **attributes: Any) -> str:
        nodes.append(helper.make_node(operator, inputs, [output], **attributes))
        return output

    def bounded(name: str, values: str, low: Any, high: Any) -> str:
        raised = add("Max", f"{name}_raised", values, constant(f"{name}_low", low))
        return add("Min", name, raised, constant(f"{name}_high", high))

    centred = add("Sub", "centred", "observation", constant("mean", policy.mean))
    scaled = add("Div", "scaled", centred, constant("scale", policy.scale))
    values = bounded("clipped", scaled, [-policy.clip], [policy.clip])
    for index, layer in enumerate(policy.layers, 1):
        numbers = constant(f"weights{index}", layer.weights), constant(f"bias{index}", layer.bias)
        values = add("Gemm", f"sum{index}", values, *numbers, transB=1)
        if layer.activation in ("tanh", "relu"):
            values = add(layer.activation.title(), f"layer{index}", values)
        elif layer.activation == "elu":  # of Elu, runtimes have float32 alone
            zero, one = constant(f"zero{index}", [0.0]), constant(f"one{index}", [1.0])
            below = add("Sub", f"below{index}", add("Exp", f"exp{index}", add("Min", f"min{index}", values, zero)), one)
            values = add("Add", f"layer{index}", add("Max", f"max{index}", values, zero), below)
    add("Cast", "action", bounded("bounded", values, policy.low, policy.high), to=TensorProto.FLOAT)
    ends = [
        [helper.make_tensor_value_info(name, kind, ["rows", count])]
        for name, kind, count in (
            ("observation", TensorProto.DOUBLE, len(policy.mean)),
            ("action", TensorProto.FLOAT, len(policy.low)),
        )
    ]
    graph = helper.make_graph(nodes, "policy", *ends, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    known = {"id": policy.id, "about": json.dumps(policy.about)}
    known |= {"inputs": "\n".join(f"{one.name} {one.count}{_elements(one)}" for one in policy.inputs)}
    helper.set_model_props(model, known)
    onnx.checker.check_model(model)
    return model


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "export",
        help="write a policy as a C header, or as ONNX",
        description="Writes a policy as a C header of one file, for microcontrollers and programs without libraries, "
        "or as ONNX (needs the package onnx).",
    )
    command.add_argument("policy", type=Path, metavar="POLICY", help="a policy.txt")
    command.add_argument("--c", type=Path, metavar="FILE", help="the header to write")
    command.add_argument("--onnx", type=Path, metavar="FILE", help="the ONNX model to write")
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    policy = Policy.load(arguments.policy)
    if arguments.c is None and arguments.onnx is None:
        raise OptionError("say what to write: --c FILE or --onnx FILE")
    if arguments.c:
        text = header(policy)
        saved.replace(arguments.c, text)
        print(f"{arguments.c}: {len(text):,} bytes, mjenv_policy_act(observation, action)")
    if arguments.onnx:
        data = onnx_model(policy).SerializeToString()
        arguments.onnx.write_bytes(data)
        print(f"{arguments.onnx}: {len(data):,} bytes, observation -> action")
    return 0
