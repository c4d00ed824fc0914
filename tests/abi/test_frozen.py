"""frozen.py sees each kind of change, and lets pass what the version allows."""

from __future__ import annotations

import shutil
import tempfile
import unittest
from pathlib import Path

import frozen

HEADER = frozen.header.PATH.read_text(encoding="utf-8")

BREAKS = {
    "an enumerator's value": ("MJENV_E_NAME = -2", "MJENV_E_NAME = -22"),
    "an enumerator less": ("  MJENV_E_BUSY = -10, ", " "),
    "a constant's value": ("MJENV_ALL_ROWS (-1)", "MJENV_ALL_ROWS (-2)"),
    "a field's type": ("mjenv_dtype obs_dtype;", "int64_t obs_dtype;"),
    "a field's name": ("double *reward; ", "double *rewards; "),
    "a field in the middle": ("  double *reward; ", "  double *more; double *reward; "),
    "fields in another order": (
        "  const double *low;  /* [count], owned by the environment */\n  const double *high;",
        "  const double *high;\n  const double *low;",
    ),
    "an array's length": ("int64_t shape[4];", "int64_t shape[8];"),
    "a function less": ("MJENV_API int64_t mjenv_id_count(void);", ""),
    "a parameter's type": ("mjenv_id_at(int64_t index)", "mjenv_id_at(int32_t index)"),
    "a parameter more": ("mjenv_id_at(int64_t index)", "mjenv_id_at(int64_t index, int64_t more)"),
    "a result's type": ("MJENV_API int64_t mjenv_id_count", "MJENV_API int32_t mjenv_id_count"),
}
GROWS = {
    "a function": ("MJENV_API uint32_t mjenv_abi", "MJENV_API void mjenv_more(void);\nMJENV_API uint32_t mjenv_abi"),
    "an enumerator": ("MJENV_DTYPE_FLOAT32 = 1 }", "MJENV_DTYPE_FLOAT32 = 1, MJENV_DTYPE_FLOAT16 = 2 }"),
    "a field at the end": ("} mjenv_space;", "  int64_t more;\n} mjenv_space;"),
}


def changed(old: str, new: str) -> str:
    assert HEADER.count(old) == 1, old
    return HEADER.replace(old, new)


class Frozen(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        kept = frozen.ROOT, frozen.RECORDED, frozen.header.PATH
        self.addCleanup(lambda: self.point(*kept))
        self.point(self.root, self.root / "recorded", self.root / "mjenv.h")
        (self.root / "CHANGELOG.md").write_text("## 2.2.0 (unreleased)\n\n## 2.1.0\n", encoding="utf-8")
        self.write(HEADER)
        frozen.record("2.1.0", "so.1")

    def point(self, root: Path, recorded: Path, header: Path) -> None:
        frozen.ROOT, frozen.RECORDED, frozen.header.PATH = root, recorded, header

    def write(self, text: str) -> None:
        frozen.header.PATH.write_text(text, encoding="utf-8")

    def recorded_as(self, version: str, soname: str = "so.1") -> list[str]:
        frozen.record(version, soname)
        return frozen.problems(version, soname)

    def test_no_change(self) -> None:
        assert frozen.problems("2.1.0", "so.1") == []
        self.write(HEADER.replace("/* ", "/* changed comments, "))
        assert frozen.problems("2.1.0", "so.1") == []

    def test_any_change_is_seen(self) -> None:
        for name, change in (BREAKS | GROWS).items():
            with self.subTest(name):
                self.write(changed(*change))
                assert frozen.problems("2.1.0", "so.1") != []
                assert frozen.problems("2.2.0", "so.1") != []
                self.assertRaises(SystemExit, frozen.record, "2.1.0", "so.1")  # noqa: PT027
        self.write(HEADER)
        assert frozen.problems("2.1.0", "so.2") != []

    def test_a_break_needs_a_new_abi_and_a_new_soname(self) -> None:
        for name, change in BREAKS.items():
            with self.subTest(name):
                self.write(changed(*change))
                assert "without a new MJENV_ABI_VERSION" in " ".join(self.recorded_as("3.0.0"))
                self.write(changed(*change).replace("MJENV_ABI_VERSION 1", "MJENV_ABI_VERSION 2"))
                assert "so.1 was 2.1.0's" in " ".join(self.recorded_as("3.0.0"))
                assert self.recorded_as("3.0.0", "so.2") == []

    def test_growth_needs_a_new_minor_version(self) -> None:
        for name, change in GROWS.items():
            with self.subTest(name):
                self.write(changed(*change))
                assert "needs a new minor version" in " ".join(self.recorded_as("2.1.1"))
                shutil.rmtree(frozen.RECORDED / "2.1.1")
                assert self.recorded_as("2.2.0") == []

    def test_what_is_unreleased_may_change_but_not_against_the_released(self) -> None:
        self.write(changed(*GROWS["a function"]))
        assert self.recorded_as("2.2.0") == []
        self.write(HEADER)
        assert self.recorded_as("2.2.0") == []
        self.write(changed(*BREAKS["a function less"]))
        assert self.recorded_as("2.2.0") != []


if __name__ == "__main__":
    unittest.main()
