"""Records what NumPy returns, and Python's powers: random.txt and powers.txt."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from machine import CPUS, dot_products, emulator, hexed, lines_of

# Names of kernels, of which OpenBLAS 0.3.29 does not know the last two. On CPUs without AVX-512 a few names suffice.
FEW_CORETYPES = ("Nehalem", "Haswell", "SkylakeX", "SapphireRapids")
CORETYPES = (
    *("Nehalem", "Barcelona", "Atom", "Bobcat", "Sandybridge", "Bulldozer", "Piledriver", "Steamroller", "Excavator"),
    *("Haswell", "Zen", "SkylakeX", "Cooperlake", "SapphireRapids", "NoSuchKernel"),
)

# Where a fresh generator's normals take each path through the ziggurat: seed, index.
ZIGGURAT_PATHS = {
    "fast": ((0, 0), (0, 1)),
    "tail": ((1, 860), (0, 303)),
    "wedge": ((0, 701), (0, 126)),
    "tail_reject_tail": ((11, 2712), (41, 992)),
    "wedge_reject_fast": ((0, 74), (0, 205)),
    "wedge_reject_wedge": ((8, 2153), (0, 2590)),
    "wedge_reject_twice_fast": ((14, 3577), (13, 41)),
}
BULK = 1_000_000
# Ranges of one number, of 32 bits and more, and those that Lemire's method would have to reject most in.
INTEGER_RANGES = (
    (3, 4),
    (0, 2),
    (-5, 7),
    (0, 3_000_000_000),
    (0, 2**32 - 1),
    (0, 2**32),
    (0, 2**32 + 1),
    (-(10**12), 5 * 10**12),
    (-(2**63), 2**62),
    (-(2**63), 2**63 - 1),
)
PROBABILITIES = (0.1, 0.2, 0.0, 0.3, 0.4)
# Both of choice's methods without replacement, on either side of where it changes.
SAMPLES = ((1, 1), (10, 3), (10, 10), (5, 0), (1000, 600), (10000, 5000), (10001, 200), (10001, 201), (20000, 20000))
PERMUTATIONS = (0, 1, 2, 5, 1000)
RANDOM_SEEDS = (0, 1, 42, 2**32, 2**40 + 7, 2**63, 2**64 - 1, 2**128 + 5, 2**160 - 1)


def draws_between(before: Mapping[str, Any], after: Mapping[str, Any]) -> int:
    """How many numbers a PCG64 gave between two of its states."""
    generator = np.random.PCG64()
    generator.state = before  # type: ignore[assignment]  # NumPy's stub knows its own TypedDict alone
    for count in range(100):
        if generator.state["state"] == after["state"]:
            return count
        generator.random_raw()
    raise SystemExit("record.py: more than 100 draws for one normal")


def random_lines() -> Iterator[str]:
    for seed in RANDOM_SEEDS:
        sequence = np.random.SeedSequence(seed)
        state = np.random.PCG64(seed).state["state"]
        yield f"seed {seed:x}"
        yield "pool " + " ".join(f"{word:x}" for word in sequence.pool.tolist())
        yield "words " + " ".join(f"{word:x}" for word in sequence.generate_state(4, np.uint64).tolist())
        yield f"state {state['state']:032x}"
        yield f"inc {state['inc']:032x}"
        yield "raw " + " ".join(f"{word:x}" for word in np.random.PCG64(seed).random_raw(20).tolist())
        yield "uniform " + hexed(np.random.default_rng(seed).uniform(-0.1, 0.1, 20))
        yield "normal " + hexed(np.random.default_rng(seed).standard_normal(20))
    for path, places in ZIGGURAT_PATHS.items():
        for seed, index in places:
            generator = np.random.default_rng(seed)
            generator.standard_normal(index)
            before = generator.bit_generator.state
            value = generator.standard_normal()
            draws = draws_between(before, generator.bit_generator.state)
            yield f"branch {path} {seed} {index} {draws} {value.hex()}"
    yield f"bulk 0 {BULK} {checksum_of(np.random.default_rng(0).standard_normal(BULK))}"


def checksum_of(values: np.ndarray) -> str:
    """FNV-1a of 64 bits over words of 64 bits."""
    checksum = 0xCBF29CE484222325
    for word in values.view(np.uint64).tolist():
        checksum = (checksum ^ word) * 0x100000001B3 % 2**64
    return f"{checksum:016x}"


def drawn(generator: np.random.Generator, values: np.ndarray) -> str:
    """The checksum of drawn integers, and what the generator keeps for the next 32 bits."""
    state = generator.bit_generator.state
    words = (state["has_uint32"], state["uinteger"], int(generator.bit_generator.random_raw()))
    return f"{checksum_of(np.asarray(values, dtype=np.int64))} " + " ".join(f"{word:x}" for word in words)


def draw_lines() -> Iterator[str]:
    for seed in (0, 1):
        for low, high in INTEGER_RANGES:
            generator = np.random.default_rng(seed)
            numbers = [generator.integers(low, high) for _ in range(1000)]
            yield f"integers {seed} {low} {high} {drawn(generator, numbers)}"
        generator = np.random.default_rng(seed)
        yield f"choice {seed} 7 {drawn(generator, [generator.choice(7) for _ in range(1000)])}"
        generator = np.random.default_rng(seed)
        weighted = [generator.choice(len(PROBABILITIES), p=PROBABILITIES) for _ in range(1000)]
        yield f"weighted {seed} {hexed(PROBABILITIES)} {drawn(generator, weighted)}"
        for count, size in SAMPLES:
            generator = np.random.default_rng(seed)
            yield f"sample {seed} {count} {size} {drawn(generator, generator.choice(count, size, replace=False))}"
        for count in PERMUTATIONS:
            generator = np.random.default_rng(seed)
            yield f"permutation {seed} {count} {drawn(generator, generator.permutation(count))}"


def sum_terms(count: int) -> np.ndarray:
    """Numbers of mixed size and sign that any language can compute."""
    return np.array([((7919 * i + 13) % 1009) / 17.0 - 30.0 for i in range(count)])


def sum_lines() -> Iterator[str]:
    terms = sum_terms(300)
    narrow = terms.astype(np.float32)
    for count in range(len(terms) + 1):
        yield f"sum {count} {hexed([float(np.sum(terms[:count])), float(np.sum(narrow[:count]))])}"


def power_lines() -> Iterator[str]:
    numbers = np.random.default_rng(1).normal(scale=3.0, size=20000).tolist()
    special = [x for x in numbers if x**2 != x * x]
    for x in special + numbers[:20] + [0.0, -0.0, math.inf, -math.inf, 1e200, 1e-200]:
        yield f"power2 {hexed([x, np.float64(x) ** 2 if math.isinf(x) or abs(x) > 1e150 else x**2])}"


def norm_lines(rounding: str) -> Iterator[str]:
    generator = np.random.default_rng(2)
    for size in (2, 3):
        for vector in generator.normal(size=(100, size)):
            yield f"norm {rounding} {hexed([*vector, float(np.linalg.norm(vector))])}"
    terms = sum_terms(10000)
    for size in [*range(201), 1000, 1023, 5000, 10000]:
        yield f"norm {rounding} first {size} {hexed([float(np.linalg.norm(terms[:size]))])}"


def coretype_lines() -> dict[str, list[str]]:
    """The lines of random.txt for each CPU. There are none for a CPU that this one neither is nor can emulate."""
    own = dot_products([], None).split()[0]
    lines = {}
    for cpu in CPUS:
        prefix = [] if cpu == own else emulator(cpu)
        if prefix is None:
            lines[cpu] = []
            continue
        names = CORETYPES if cpu == "SkylakeX" else FEW_CORETYPES
        lines[cpu] = [f"coretype {cpu} {name} {dot_products(prefix, name).split()[1]}" for name in names]
    return lines


def powers_text(facts: dict[str, str]) -> bytes:
    head = ["mjenv-powers 1", "# power2 X Y: Python's X ** 2."]
    lines = [*head, *lines_of({key: facts[key] for key in ("python", "cpu", "libm")}), *power_lines()]
    return "\n".join(lines).encode() + b"\n"


def random_text(facts: dict[str, str], norms: list[str], coretypes: list[str]) -> bytes:
    head = [
        "# Seeds, pools, words, states and raw numbers are hexadecimal integers. uniform: 20 of uniform(-0.1, 0.1).",
        "# branch PATH SEED INDEX DRAWS VALUE: normal number INDEX of default_rng(SEED), made of DRAWS raw numbers.",
        "# bulk SEED N CHECKSUM: of the bits of N normals, as in episodes.txt.",
        "# integers SEED LOW HIGH, choice SEED N, weighted SEED P...: 1000 draws. sample SEED N SIZE: choice without",
        "# replacement. permutation SEED N. Then their checksum, has_uint32, uinteger and the next raw number.",
        "# sum N F8 F4: np.sum of the first N of ((7919*i + 13) % 1009) / 17 - 30 as float64 and as float32.",
        "# norm plain|fused X... Y: np.linalg.norm under the kernel Haswell|SkylakeX.",
        "# norm plain|fused first N Y: of the first N numbers of which `sum` has the sums.",
        "# coretype CPU NAME plain|fused|other|crash: how norms are rounded with NAME in OPENBLAS_CORETYPE on a CPU",
        "# for which OpenBLAS chooses the kernel CPU if the variable is unset.",
    ]
    lines = ["mjenv-random 1", *head, *lines_of({key: facts[key] for key in ("numpy", "python", "cpu")})]
    return "\n".join([*lines, *random_lines(), *draw_lines(), *sum_lines(), *norms, *coretypes]).encode() + b"\n"
