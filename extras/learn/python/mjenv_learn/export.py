"""mjenv export: writes a policy as a C header for devices on which no library runs."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

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


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "export",
        help="write a policy as a C header",
        description="Writes a policy as a C header of one file, for microcontrollers and programs without libraries.",
    )
    command.add_argument("policy", type=Path, metavar="POLICY", help="a policy.txt")
    command.add_argument("--c", type=Path, required=True, metavar="FILE", help="the header to write")
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    text = header(Policy.load(arguments.policy))
    saved.replace(arguments.c, text)
    print(f"{arguments.c}: {len(text):,} bytes, mjenv_policy_act(observation, action)")
    return 0
