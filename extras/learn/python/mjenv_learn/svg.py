"""Line charts as SVG, readable on light and dark pages."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

WIDTH, HEIGHT = 300, 220  # of a panel's plot
LEFT, RIGHT, TOP, BOTTOM = 62, 18, 34, 46
COLOURS = ("#0a7d6c", "#c2571a", "#4a5fc1", "#8a8a8a")
TICKS = 5


@dataclass(frozen=True)
class Line:
    name: str
    points: Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Panel:
    title: str
    x: str
    y: str
    lines: Sequence[Line]


def drawing(panels: Sequence[Panel], columns: int = 3) -> str:
    """The panels side by side, in rows of so many."""
    panel_width, panel_height = LEFT + WIDTH + RIGHT, TOP + HEIGHT + BOTTOM
    width, height = min(columns, len(panels)) * panel_width, math.ceil(len(panels) / columns) * panel_height
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" '
        'font-size="11" fill="#555">',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
    ]
    for index, panel in enumerate(panels):
        x, y = index % columns * panel_width + LEFT, index // columns * panel_height + TOP
        parts.append(f'<g transform="translate({x} {y})">')
        parts.extend(_panel(panel))
        parts.append("</g>")
    return "\n".join([*parts, "</svg>", ""])


def _panel(panel: Panel) -> Iterator[str]:
    xs, ys = ([point[axis] for line in panel.lines for point in line.points] for axis in (0, 1))
    x_ticks, y_ticks = _ticks(0.0, max(xs)), _ticks(min(ys), max(ys))
    x_end, low, high = max(xs) or 1.0, min(y_ticks[0], min(ys)), max(y_ticks[-1], max(ys))
    if high - low < 1e-300:  # a line without ups and downs; a great number plus 1 would be the same
        low, high = (low, low + 1.0) if low + 1.0 > low else (min(low, 0.0), max(high, 0.0))

    def place(x: float, y: float) -> tuple[float, float]:
        return WIDTH * x / x_end, HEIGHT * (high - y) / (high - low)

    yield f'<text x="{WIDTH / 2:.0f}" y="-14" text-anchor="middle" font-size="13">{escape(panel.title)}</text>'
    for tick in y_ticks:
        y = place(0, tick)[1]
        yield f'<path d="M0 {y:.1f}H{WIDTH}" stroke="#ddd"/>'
        yield f'<text x="-6" y="{y + 4:.1f}" text-anchor="end">{tick:g}</text>'
    for tick in x_ticks:
        x = place(tick, 0)[0]
        yield f'<path d="M{x:.1f} {HEIGHT}v4" stroke="#888"/>'
        yield f'<text x="{x:.1f}" y="{HEIGHT + 17}" text-anchor="middle">{tick:g}</text>'
    yield f'<path d="M0 {HEIGHT}H{WIDTH}" stroke="#888"/>'
    yield f'<text x="{WIDTH / 2:.0f}" y="{HEIGHT + 36}" text-anchor="middle">{escape(panel.x)}</text>'
    yield (
        f'<text transform="translate({12 - LEFT} {HEIGHT / 2:.0f}) rotate(-90)" text-anchor="middle">'
        f"{escape(panel.y)}</text>"
    )
    for index, line in enumerate(panel.lines):
        colour = COLOURS[index]
        path = "L".join(f"{x:.1f} {y:.1f}" for x, y in (place(*point) for point in line.points))
        yield f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="2"/>'
        if len(panel.lines) == 1:
            continue
        y = HEIGHT - 12 - 16 * (len(panel.lines) - 1 - index)
        yield f'<path d="M{WIDTH - 92} {y - 4}h18" stroke="{colour}" stroke-width="3"/>'
        yield f'<text x="{WIDTH - 68}" y="{y}">{escape(line.name)}</text>'


def _ticks(low: float, high: float) -> list[float]:
    """Round numbers from at or below low to at or below high."""
    raw = (high - low if high - low > 1e-300 else 1.0) / TICKS
    power = 10 ** math.floor(math.log10(raw))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= raw)
    return [index * step for index in range(math.floor(low / step), math.floor(high / step) + 1)]
