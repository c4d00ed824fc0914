"""Writes tables (Markdown) and a chart (SVG) of the CSV file of measure.py, into the same folder: report.py CSV."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from statistics import geometric_mean, median
from xml.sax.saxutils import escape

from common import ROBOTS
from results import PEERS, Row, read

NAMES = {
    "mjenv-c": "mjenv, C",
    "mjenv-rollout": "mjenv, `mjenv_rollout` of 10 steps, C",
    "mjenv-rollout-lanes0": "mjenv, `mjenv_rollout` of 10 steps, C, without lanes",
    "mjenv-single": "mjenv, `make`",
    "mjenv": "mjenv, `make_vec`",
    "mjenv-lanes0": "mjenv, `make_vec` without lanes",
    "mjenv-lanes2": "mjenv, `make_vec` with 2 lanes (SSE2)",
    "mjenv-async": "mjenv, `send`/`recv`",
    "gymnasium-single": "Gymnasium, `make`",
    "gymnasium-sync": "Gymnasium, `SyncVectorEnv`",
    "gymnasium-async": "Gymnasium, `AsyncVectorEnv`",
    "envpool-sync": "EnvPool",
    "envpool-async": "EnvPool, async",
    "mujoco-batch": "mujoco.batch (physics only)",
    "mujoco4-mjenv-c": "mjenv on MuJoCo 4.0, C",
    "mujoco4-mjenv-single": "mjenv on MuJoCo 4.0, `make`",
    "mujoco4-mjenv": "mjenv on MuJoCo 4.0, `make_vec`",
    "mujoco4-mjenv-lanes0": "mjenv on MuJoCo 4.0, `make_vec` without lanes",
    "mujoco4-gymnasium-single": "Gymnasium on MuJoCo 4.0, `make`",
    "mujoco4-gymnasium-sync": "Gymnasium on MuJoCo 4.0, `SyncVectorEnv`",
}
# The chart's entries: name, colour, the peer for one environment, and the peer for many.
SERIES = (
    ("mjenv, C", "#0b3d91", "mjenv-c", None),
    ("mjenv, Python", "#2f7ed8", "mjenv-single", "mjenv"),
    ("Gymnasium", "#8a8a8a", "gymnasium-single", "gymnasium-sync"),
    ("EnvPool", "#e07b39", "envpool-sync", "envpool-sync"),
    ("EnvPool, async", "#f2b98f", None, "envpool-async"),
    ("mujoco.batch (physics only)", "#3a9d5d", "mujoco-batch", "mujoco-batch"),
)
# What a vector of mjenv is compared with.
OTHERS = ("mjenv-c", "mjenv-lanes0", "gymnasium-sync", "gymnasium-async", "envpool-sync", "mujoco-batch")
Case = tuple[int, int]  # environments, threads


class Results:
    """The measured rates by robot, case and peer."""

    def __init__(self, rows: list[Row]) -> None:
        self._rows = {(r["robot"], int(r["envs"]), int(r["threads"]), r["peer"]): r for r in rows}
        self.robots = [robot for robot in ROBOTS if any(k[0] == robot for k in self._rows)]
        self.cases: list[Case] = sorted({(k[1], k[2]) for k in self._rows})
        self.peers = [peer for peer in PEERS if any(k[3] == peer for k in self._rows)]
        self.cpu = ", ".join(sorted({f"{r['cpu']} with {r['cpus']} CPUs" for r in rows}))
        self.dates = " to ".join(sorted({min(r["date"] for r in rows), max(r["date"] for r in rows)}))
        self.about = sorted({r["about"] for r in rows})

    def rate(self, robot: str, case: Case, peer: str) -> float | None:
        if peer.endswith("gymnasium-sync"):
            case = (case[0], 1)  # it has only one thread
        row = self._rows.get((robot, *case, peer))
        return float(row["steps_per_second"]) if row else None

    def mean(self, case: Case, peer: str) -> float | None:
        """The geometric mean over the robots."""
        rates = [self.rate(robot, case, peer) for robot in self.robots]
        return None if None in rates else geometric_mean(rate for rate in rates if rate)

    def ratios(self, case: Case, peer: str, other: str) -> dict[str, float]:
        """How many times as fast a peer is as another: medians over the rounds."""
        found = {}
        for robot in self.robots:
            rows = [self._rows.get((robot, *case, name)) for name in (peer, other)]
            if rows[0] and rows[1]:
                blocks = [map(float, row["blocks"].split()) for row in rows if row]
                found[robot] = median(a / b for a, b in zip(*blocks, strict=True))
        return found


def table(header: list[str], rows: list[list[str]]) -> str:
    lines = [header, ["---", *["---:"] * (len(header) - 1)], *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def number(rate: float | None) -> str:
    """Three digits, because more would be noise."""
    if rate is None:
        return ""
    return f"{float(f'{rate:.3g}'):,.0f}"


def case_name(case: Case) -> str:
    envs, threads = case
    return f"{envs} on {threads} thread" + ("s" if threads > 1 else "") if envs > 1 else "1"


def means(results: Results) -> str:
    rows = [[NAMES[peer], *(number(results.mean(case, peer)) for case in results.cases)] for peer in results.peers]
    return table(["environments", *map(case_name, results.cases)], rows)


def robots(results: Results, case: Case) -> str:
    peers = [peer for peer in results.peers if any(results.rate(robot, case, peer) for robot in results.robots)]
    rows = [[robot, *(number(results.rate(robot, case, peer)) for peer in peers)] for robot in results.robots]
    return table([f"{case_name(case)}", *(NAMES[peer] for peer in peers)], rows)


def summary(results: Results) -> str:
    rows = []
    for case, peer, other in (
        ((1, 1), "mjenv-c", "gymnasium-single"),
        ((1, 1), "mjenv-single", "gymnasium-single"),
        ((1, 1), "mjenv-single", "envpool-sync"),
        *(((envs, threads), "mjenv", other) for envs in (8, 64, 1024) for threads in (1, 2) for other in OTHERS),
        *(((envs, threads), "mjenv-lanes2", "mjenv-lanes0") for envs in (8, 64, 1024) for threads in (1, 2)),
        *(((envs, threads), "mjenv-rollout", "mjenv-rollout-lanes0") for envs in (8, 64, 1024) for threads in (1, 2)),
        *(((envs, 2), "mjenv-async", "envpool-async") for envs in (8, 64, 1024)),
        ((1, 1), "mujoco4-mjenv-c", "mujoco4-gymnasium-single"),
        ((1, 1), "mujoco4-mjenv-single", "mujoco4-gymnasium-single"),
        *(
            ((envs, threads), "mujoco4-mjenv", other)
            for envs in (8, 64, 1024)
            for threads in (1, 2)
            for other in ("mujoco4-mjenv-lanes0", "mujoco4-gymnasium-sync", "envpool-sync", "mujoco-batch")
        ),
    ):
        ratios = results.ratios(case, peer, other)
        if ratios:
            worst, best = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
            mean = f"{geometric_mean(ratios.values()):.2f}"
            least, most = f"{ratios[worst]:.2f} {worst}", f"{ratios[best]:.2f} {best}"
            rows.append([case_name(case), NAMES[peer], NAMES[other], mean, least, most])
    header = ["environments", "this", "against", "times as fast, geometric mean", "least", "most"]
    return table(header, rows).replace("---:", "---")


def chart(results: Results, cases: list[Case]) -> str:
    """Dots on logarithmic axes: a panel for each case, a line for each robot."""
    left, panel, row, top, gap = 220, 330, 24, 72, 40
    height = top + row * len(results.robots) + 60
    width = left + len(cases) * (panel + gap)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"',
        ' font-family="sans-serif" font-size="13">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        f'<text x="12" y="{height - 12}" font-size="11" fill="#555">'
        f"environment steps per second, more is better; {escape(results.cpu)}; {results.dates}</text>",
    ]
    at = 20.0
    for name, colour, *_ in SERIES:
        parts.append(f'<circle cx="{at:.0f}" cy="20" r="5" fill="{colour}"/>')
        parts.append(f'<text x="{at + 10:.0f}" y="25">{name}</text>')
        at += 40 + 7 * len(name)
    for i, robot in enumerate(results.robots):
        parts.append(f'<text x="{left - 14}" y="{top + row * i + 16}" text-anchor="end">{robot}-v5</text>')
    for index, case in enumerate(cases):
        parts += _panel(results, case, (left + index * (panel + gap), top, panel, row))
    return "\n".join([*parts, "</svg>\n"])


def _panel(results: Results, case: Case, place: tuple[int, int, int, int]) -> list[str]:
    left, top, width, row = place
    of_one = case[0] == 1
    dots = [
        (top + row * i + row / 2, colour, rate)
        for i, robot in enumerate(results.robots)
        for _, colour, one, many in reversed(SERIES)
        if (rate := results.rate(robot, case, (one if of_one else many) or ""))
    ]
    low = math.floor(min(math.log10(rate) for *_, rate in dots) * 4) / 4
    high = math.ceil(max(math.log10(rate) for *_, rate in dots) * 4) / 4

    def x(rate: float) -> float:
        return left + (math.log10(rate) - low) / (high - low) * width

    bottom = top + row * len(results.robots)
    parts = [f'<text x="{left}" y="{top - 12}" font-weight="bold">{_title(case)}</text>']
    for power in range(math.floor(low), math.ceil(high)):
        for rate in (digit * 10**power for digit in (1, 2, 5)):
            if low <= math.log10(rate) <= high:
                at = f"{x(rate):.1f}"
                parts.append(f'<line x1="{at}" y1="{top}" x2="{at}" y2="{bottom}" stroke="#e4e4e4"/>')
                label = f'<text x="{at}" y="{bottom + 16}" font-size="11" text-anchor="middle">{_short(rate)}</text>'
                parts.append(label)
    for y in sorted({y for y, *_ in dots}):
        parts.append(f'<line x1="{left}" y1="{y}" x2="{left + width}" y2="{y}" stroke="#f0f0f0"/>')
    parts += [f'<circle cx="{x(rate):.1f}" cy="{y}" r="5" fill="{colour}"/>' for y, colour, rate in dots]
    return parts


def _title(case: Case) -> str:
    envs, threads = case
    return "one environment" if envs == 1 else f"{envs} environments, {threads} thread" + ("s" if threads > 1 else "")


def _short(rate: float) -> str:
    for size, unit in ((1e6, "M"), (1e3, "k")):
        if rate >= size:
            return f"{rate / size:g}{unit}"
    return f"{rate:g}"


def write(path: Path) -> None:
    results = Results(read(path))
    wanted: list[Case] = [(1, 1), (64, 2)]
    shown = [case for case in wanted if case in results.cases] or results.cases[-1:]
    charted = {peer for _, _, *peers in SERIES for peer in peers}.intersection(results.peers)
    ratios = summary(results)
    text = [
        f"Environment steps per second, geometric mean over {len(results.robots)} robots:\n\n{means(results)}",
        f"Ratios, paired in each round:\n\n{ratios}",
        *(f"By robot:\n\n{robots(results, case)}" for case in results.cases),
        f"{results.cpu}; {results.dates}; " + "; ".join(results.about) + ".\n",
    ]
    path.with_suffix(".md").write_text("\n".join(text))
    print(f"{ratios}\nwrote {path}, {path.with_suffix('.md')}")
    if charted:
        path.with_suffix(".svg").write_text(chart(results, shown))
        print(f"wrote {path.with_suffix('.svg')}")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
