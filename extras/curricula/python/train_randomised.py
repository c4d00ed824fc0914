"""Trains PPO on Hopper-v5 twice, on the model as it is and with masses and frictions that each episode draws, and plays
both policies on models with other masses and frictions.

    train_randomised.py [--steps N] [--seed 1] [--out FOLDER]    trains, plays and draws; needs PyTorch
    train_randomised.py --policies FOLDER [--out FOLDER]         plays the policies of an earlier training, and draws

Writes fixed.txt and randomised.txt (the policies), returns.csv (the mean return of each policy for each mass and
friction) and returns.svg.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mjenv
from mjenv_learn.policy import Policy

ID = "Hopper-v5"
DRAWN = (0.5, 1.5)  # the factor of all masses, and that of all sliding frictions
PLAYED = (0.25, 2.0)
RANDOMIZE = {
    "body_mass": mjenv.Scale(*DRAWN, shared=True, set_constants=True),
    "geom_friction": mjenv.Scale(*DRAWN, columns=0, shared=True),
}
POLICIES: dict[str, dict[str, Any]] = {"fixed": {}, "randomised": {"randomize": RANDOMIZE}}  # the options of make_vec
TITLES = {"fixed": "trained on the model as it is", "randomised": "trained with drawn masses and frictions"}

Array = NDArray[np.float64]
Returns = dict[str, Array]  # [mass][friction] for each policy


def train(name: str, steps: int, seed: int, out: Path) -> None:
    import torch

    import train_cleanrl

    torch.set_num_threads(1)
    settings = replace(train_cleanrl.SETTINGS[ID], steps=steps)
    train_cleanrl.train(ID, "mjenv", [train_cleanrl.Stage(steps, POLICIES[name])], seed, out / name, settings)
    (out / name / "policy.txt").replace(out / f"{name}.txt")


class Network:
    """A policy that acts for many observations at once."""

    def __init__(self, policy: Policy) -> None:
        self._mean, self._scale, self._clip = np.array(policy.mean), np.array(policy.scale), policy.clip
        self._low, self._high = np.array(policy.low), np.array(policy.high)
        self._layers = [(np.array(one.weights).T, np.array(one.bias), one.activation) for one in policy.layers]

    def act(self, observations: Array) -> NDArray[np.float32]:
        values = ((observations - self._mean) / self._scale).clip(-self._clip, self._clip)
        for weights, bias, activation in self._layers:
            values = values @ weights + bias
            if activation == "tanh":
                values = np.tanh(values)
        return values.clip(self._low, self._high).astype(np.float32)


def play(policy: Policy, factors: Array, episodes: int, seed: int) -> Array:
    """The mean return for each mass and friction. All episodes are played at once, each in a row with its own model."""
    mass, friction = (np.repeat(each, episodes) for each in np.meshgrid(factors, factors, indexing="ij"))
    envs = mjenv.make_vec(ID, len(mass), num_threads=0)
    envs.model.body_mass[:] *= mass[:, None]
    envs.model.geom_friction[:, :, 0] *= friction[:, None]
    envs.set_constants()
    observations, _ = envs.reset(seed=[seed + row % episodes for row in range(len(mass))])
    network, returns, going_on = Network(policy), np.zeros(len(mass)), np.ones(len(mass), np.bool_)
    while going_on.any():
        observations, rewards, terminated, truncated, _ = envs.step(network.act(observations))
        returns[going_on] += rewards[going_on]
        going_on &= ~(terminated | truncated)
    envs.close()
    return returns.reshape(len(factors), len(factors), episodes).mean(axis=2)


def write(path: Path, factors: Array, returns: Returns) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("policy", "mass", "friction", "mean_return"))
        for name, table in returns.items():
            for (i, j), value in np.ndenumerate(table):
                writer.writerow((name, float(factors[i]), float(factors[j]), round(float(value), 1)))


def read(path: Path) -> tuple[Array, Returns]:
    with path.open() as file:
        rows = [*csv.DictReader(file)]
    factors = np.array(sorted({float(row["mass"]) for row in rows}))
    found: dict[str, list[float]] = {}
    for row in rows:
        found.setdefault(row["policy"], []).append(float(row["mean_return"]))
    return factors, {name: np.reshape(values, (len(factors), -1)) for name, values in found.items()}


# ---- Drawing ----

SIDE, LEFT, TOP, GAP, BAR = 300, 62, 34, 46, 14
COLOURS = np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)])


def colour(part: float) -> str:
    """From dark for 0 to bright for 1."""
    at = part * (len(COLOURS) - 1)
    return "#" + "".join(f"{round(np.interp(at, range(len(COLOURS)), COLOURS[:, k])):02x}" for k in range(3))


def text(x: float, y: float, words: str, anchor: str = "middle", more: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{more}>{words}</text>'


def panel(title: str, factors: Array, table: Array, most: float) -> Iterator[str]:
    step = SIDE / len(factors)

    def place(factor: float) -> float:
        return (float(np.interp(factor, factors, range(len(factors)))) + 0.5) * step

    yield text(SIDE / 2, -14, title, more=' font-size="13"')
    for (i, j), value in np.ndenumerate(table):
        x, y = j * step, SIDE - (i + 1) * step
        yield f'<rect x="{x:.1f}" y="{y:.1f}" width="{step:.1f}" height="{step:.1f}" fill="{colour(value / most)}"/>'
    for factor in (0.5, 1.0, 1.5, 2.0):
        yield text(place(factor), SIDE + 17, f"{factor:g}")
        yield text(-6, SIDE - place(factor) + 4, f"{factor:g}", "end")
    low, high = place(DRAWN[0]), place(DRAWN[1])
    box = f'x="{low:.1f}" y="{SIDE - high:.1f}" width="{high - low:.1f}" height="{high - low:.1f}"'
    yield f'<rect {box} fill="none" stroke="#fff" stroke-width="2" stroke-dasharray="6 4"/>'
    yield text(SIDE / 2, SIDE + 36, "friction, times the model's")
    label = text(0, 0, "mass, times the model's")
    yield f'<g transform="translate(-44 {SIDE / 2:.0f}) rotate(-90)">{label}</g>'


def draw(path: Path, factors: Array, returns: Returns) -> None:
    """One heat map for each policy, with the range of the draws, and the colours' meaning."""
    most = max(float(table.max()) for table in returns.values())
    width, height = len(returns) * (LEFT + SIDE + GAP) + 60, TOP + SIDE + 50
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" '
        'font-size="11" fill="#555">',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
    ]
    for index, (name, table) in enumerate(returns.items()):
        parts.append(f'<g transform="translate({LEFT + index * (LEFT + SIDE + GAP)} {TOP})">')
        parts.extend(panel(TITLES.get(name, name), factors, table.clip(0), most))
        parts.append("</g>")
    parts.append(f'<g transform="translate({len(returns) * (LEFT + SIDE + GAP) - 10} {TOP})">')
    parts.append(text(BAR, -14, "mean return"))
    for part in np.linspace(0, 1, 31):
        parts.append(f'<rect y="{(1 - part) * (SIDE - 9):.1f}" width="{BAR}" height="10" fill="{colour(part)}"/>')
    for part in (0.0, 0.5, 1.0):
        parts.append(text(BAR + 5, (1 - part) * (SIDE - 9) + 9, f"{part * most:.0f}", "start"))
    path.write_text("\n".join([*parts, "</g>", "</svg>", ""]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=1_000_000, help="environment steps of each training")
    parser.add_argument("--seed", type=int, default=1, help="of the trainings")
    parser.add_argument("--policies", type=Path, metavar="FOLDER", help="play fixed.txt and randomised.txt from there")
    parser.add_argument("--cells", type=int, default=15, help="how many masses, and how many frictions, are played")
    parser.add_argument("--episodes", type=int, default=8, help="played for each mass and friction")
    parser.add_argument("--out", type=Path, default=Path("trained"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    if not given.policies:
        for name in POLICIES:
            train(name, given.steps, given.seed, given.out)
    factors = np.linspace(*PLAYED, given.cells)
    returns = {}
    for name in POLICIES:
        policy = Policy.load((given.policies or given.out) / f"{name}.txt")
        returns[name] = play(policy, factors, given.episodes, seed=100)
    write(given.out / "returns.csv", factors, returns)
    draw(given.out / "returns.svg", *read(given.out / "returns.csv"))
    inside = (factors >= DRAWN[0]) & (factors <= DRAWN[1])
    for name, table in returns.items():
        print(f"{name}: mean return {table[np.ix_(inside, inside)].mean():.0f} in the range of the draws,", end=" ")
        print(f"{table.mean():.0f} for all masses and frictions")


if __name__ == "__main__":
    main()
