"""An image names the MuJoCo that it was made on, and the library for another MuJoCo refuses it."""

from __future__ import annotations

import os
from ctypes import byref, c_size_t, c_void_p, create_string_buffer
from pathlib import Path
from typing import Any

import pytest

from mjenv import _abi

LIBRARY = Path(os.environ["MJENV_LIBRARY"])  # conftest.py sets it
LIBRARIES = {"2.2.2": str(LIBRARY), "4.0.0": str(LIBRARY.with_name("libmjenv-mujoco4.so"))}
PAIRS = [("2.2.2", "4.0.0"), ("4.0.0", "2.2.2")]


class Env:
    def __init__(self, version: str, id: str) -> None:
        self.library: Any = _abi.Library(LIBRARIES[version])
        assert f"(MuJoCo {version})" in self.library.mjenv_version().decode()
        options, self.handle = c_void_p(), c_void_p()
        self.check(self.library.mjenv_options_create(id.encode(), byref(options)))
        self.check(self.library.mjenv_create(options, 1, byref(self.handle)))
        self.check(self.library.mjenv_reset(self.handle, None, None))

    def check(self, status: int) -> None:
        assert status == _abi.Status.OK, self.library.mjenv_last_error().decode()

    def image(self) -> bytes:
        size = c_size_t()
        self.check(self.library.mjenv_snapshot(self.handle, 0, None, 0, byref(size)))
        image = create_string_buffer(size.value)
        self.check(self.library.mjenv_snapshot(self.handle, 0, image, size, byref(size)))
        return image.raw

    def restore(self, image: bytes) -> str:
        """Returns the reason of a refusal, or an empty text."""
        status = self.library.mjenv_restore(self.handle, 0, image, len(image))
        if status == _abi.Status.OK:
            return ""
        assert status == _abi.Status.E_SNAPSHOT
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
