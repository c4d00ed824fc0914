"""Records what Gymnasium and NumPy do, for the tests of all languages; their expected values come from here alone.

Needs gymnasium==1.4.0, mujoco==2.2.2 or 4.0.0, and numpy==2.2.6, and qemu-x86_64 for what belongs to other CPUs.
With MuJoCo 4.0.0 the files are in mujoco4/, without vector/, episodes.txt, powers.txt and random.txt.

    record.py           writes the files named below; needs a CPU with AVX-512
    record.py --check   records again, compares with the files that are there, and says what it could not compare

The last bits depend on the CPU in two places. OpenBLAS chooses a kernel for the norms; each file names the kernel
that was set for it. The C library has variants of sin, cos, exp, log1p and pow for CPUs with FMA and AVX2, and others
for all other CPUs; the files name them "libm". What depends on the C library is therefore recorded twice, in the
folders fma/ and sse2/. Each contains trajectories/, custom/, state/ and vector/*.golden, powers.txt, and
episodes.txt, with which the examples are compared. random.txt and schema.txt are valid on all CPUs; some lines of
random.txt name the CPU for which they are valid.

A golden: text lines up to "data", then the arrays, raw and little-endian, in the order listed.
    mjenv-golden 1, id, seed, gymnasium, mujoco, numpy, python, cpu, kernel, norm plain|fused, libm fma|sse2
    option NAME integer|reals|string VALUE...   to be set before create
    info NAME COUNT TYPE, reset_info NAME COUNT TYPE   in Gymnasium's order
    array NAME f4|f8|u1|i8|u8 D0 [D1]
u8: a hash for each row and step, in place of its numbers: h = 0xcbf29ce484222325, then for the 64 bits of each number
h = (h ^ bits) * 0x100000001b3 mod 2^64 and h = h ^ (h >> 32). Observations and MuJoCo's arrays are hashed, except in
the trajectories of MuJoCo 2.2.2 with the default options of a v5.
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
import os
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import gymnasium
import mujoco

from cases import IS_MUJOCO_4
from episodes import episodes, goldens, option_goldens
from machine import EMULATOR, FOLDERS, HERE, WANTED, Run, libm, machine
from numpy_values import coretype_lines, norm_lines, powers_text, random_text
from schema import schema
from vectors import vectors

# On a CPU without FMA all norms are plain.
FUSED, PLAIN, WITHOUT_FMA = Run("fma", "SkylakeX"), Run("fma", "Haswell"), Run("sse2", "Nehalem")
EPISODES, RANDOM, SCHEMA = "episodes.txt", "random.txt", "schema.txt"
PLACE = FOLDERS.get(mujoco.mj_versionString(), HERE)  # where the files are
NORMS = "norms"  # a run's lines of random.txt, in the folder that it leaves


def record_run(folder: Path, run: Run) -> None:
    """Writes what belongs to a run; called in the process that was started for it."""
    facts = machine()
    if (facts["libm"], facts["kernel"]) != run:
        raise SystemExit(f"record.py: this is {facts['libm']} with {facts['kernel']}, not {' with '.join(run)}")
    files: list[tuple[str, bytes]] = []
    if run != PLAIN:
        files += option_goldens(facts)
    if run != FUSED:
        files += goldens(facts)
    if run != FUSED and not IS_MUJOCO_4:
        files += [*vectors(facts), ("powers.txt", powers_text(facts))]
        if not run.is_emulated:
            files.append((EPISODES, episodes(facts)))
    for name, content in files:
        path = folder / run.libm / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    (folder / NORMS).write_text("\n".join(norm_lines(facts["norm"])))


def belongs_to(name: str) -> Run:
    if name.startswith("sse2/"):
        return WITHOUT_FMA
    return FUSED if name.endswith(".options.golden") else PLAIN


class Recording:
    """All files, as far as this machine can record them, and why it could not record others."""

    def __init__(self, folder: Path) -> None:
        self.files: dict[str, bytes] = {}
        self.missing: dict[str, str] = {}
        runs = (FUSED, PLAIN, WITHOUT_FMA)
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            folders = dict(zip(runs, pool.map(lambda run: self._run(folder / "-".join(run), run), runs), strict=True))
            self.files[SCHEMA] = schema(machine())
            if not IS_MUJOCO_4:
                self._record_random(folders)

    def _record_random(self, folders: dict[Run, Path | None]) -> None:
        coretypes = coretype_lines()
        lines = (PLACE / RANDOM).read_text().splitlines()

        def stored(start: str, reason: str) -> list[str]:
            self.missing[f"{RANDOM}, {start}"] = reason
            return [line for line in lines if line.startswith(start)]

        norms, kernels = [], []
        for run, start in ((PLAIN, "norm plain "), (FUSED, "norm fused ")):
            where = folders[run]
            norms += (where / NORMS).read_text().splitlines() if where else stored(start, NO_EMULATOR)
        for cpu, found in coretypes.items():
            reason = NO_EMULATOR if cpu != "SkylakeX" else "neither this CPU nor the emulator has AVX-512"
            kernels += found or stored(f"coretype {cpu} ", reason)
        self.files[RANDOM] = random_text(machine(), norms, kernels)

    def _run(self, folder: Path, run: Run) -> Path | None:
        done = run.record(folder)
        if done is None:
            return None
        if done.returncode:
            raise SystemExit(f"{done.stderr[-2000:]}record.py: recording with {' and '.join(run)} failed")
        for path in folder.glob(f"{run.libm}/**/*.*"):
            self.files[str(path.relative_to(folder))] = path.read_bytes()
        return folder

    def why_missing(self, name: str) -> str | None:
        """Why this machine does not record a file; None where it does."""
        run = belongs_to(name)
        if name in self.files or not run.is_emulated:
            return None
        return "an emulator would need half an hour for it" if name.endswith(EPISODES) else NO_EMULATOR


NO_EMULATOR = f"it belongs to another kind of CPU, and there is no {EMULATOR} here (tools/setup emulator)"


def stored_facts(content: bytes) -> dict[str, str]:
    """The lines of a file that name versions and the machine."""
    keys = ("gymnasium", "mujoco", "numpy", "python", "cpu")
    text = content[: content.find(b"\ndata\n")].decode() if content.startswith(b"mjenv-golden") else content.decode()
    words = (part.strip().partition(" ") for line in text.splitlines() for part in line.lstrip("# ").split(","))
    return {key: value for key, _, value in words if key in keys}


def without_machine(content: bytes) -> bytes:
    """A file without the names that may change while all numbers stay."""
    facts = stored_facts(content)
    for key in ("python", "cpu"):
        content = content.replace(f"{key} {facts.get(key)}".encode(), key.encode(), 1)
    return content


def check(recording: Recording) -> bool:
    paths = [path for folder in ("fma", "sse2") for path in (PLACE / folder).rglob("*.*")]
    stored = [str(path.relative_to(PLACE)) for path in paths]
    equal, bad = 0, 0
    missing = dict(recording.missing)
    then: dict[str, str] = {}
    for name in sorted({*stored, *recording.files}):
        old = (PLACE / name).read_bytes() if (PLACE / name).exists() else b""
        then |= stored_facts(old)
        reason = recording.why_missing(name)
        if reason:
            missing[name] = reason
        elif name not in recording.files or not old:
            bad += 1
            print(f"{name}: {'not recorded any more' if old else 'missing'}")
        elif without_machine(old) != without_machine(recording.files[name]):
            bad += 1
            print(f"{name}: DIFFERS")
        else:
            equal += 1
    now = machine()
    for key, value in then.items():
        if value != now[key]:
            print(f"{key}: recorded with {value}, this is {now[key]}")
    for name, reason in missing.items():
        print(f"NOT CHECKED on this CPU ({libm()}): {name}: {reason}")
    print(f"record.py --check: {equal} files equal, {bad} differ, {len(missing)} not checked")
    return not bad


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare with the files that are there, write nothing")
    parser.add_argument("--into", nargs=3, metavar=("FOLDER", "LIBM", "KERNEL"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.into:
        record_run(Path(arguments.into[0]), Run(*arguments.into[1:]))
        return
    facts = machine()
    if not facts.items() >= WANTED.items() or facts["mujoco"] not in FOLDERS:
        raise SystemExit(f"record.py: this is {facts}, the goldens are of {WANTED} and MuJoCo {', '.join(FOLDERS)}")
    gymnasium.logger.min_level = gymnasium.logger.ERROR  # v4 is out of date
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)  # where MuJoCo's log bothers nobody
        recording = Recording(Path(folder))
        os.chdir(HERE)
    if arguments.check:
        sys.exit(not check(recording))
    if recording.missing or libm() != "fma":
        raise SystemExit("record.py: nothing is written: that needs a CPU with AVX-512, and " + EMULATOR)
    for name, content in sorted(recording.files.items()):
        path = PLACE / name
        if path.exists() and without_machine(path.read_bytes()) == without_machine(content):
            continue  # but for the machine's name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        print(f"{name}: {len(content)} bytes")


if __name__ == "__main__":
    main()
