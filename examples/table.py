"""Prints a table an environment from the examples' results and fails unless all agree with Gymnasium's recorded values.

Usage: table.py EXPECTED RESULTS ID...
"""

import sys
from pathlib import Path
from typing import NamedTuple


class Result(NamedTuple):
    steps: int
    total: float
    checksum: str


def read_expected(path: Path) -> tuple[dict[str, Result], str]:
    lines = path.read_text().splitlines()
    rows = [line.split() for line in lines if not line.startswith("#")]
    machine = next(line[2:] for line in lines if line.startswith("# gymnasium"))
    return {i: Result(int(n), float.fromhex(total), checksum) for i, _, n, total, checksum in rows}, machine


def real(text: str) -> float:
    return float.fromhex(text) if "0x" in text else float(text)


def main(expected_path: str, results_path: str, *ids: str) -> int:
    expected, machine = read_expected(Path(expected_path))
    rows = [line.split("\t") for line in Path(results_path).read_text().splitlines()]
    differing = 0
    for env_id in ids:
        want = expected[env_id]
        print(f"\n{env_id}, 3 episodes from seed 42")
        print(f"  {'':9} {'return':>24} {'length':>7} {'steps/s':>9}  checksum")
        print(f"  {'Gymnasium':9} {want.total:24.17g} {want.steps:7} {'':9}  {want.checksum}")
        played = [(language, Result(int(n), real(total), checksum), rate)
                  for language, i, n, total, rate, checksum in rows if i == env_id]  # fmt: skip
        for language, got, rate in played:
            verdict = "" if got == want else "  differs"
            differing += got != want
            print(f"  {language:9} {got.total:24.17g} {got.steps:7} {float(rate):9.0f}  {got.checksum}{verdict}")
        differing += len(played) != 4
    if differing:
        print(f"\n{differing} result(s) differ from Gymnasium's, recorded with {machine}.")
        print(
            "The last bits of sin, cos and exp depend on whether the C library uses the CPU's FMA: compare the CPUs first."
        )
        return 1
    print(f"\nC, Python, Rust and Julia agree with Gymnasium in every bit of {len(ids)} environments.")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
