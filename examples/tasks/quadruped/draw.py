"""Draws curve.csv, which the training wrote, as curve.svg: python draw.py"""

from __future__ import annotations

import csv
from pathlib import Path

from mjenv import _svg as svg

HERE = Path(__file__).resolve().parent


def drawing(table: Path) -> str:
    with table.open() as file:
        rows = [{name: float(text) for name, text in row.items()} for row in csv.DictReader(file)]
    rows = [row for row in rows if row["mean_return"] == row["mean_return"]]  # no episode has ended before

    def panel(title: str, y: str, name: str) -> svg.Panel:
        line = svg.Line("PPO", [(row["steps"] / 1e6, row[name]) for row in rows])
        return svg.Panel(title, "million steps", y, [line])

    return svg.drawing(
        [
            panel("Return", "mean return of 20 episodes", "mean_return"),
            panel("Tracking", "mean error of the velocity forward, m/s", "error"),
        ]
    )


if __name__ == "__main__":
    (HERE / "curve.svg").write_text(drawing(HERE / "curve.csv"))
