"""An image names the MuJoCo that it was made on, and the library for another MuJoCo refuses it."""

from __future__ import annotations

import os
import struct
import sys
from ctypes import byref, c_double, c_int64, c_void_p, create_string_buffer
from pathlib import Path
from typing import Any

import pytest

from mjenv.capi import declarations
from mjenv_command import snapshots

sys.path.append(str(Path(__file__).resolve().parents[4] / "tests/golden"))
from episodes import Checksum

LIBRARY = Path(os.environ["MJENV_LIBRARY"])  # conftest.py sets it
LIBRARIES = {"2.2.2": str(LIBRARY), "4.0.0": str(LIBRARY.with_name("libmjenv-mujoco4.so"))}
PAIRS = [("2.2.2", "4.0.0"), ("4.0.0", "2.2.2")]


class Env:
    def __init__(self, version: str, id: str, xml: str = "") -> None:
        self.library: Any = declarations.Library(LIBRARIES[version])
        assert f"(MuJoCo {version})" in self.library.mjenv_version().decode()
        options, self.handle = c_void_p(), c_void_p()
        self.check(self.library.mjenv_options_create(id.encode(), byref(options)))
        if xml:
            self.check(self.library.mjenv_options_set_string(options, b"xml_string", xml.encode()))
        self.check(self.library.mjenv_create(options, 1, byref(self.handle)))
        self.reset()

    def check(self, status: int) -> None:
        assert status == declarations.Status.OK, self.library.mjenv_last_error().decode()

    def reset(self) -> None:
        self.check(self.library.mjenv_reset(self.handle, None, None))

    def image(self) -> bytes:
        size = c_int64()
        self.check(self.library.mjenv_snapshot(self.handle, 0, None, 0, byref(size)))
        image = create_string_buffer(size.value)
        self.check(self.library.mjenv_snapshot(self.handle, 0, image, size, byref(size)))
        return image.raw

    def restore(self, image: bytes) -> str:
        """Returns the reason of a refusal, or an empty text."""
        status = self.library.mjenv_restore(self.handle, 0, image, len(image))
        if status == declarations.Status.OK:
            return ""
        assert status == declarations.Status.E_SNAPSHOT
        return str(self.library.mjenv_last_error().decode())


@pytest.mark.parametrize(("made_on", "other"), PAIRS)
@pytest.mark.parametrize("id", ["Ant-v5", "Reacher-v4"])
def test_the_other_engine_refuses(id: str, made_on: str, other: str) -> None:
    maker, taker = Env(made_on, id), Env(other, id)
    image = maker.image()
    assert f"was made on MuJoCo {made_on}, but this environment uses MuJoCo {other}" in taker.restore(image)
    assert Env(made_on, id).restore(image) == ""
    assert maker.restore(image) == ""
    assert taker.restore(taker.image()) == ""


DELAYS = """<mujoco>
  <worldbody><body><joint name="j"/><geom size="0.1" pos="0.2 0 0"/></body></worldbody>
  <actuator><motor joint="j"/><motor joint="j" delay="0.01" nsample="4" interp="linear"/></actuator>
  <sensor><jointpos joint="j" delay="0.01" nsample="3"/><framepos objtype="body" objname="world"/></sensor>
</mujoco>"""
HISTORY = 1 + 1 + 1 + 0 + 1 + 2  # after time, qpos, qvel, act, qacc_warmstart, ctrl
# A cursor comes after a number, and before the times and values of the samples.
CURSORS = {1: 4, (2 + 2 * 4) + 1: 3}
CHECKSUM = snapshots.STAMP.size - 8


def offset_of(image: bytes, part: str) -> int:
    """Where the histories in a part of the image's row begin."""
    *_, part_count, array_count, _ = snapshots.STAMP.unpack_from(image)
    start = snapshots.STAMP.size + (part_count + array_count) * snapshots.ENTRY.size
    for index in range(part_count):
        name, _, size = snapshots._entry(image, index)
        if name == part:
            return start + (0 if part == "set_constants_rest" else 8 * HISTORY)
        start += size
    raise AssertionError(f"the image has no part {part}")


def forged(image: bytes, offset: int, value: float) -> bytes:
    """The image of a row with another number, under a checksum that fits."""
    changed = bytearray(image)
    struct.pack_into("d", changed, offset, value)
    checksum = Checksum()
    for byte in changed[snapshots.STAMP.size :]:
        checksum.add_word(byte)
    struct.pack_into("Q", changed, CHECKSUM, checksum.value)
    return bytes(changed)


# The present state, those before the last mj_step and mj_forward, and what mj_setConst was called with.
@pytest.mark.parametrize("part", ["state", "first_state", "set_state_state", "set_constants_rest"])
@pytest.mark.parametrize(("cursor", "samples"), CURSORS.items())
def test_a_cursor_outside_of_its_history_is_refused(cursor: int, samples: int, part: str) -> None:
    env = Env("4.0.0", "Model-v0", DELAYS)
    library, numbers = env.library, (c_double * 2)(0, 0)
    env.check(library.mjenv_step(env.handle, None, numbers, 2, declarations.Dtype.FLOAT64, None))
    env.check(library.mjenv_set_state(env.handle, 0, numbers, 1, numbers, 1))
    env.check(library.mjenv_set_constants(env.handle, None))
    image = env.image()
    offset = offset_of(image, part) + 8 * cursor
    assert struct.unpack_from("d", image, offset)[0] in range(samples)
    for good in range(samples):
        assert env.restore(forged(image, offset, good)) == ""
        env.reset()
    for bad in (-1, -0.5, 0.5, samples, 2**31 - 1, -(2.0**31), 1e300, float("inf"), -float("inf"), float("nan")):
        assert "damaged" in env.restore(forged(image, offset, bad)), bad
