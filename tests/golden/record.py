"""Records what Gymnasium and NumPy do, for the tests of all languages; their expected values come from here alone.

Needs Python 3.10 with gymnasium==1.3.0, mujoco==2.2.2 and numpy==2.2.6, on a CPU with AVX-512 for half of the files.

    record.py           writes trajectories/, custom/, state/ and vector/*.golden, random.txt, schema.txt and
                        examples/expected.txt
    record.py --check   records again and compares with the files that are there

Last bits depend on the machine in two places: OpenBLAS picks a kernel for the norms (pinned here: Haswell or SkylakeX,
the file says which), and the C library picks its sin, cos, exp, log1p and pow by CPU ("libm" in the files).

A golden: text lines up to "data", then the arrays, raw and little-endian, in the order listed.
    mjenv-golden 1, id, seed, gymnasium, mujoco, numpy, python, cpu, kernel, norm plain|fused, libm fma|sse2
    option NAME integer|reals|string VALUE...   to be set before create
    info NAME COUNT TYPE, reset_info NAME COUNT TYPE   in Gymnasium's order
    array NAME f4|f8|u1|i8 D0 [D1]
Seed the row and reset: reset_obs[0]. Before step t = reset_at[i], i > 0, reset again without a seed: reset_obs[i].
custom/ holds the same for models of our own; "xml_file" there is relative to that folder.
state/ follows one row through stages: stage[s] is 0 for a reset (the first one seeded), 1 for a step with action[s],
2 for set_state with set_qpos[s] and set_qvel[s], 3 for do_simulation with action[s] over 3 frames. obs, reward and info
are as of then (reward and info of steps alone), and data.NAME[s] and model.NAME are MuJoCo's arrays.
vector/ follows the rows of a SyncVectorEnv in one mode of automatic resets; each array is [T][rows * ...]. A reset
before step reset_at[i], of the rows in reset_mask[i], seeds those whose reset_seed[i] is not -1. Infos are those of the
dictionary of infos, 0 where the field's mask, NAME_mask [T][rows * fields], is unset: info and reset_info of a step,
final_info of the episodes that ended in it; reset_reset_info of a reset.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from episodes import expected, goldens
from machine import WANTED, machine, norm_rounding, openblas_kernel, run_under
from numpy_values import norm_lines, random_text
from schema import schema
from vectors import vectors

ROOT = Path(__file__).resolve().parent.parent.parent
GOLDEN = "tests/golden"
EXPECTED = "examples/expected.txt"
RANDOM = f"{GOLDEN}/random.txt"
SCHEMA = f"{GOLDEN}/schema.txt"


def record_kernel(folder: Path) -> None:
    """Writes what belongs to the kernel of this process; Haswell comes last, for it collects the other's norms."""
    facts = machine()
    norms = folder / "fused_norms"
    if facts["kernel"] == "SkylakeX":
        norms.write_text("\n".join(norm_lines("SkylakeX")))
        files = [(f"{GOLDEN}/{name}", content) for name, content in goldens(facts)]
    else:
        fused = norms.read_text().splitlines() if norms.exists() else []
        files = [(f"{GOLDEN}/{name}", content) for name, content in (*goldens(facts), *vectors(facts))]
        files += [(RANDOM, random_text(facts, fused)), (SCHEMA, schema(facts)), (EXPECTED, expected(facts))]
    for name, content in files:
        path = folder / "files" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def record(folder: Path) -> tuple[dict[str, bytes], list[str]]:
    """All files, and the kernels that this CPU cannot run."""
    missing = []
    for kernel in ("SkylakeX", "Haswell"):
        if run_under(kernel, "--kernel").stdout.strip() != kernel:
            missing.append(kernel)
            continue
        done = run_under(kernel, "--into", str(folder), folder=folder)
        if done.returncode:
            raise SystemExit(done.stderr[-2000:] + f"record.py: recording with kernel {kernel} failed")
    top = folder / "files"
    return {str(path.relative_to(top)): path.read_bytes() for path in top.rglob("*") if path.is_file()}, missing


def stored_facts(content: bytes) -> dict[str, str]:
    """The lines of a file that name versions and the machine."""
    keys = ("gymnasium", "mujoco", "numpy", "python", "cpu", "kernel", "libm")
    text = content[: content.find(b"\ndata\n")].decode() if content.startswith(b"mjenv-golden") else content.decode()
    words = (part.strip().partition(" ") for line in text.splitlines() for part in line.lstrip("# ").split(","))
    return {key: value for key, _, value in words if key in keys}


def without_machine(content: bytes) -> bytes:
    """A file without the names that may change while all numbers stay."""
    facts = stored_facts(content)
    for key in ("python", "cpu"):
        content = content.replace(f"{key} {facts.get(key)}".encode(), key.encode(), 1)
    return content


def check(files: dict[str, bytes], missing: list[str]) -> bool:
    stored = [str(path.relative_to(ROOT)) for path in (ROOT / GOLDEN).glob("*/*.golden")]
    stored += [RANDOM, SCHEMA, EXPECTED]
    equal, bad, skipped = 0, 0, 0
    now = {**machine(), "kernel": "any"}
    then: dict[str, str] = {}
    for name in sorted({*stored, *files}):
        old = (ROOT / name).read_bytes() if (ROOT / name).exists() else b""
        facts = stored_facts(old)
        then |= facts
        if facts.get("kernel") in missing or (name == RANDOM and missing):
            skipped += 1
            print(f"{name}: not checked: this CPU cannot run OpenBLAS's kernel {', '.join(missing)}")
        elif name not in files or not old:
            bad += 1
            print(f"{name}: {'not recorded any more' if old else 'missing'}")
        elif without_machine(old) != without_machine(files[name]):
            bad += 1
            print(f"{name}: DIFFERS")
        else:
            equal += 1
    for key in ("gymnasium", "mujoco", "numpy", "python", "cpu", "libm"):
        if then.get(key) != now[key]:
            print(f"{key}: recorded with {then.get(key)}, this is {now[key]}")
    print(f"record.py --check: {equal} files equal, {bad} differ, {skipped} not checked")
    return not bad


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare with the files that are there, write nothing")
    parser.add_argument("--kernel", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--norm", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--into", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.kernel:
        print(openblas_kernel())
        return
    if arguments.norm:
        print(norm_rounding())
        return
    if arguments.into:
        record_kernel(arguments.into)
        return
    versions = {
        key: value.removesuffix("." + value.split(".")[-1]) if key == "python" else value
        for key, value in machine().items()
        if key in WANTED
    }
    if versions != WANTED:
        raise SystemExit(f"record.py: this is {versions}, the goldens are of {WANTED}")
    with tempfile.TemporaryDirectory() as folder:
        files, missing = record(Path(folder))
        if arguments.check:
            sys.exit(not check(files, missing))
        if missing:
            raise SystemExit(f"record.py: this CPU cannot run OpenBLAS's kernel {', '.join(missing)}; nothing written")
        for name, content in sorted(files.items()):
            path = ROOT / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            print(f"{name}: {len(content)} bytes")


if __name__ == "__main__":
    main()
