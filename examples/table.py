"""Prints the results of the examples, with a table for each of the first FULL ids; fails unless all equal Gymnasium's.

Usage: table.py EXPECTED RESULTS FULL ID...
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


def print_table(want: Result, played: list[tuple[str, Result, str]]) -> None:
    print(f"  {'':10} {'return':>24} {'length':>7} {'steps/s':>9}  checksum")
    print(f"  {'Gymnasium':10} {want.total:24.17g} {want.steps:7} {'':9}  {want.checksum}")
    for language, got, rate in played:
        verdict = "" if got == want else "  differs"
        print(f"  {language:10} {got.total:24.17g} {got.steps:7} {float(rate):9.0f}  {got.checksum}{verdict}")


def main(expected_path: str, results_path: str, full: str, *ids: str) -> int:
    expected, machine = read_expected(Path(expected_path))
    rows = [line.split("\t") for line in Path(results_path).read_text().splitlines()]
    languages = list(dict.fromkeys(row[0] for row in rows))
    differing = 0
    for index, env_id in enumerate(ids):
        want = expected[env_id]
        played = [(row[0], Result(int(row[2]), real(row[3]), row[5]), row[4]) for row in rows if row[1] == env_id]
        wrong = [language for language, got, _ in played if got != want]
        differing += len(wrong) + (len(played) != len(languages))
        if index < int(full):
            print(f"\n{env_id}, 3 episodes from seed 42")
            print_table(want, played)
            continue
        if index == int(full):
            print(f"\n{'in short':25} {'return':>24} {'length':>7}  checksum, {len(languages)} languages and Gymnasium")
        verdict = f"differs in {', '.join(wrong)}" if wrong else "equal"
        print(f"{env_id:25} {want.total:24.17g} {want.steps:7}  {want.checksum} {verdict}")
    if differing:
        print(f"\n{differing} result(s) differ from Gymnasium's, recorded with {machine}.")
        return 1
    print(f"\n{', '.join(languages)}: all agree with Gymnasium in every bit of {len(ids)} environments.")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
