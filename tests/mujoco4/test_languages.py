"""C, C++, Rust and Julia on MuJoCo 4.0: the examples' episodes equal Gymnasium's, and bad libraries are refused.

Uses build/libmjenv.so and build/mujoco4/libmjenv-mujoco4.so, which are installed into one prefix as a user would.
"""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).resolve().parents[1] / "golden"))
import machine
from episodes import example_episodes

ROOT = Path(__file__).resolve().parents[2]
WORK = ROOT / "build" / "mujoco4" / "languages"
EXAMPLES = ROOT / "examples"
IDS = ("Hopper-v5", "Reacher-v4", "Humanoid-v5")


@cache
def gymnasiums(id: str) -> tuple[int, str]:
    """How many steps the examples' episodes have, and their checksum."""
    _, _, length, _, checksum = example_episodes(id, norm()).split()
    return int(length), checksum


@cache
def norm() -> str:
    return machine.norm_rounding()


@cache
def mujoco_library() -> Path:
    """The library of the installed mujoco package."""
    spec = importlib.util.find_spec("mujoco")
    assert spec
    assert spec.submodule_search_locations
    (found,) = Path(spec.submodule_search_locations[0]).glob("libmujoco.so.4.0.*")
    return found


@cache
def setup(part: str) -> str:
    return output(ROOT / "tools" / "setup", part).strip()


def run(*command: str | Path, **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("MJENV_", "PYTHONPATH"))}
    if "MJENV_CACHE" in os.environ:
        environment["MJENV_CACHE"] = os.environ["MJENV_CACHE"]
    return subprocess.run(
        list(map(str, command)), env=environment | variables, capture_output=True, text=True, cwd=ROOT
    )


def output(*command: str | Path, **variables: str) -> str:
    done = run(*command, **variables)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def plays(*command: str | Path, **variables: str) -> None:
    """The command prints Gymnasium's episodes of IDS."""
    lines = output(*command, *IDS, **variables).splitlines()
    assert len(lines) == len(IDS)
    for id, line in zip(IDS, lines, strict=True):
        name, steps, _, _, checksum = line.split("\t")
        assert (name, int(steps), checksum) == (id, *gymnasiums(id)), line


@pytest.fixture(scope="module")
def prefix() -> Path:
    """Both libraries, installed into one prefix. That on 4.0 forgets where MuJoCo was when it was built."""
    shutil.rmtree(WORK, ignore_errors=True)
    for build in ("build", "build/mujoco4"):
        output("cmake", "--install", ROOT / build, "--prefix", WORK / "prefix")
    (library,) = (WORK / "prefix").rglob("libmjenv-mujoco4.so.*.*.*")
    script = WORK / "forget.cmake"
    script.write_text(f'file(RPATH_REMOVE FILE "{library}")\n')
    output("cmake", "-P", script)
    return WORK / "prefix"


@pytest.fixture(scope="module")
def libraries(prefix: Path) -> Path:
    return next(prefix.rglob("libmjenv-mujoco4.so")).parent


@pytest.fixture(scope="module")
def programs(prefix: Path) -> Path:
    """The C and C++ examples, linked with mjenv::mujoco4."""
    build = WORK / "programs"
    output("cmake", "-G", "Ninja", "-S", EXAMPLES, "-B", build, f"-DCMAKE_PREFIX_PATH={prefix}", "-DCOMPONENT=mujoco4")
    output("cmake", "--build", build, "--target", "episodes", "dlopen", "linked")
    return build


def test_both_libraries_are_installed_side_by_side(prefix: Path, libraries: Path) -> None:
    names = {path.name for path in libraries.iterdir()}
    assert {"libmjenv.so", "libmjenv.so.1", "libmjenv-mujoco4.so", "libmjenv-mujoco4.so.1"} <= names
    variables = {"PKG_CONFIG_PATH": str(libraries / "pkgconfig")}
    assert output("pkg-config", "--libs-only-l", "mjenv", **variables).split() == ["-lmjenv"]
    assert output("pkg-config", "--libs-only-l", "mjenv-mujoco4", **variables).split() == ["-lmjenv-mujoco4"]


def test_cpp_by_find_package(programs: Path) -> None:
    plays(programs / "episodes", norm(), MJENV_MUJOCO=str(mujoco_library()))


def test_c_by_dlopen(programs: Path, libraries: Path) -> None:
    plays(programs / "dlopen", libraries / "libmjenv-mujoco4.so", norm(), MJENV_MUJOCO=str(mujoco_library()))


def test_c_by_pkg_config(libraries: Path) -> None:
    flags = output("pkg-config", "--cflags", "--libs", "mjenv-mujoco4", PKG_CONFIG_PATH=str(libraries / "pkgconfig"))
    program = WORK / "by-pkg-config"
    output("cc", EXAMPLES / "c" / "linked.c", *flags.split(), f"-Wl,-rpath,{libraries}", "-o", program)
    for id in IDS:
        line = output(program, id, MJENV_MUJOCO=str(mujoco_library()))
        assert line.split("\t")[1] == str(gymnasiums(id)[0])


def test_the_loader_finds_an_installed_mujoco(programs: Path) -> None:
    plays(programs / "episodes", norm(), LD_LIBRARY_PATH=str(mujoco_library().parent))


