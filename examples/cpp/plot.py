"""Draws the CSV files that plan wrote, each in its own panel: plot.py TITLE=CSV... >picture.svg

docs/planning.svg shows plan HalfCheetah-v5 200 1 and plan Hopper-v5 300 1.
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Iterator
from pathlib import Path

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 420, 280, 56, 16, 34, 44
CURVES = {
    "planned": ("planned", "#1664c0", 2.5),
    "random_best": ("best of 1000 random", "#c05a16", 1.5),
    "random_mean": ("mean of 1000 random", "#808080", 1.5),
}


def ticks(low: float, high: float) -> list[float]:
    """About five round numbers within the bounds."""
    raw = (high - low) / 5
    unit = 10 ** math.floor(math.log10(raw))
    step = next(unit * factor for factor in (1, 2, 5, 10) if unit * factor >= raw)
    return [step * i for i in range(math.ceil(low / step), math.floor(high / step) + 1)]


def panel(title: str, columns: dict[str, list[float]]) -> Iterator[str]:
    shown = [value for name in CURVES for value in columns[name]]
    low, high, last = min(shown), max(shown), columns["step"][-1]

    def x(step: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * step / last

    def y(value: float) -> float:
        return TOP + (HEIGHT - TOP - BOTTOM) * (high - value) / (high - low)

    yield f'<text x="{WIDTH / 2}" y="20" text-anchor="middle" font-weight="bold">{title}</text>'
    for value in ticks(low, high):
        yield f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(value):.1f}" y2="{y(value):.1f}" stroke="#ddd"/>'
        yield f'<text x="{LEFT - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value:g}</text>'
    for value in ticks(0, last):
        yield f'<text x="{x(value):.1f}" y="{HEIGHT - BOTTOM + 16}" text-anchor="middle">{value:g}</text>'
    yield f'<text x="{WIDTH / 2}" y="{HEIGHT - 8}" text-anchor="middle">steps</text>'
    for row, (name, (label, color, width)) in enumerate(CURVES.items()):
        points = " ".join(f"{x(s):.1f},{y(v):.1f}" for s, v in zip(columns["step"], columns[name], strict=True))
        yield f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="{width}"/>'
        yield f'<text x="{LEFT + 10}" y="{TOP + 14 + 16 * row}" fill="{color}">{label}</text>'


def main() -> None:
    files = [argument.split("=", 1) for argument in sys.argv[1:]]
    size = f"{WIDTH * len(files)}" + f'" height="{HEIGHT}'
    print(f'<svg xmlns="http://www.w3.org/2000/svg" width="{size}" font-family="sans-serif" font-size="12">')
    print('<rect width="100%" height="100%" fill="white"/>')
    for index, (title, file) in enumerate(files):
        rows = list(csv.DictReader(Path(file).read_text().splitlines()))
        columns = {name: [float(row[name]) for row in rows] for name in rows[0]}
        print(f'<g transform="translate({WIDTH * index} 0)">', *panel(title, columns), "</g>", sep="\n")
    print("</svg>")


if __name__ == "__main__":
    main()
