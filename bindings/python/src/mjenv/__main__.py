"""python -m mjenv verify [ID ...]: compare with the Gymnasium that is installed."""

import argparse
import sys
from collections.abc import Sequence

import mjenv


def verify(ids: Sequence[str], option_sets: int, seeds: int, steps: int, draw: int) -> int:
    """Compares the ids with Gymnasium; the exit status is 1 when one differs and 2 when there is no Gymnasium."""
    try:
        from mjenv import verify as compare
    except ImportError as error:
        print(f'{error}: install "gymnasium[mujoco]" to compare with it', file=sys.stderr)
        return 2
    print(compare.versions())
    failed = 0
    for id in ids:
        runs = episodes = 0
        try:
            with compare.quiet():
                for run in compare.draw_runs(id, option_sets, seeds, steps, draw):
                    episodes += compare.play(run)
                    runs += 1
            print(f"{id}: {runs} runs of {steps} steps, {episodes} episodes: every bit equal", flush=True)
        except compare.DifferenceError as difference:
            failed += 1
            print(f"{id}: DIFFERS after {runs} equal runs: {difference}", flush=True)
        except ImportError as error:  # Pusher-v4 with a new mujoco
            print(f"{id}: not compared, as Gymnasium refuses it: {error}", flush=True)
    if failed:
        print(f"{failed} of {len(ids)} ids differ. Equal bits are promised for gymnasium 1.3.0, mujoco 2.2.2, numpy 2.")
    return int(failed > 0)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m mjenv", description=mjenv.version())
    commands = parser.add_subparsers(dest="command", required=True)
    command = commands.add_parser("verify", help="compare every bit with the Gymnasium that is installed")
    command.add_argument("id", nargs="*", help="ids to compare; all when none is given")
    command.add_argument("--option-sets", type=int, default=5, help="option sets an id, the defaults included (5)")
    command.add_argument("--seeds", type=int, default=2, help="runs an option set (2)")
    command.add_argument("--steps", type=int, default=300, help="steps a run (300)")
    command.add_argument("--draw", type=int, default=0, help="seed of the drawing of options (0)")
    given = parser.parse_args()
    for id in given.id:
        if id not in mjenv.ids():
            command.error(f"no id {id!r}; there are {', '.join(mjenv.ids())}")
    return verify(given.id or mjenv.ids(), given.option_sets, given.seeds, given.steps, given.draw)


if __name__ == "__main__":
    sys.exit(main())