def test_a_missing_component_is_named(prefix: Path) -> None:
    (prefix / "only").mkdir()
    output("cmake", "--install", ROOT / "build/mujoco4", "--prefix", prefix / "only")
    command = ("cmake", "-G", "Ninja", "-S", EXAMPLES, "-B", WORK / "missing", f"-DCMAKE_PREFIX_PATH={prefix / 'only'}")
    done = run(*command, "-DCOMPONENT=mjenv")
    assert done.returncode != 0
    assert "mjenv::mjenv is not installed" in re.sub(r"\s+", " ", done.stderr)
    output(*command, "-DCOMPONENT=mujoco4")


BAD = {
    "none": ({}, "there is no library of MuJoCo 4.0"),
    "broken": ({"MJENV_MUJOCO": "/dev/null"}, "MJENV_MUJOCO: /dev/null"),
    "missing": ({"MJENV_MUJOCO": "/nowhere/libmujoco.so.4.0.0"}, "MJENV_MUJOCO: /nowhere/libmujoco.so.4.0.0"),
    "not MuJoCo": ({"MJENV_MUJOCO": "libm.so.6"}, "MuJoCo's library has no mj_version"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_library_is_refused(programs: Path, case: str) -> None:
    variables, reason = BAD[case]
    done = run(programs / "episodes", norm(), "Hopper-v5", **variables)
    assert done.returncode == 1
    assert "MJENV_E_FILE" in done.stderr
    assert reason in done.stderr
    assert "pip install 'mujoco-core>=4.0,<4.1'" in done.stderr


@pytest.mark.parametrize("part", [1, 5, 10, 14])
def test_a_library_that_is_cut_off_is_refused(programs: Path, tmp_path: Path, part: int) -> None:
    file = tmp_path / "libmujoco.so.4.0.0"
    whole = mujoco_library().read_bytes()
    file.write_bytes(whole[: len(whole) * part // 16])
    done = run(programs / "episodes", norm(), "Hopper-v5", MJENV_MUJOCO=str(file))
    assert done.returncode == 1
    assert f"MJENV_MUJOCO: {file}: it is damaged: it ends before what its headers describe" in done.stderr


def test_a_pipe_is_refused(programs: Path, tmp_path: Path) -> None:
    file = tmp_path / "libmujoco.so.4.0.0"
    os.mkfifo(file)
    done = run(programs / "episodes", norm(), "Hopper-v5", MJENV_MUJOCO=str(file))
    assert done.returncode == 1
    assert f"MJENV_MUJOCO: {file}: it is not a regular file" in done.stderr


def test_the_wrong_version_is_refused(programs: Path) -> None:
    installed = output("sh", "-c", "ldconfig -p | awk '$1 == \"libmujoco.so.2.2.2\" { print $NF; exit }'").strip()
    done = run(programs / "episodes", norm(), "Hopper-v5", MJENV_MUJOCO=installed)
    assert done.returncode == 1
    assert "MuJoCo's library is 2.2.2, and this mjenv is for MuJoCo 4.0" in done.stderr


def cargo(*arguments: str | Path, libraries: Path, **variables: str) -> str:
    target = {"CARGO_TARGET_DIR": str(ROOT / "build" / "mujoco4" / "rust"), "MJENV_LIB_DIR": str(libraries)}
    return output(setup("rust"), *arguments, MJENV_MUJOCO=str(mujoco_library()), **target, **variables)


def test_rust(libraries: Path) -> None:
    manifest = EXAMPLES / "rust" / "Cargo.toml"
    cargo("build", "--offline", "--features", "mujoco4", "--manifest-path", manifest, libraries=libraries)
    program = ROOT / "build" / "mujoco4" / "rust" / "debug" / "episodes"
    plays(program, "--norm", norm(), MJENV_MUJOCO=str(mujoco_library()))


def test_rusts_own_tests(libraries: Path) -> None:
    manifest = ROOT / "bindings" / "rust" / "Cargo.toml"
    chosen = ("--package", "mjenv", "--features", "mujoco4", "--test", "mujoco4")
    assert "2 passed" in cargo("test", "--offline", "--manifest-path", manifest, *chosen, libraries=libraries)


def test_rust_names_a_library_that_is_missing(tmp_path: Path) -> None:
    manifest = EXAMPLES / "rust" / "Cargo.toml"
    target = {"CARGO_TARGET_DIR": str(ROOT / "build" / "mujoco4" / "rust"), "MJENV_LIB_DIR": str(tmp_path)}
    done = run(setup("rust"), "build", "--offline", "--features", "mujoco4", "--manifest-path", manifest, **target)
    assert done.returncode != 0
    assert "libmjenv-mujoco4.so" in done.stderr


JULIA = ("--startup-file=no", "--threads=2")


def julia(program: Path, *arguments: str, library: Path, **variables: str) -> tuple[list[str | Path], dict[str, str]]:
    """A command and its environment."""
    own = {
        "JULIA_LOAD_PATH": f"{ROOT / 'bindings' / 'julia'}:@stdlib",
        "MJENV_LIBRARY": str(library),
        "MJENV_MUJOCO": str(mujoco_library()),
    }
    return [setup("julia"), *JULIA, program, *arguments], own | variables


def test_julia(libraries: Path) -> None:
    program = EXAMPLES / "julia" / "episodes.jl"
    command, variables = julia(program, "--norm", norm(), library=libraries / "libmjenv.so", MJENV_ENGINE="4.0")
    plays(*command, **variables)


def test_both_engines_in_one_julia(libraries: Path) -> None:
    program = ROOT / "tests" / "mujoco4" / "both_engines.jl"
    command, variables = julia(program, library=libraries / "libmjenv-mujoco4.so")
    told = output(*command, **variables)
    assert re.search(r"both engines +\| +\d+ +\d+$", told, re.MULTILINE), told
