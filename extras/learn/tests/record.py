"""Records the loss of PPO and its gradients by PyTorch's autograd in float64, for parts.cpp to compare.

    record.py            writes gradients.txt
    record.py --check    compares it with what PyTorch computes now

The inputs are float32 numbers. The Python of `tools/setup torch` has all that this needs.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

FILE = Path(__file__).with_name("gradients.txt")
OBSERVATIONS, ACTUATORS, STEPS = 5, 3, 70  # more steps than the learner evaluates together
LAYERS = {"tanh": nn.Tanh, "relu": nn.ReLU, "elu": nn.ELU}


@dataclass(frozen=True)
class Case:
    activation: str
    hidden: tuple[int, ...]
    value_clip: float
    entropy_coef: float
    clip: float = 0.2
    value_coef: float = 1.3


CASES = (
    Case("tanh", (8, 6), 0.0, 0.0),
    Case("relu", (20,), 0.0, 0.01),
    Case("elu", (7, 17, 4), 0.1, 0.02),
    Case("tanh", (), 0.2, 0.0),
)


def network(case: Case, outputs: int) -> nn.Sequential:
    layers: list[nn.Module] = []
    width = OBSERVATIONS
    for hidden in case.hidden:
        layers += [nn.Linear(width, hidden), LAYERS[case.activation]()]
        width = hidden
    made = nn.Sequential(*layers, nn.Linear(width, outputs))
    for parameter in made.parameters():  # float32 numbers, for the learner computes with those
        nn.init.normal_(parameter, std=0.4)
    return made.double()


def loss_of(case: Case, mean: Tensor, value: Tensor, log_std: Tensor, data: dict[str, Tensor]) -> tuple[Tensor, ...]:
    """The loss of PPO as Huang et al. (2022) describe it, and its terms: of the policy and of the value."""
    policy = torch.distributions.Normal(mean, log_std.exp())
    ratio = (policy.log_prob(data["actions"]).sum(1) - data["log_probabilities"]).exp()
    advantages = data["advantages"]
    advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
    bounded = ratio.clamp(1 - case.clip, 1 + case.clip)
    policy_loss = -torch.minimum(ratio * advantages, bounded * advantages).mean()
    misses = (value - data["returns"]) ** 2
    if case.value_clip > 0:
        change = (value - data["values"]).clamp(-case.value_clip, case.value_clip)
        misses = torch.maximum(misses, (data["values"] + change - data["returns"]) ** 2)
    value_loss = misses.mean()
    loss = policy_loss + case.value_coef * value_loss - case.entropy_coef * policy.entropy().sum(1).mean()
    return loss, policy_loss, value_loss


def line(name: str, values: Tensor) -> str:
    return " ".join([name, *(repr(value) for value in values.detach().flatten().tolist())])


def lines(number: int, case: Case) -> Iterator[str]:
    torch.manual_seed(number)
    actor, critic = network(case, ACTUATORS), network(case, 1)
    log_std = (0.3 * torch.randn(ACTUATORS)).double().requires_grad_()
    data = {"observations": torch.randn(STEPS, OBSERVATIONS).double()}
    mean, value = actor(data["observations"]), critic(data["observations"]).squeeze(1)

    def rounded(values: Tensor) -> Tensor:
        return values.detach().float().double()

    data["actions"] = rounded(mean + log_std.exp() * torch.randn(STEPS, ACTUATORS))
    now = torch.distributions.Normal(mean, log_std.exp()).log_prob(data["actions"]).sum(1)
    data["log_probabilities"] = rounded(now + 0.3 * torch.randn(STEPS))  # so that some ratios are clipped
    data["advantages"] = rounded(torch.randn(STEPS).double())
    data["returns"] = rounded(value + torch.randn(STEPS))
    data["values"] = rounded(value + 0.2 * torch.randn(STEPS))
    loss, policy_loss, value_loss = loss_of(case, mean, value, log_std, data)
    loss.backward()
    yield f"case {case.activation} {case.clip} {case.value_clip} {case.value_coef} {case.entropy_coef}"
    yield " ".join(["hidden", *map(str, case.hidden)])
    for name, values in data.items():
        yield line(name, values)
    yield line("policy_loss", policy_loss)
    yield line("value_loss", value_loss)
    for name, net in (("actor", actor), ("critic", critic)):
        for parameter in net.parameters():
            yield line(name, parameter)
            assert parameter.grad is not None
            yield line(f"{name}_gradient", parameter.grad)
    yield line("log_std", log_std)
    assert log_std.grad is not None
    yield line("log_std_gradient", log_std.grad)


def check(recorded: list[str], wanted: list[str]) -> None:
    """The same words, and the same numbers but for the last digits, which depend on the CPU."""
    if len(recorded) != len(wanted):
        raise SystemExit(f"{FILE} has {len(recorded)} lines, not {len(wanted)}")
    for old, new in zip(recorded, wanted, strict=True):
        (name, *old_words), (new_name, *new_words) = old.split(), new.split()
        if name != new_name or len(old_words) != len(new_words):
            raise SystemExit(f"{FILE} has a line {name}, not {new_name}")
        if name == "case":
            old_words, new_words = old_words[1:], new_words[1:]
        np.testing.assert_allclose(np.array(old_words, float), np.array(new_words, float), rtol=1e-9, atol=1e-12)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    given = parser.parse_args()
    torch.set_num_threads(1)
    made = [text for number, case in enumerate(CASES) for text in lines(number, case)]
    if given.check:
        check(FILE.read_text().splitlines(), made)
    else:
        FILE.write_text("\n".join(made) + "\n")


if __name__ == "__main__":
    main()
