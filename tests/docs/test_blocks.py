"""Every block of code in the documents runs and prints what the page says. blocks.py explains the rules."""

from __future__ import annotations

import functools
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

import blocks
from blocks import ROOT, Block

WORK = ROOT / "build" / "docs"
TREE = WORK / "tree"
PREFIX = WORK / "prefix"
SEPARATOR = "\x1e"  # printed after each block of a program
BLOCKS = [block for page in blocks.pages() for block in blocks.blocks_of(page)]
COMPILERS = {
    "c": ("cc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-x", "c"),
    "cpp": ("c++", "-std=c++17", "-Wall", "-Wextra", "-Werror", "-x", "c++"),
}
PYTHON_DRIVER = f"""
import sys, types
main = sys.modules["__main__"] = types.ModuleType("__main__")
for text in sys.argv[1].split({SEPARATOR!r}):
    exec(compile(text, "block", "exec"), main.__dict__)
    print({SEPARATOR!r}, end="", flush=True)
"""


@functools.cache
def setup(part: str) -> str:
    """The path of a program that tools/setup finds or installs."""
    return subprocess.run(
        [ROOT / "tools" / "setup", part], stdout=subprocess.PIPE, text=True, check=True
    ).stdout.strip()


@functools.cache
def environment() -> dict[str, str]:
    """The environment variables of a user who has installed the library (`cmake --install`) and the Python package."""
    shutil.rmtree(PREFIX, ignore_errors=True)
    subprocess.run(["cmake", "--install", ROOT / "build", "--prefix", PREFIX], check=True, stdout=subprocess.DEVNULL)
    libraries = next(PREFIX.rglob("libmjenv.so")).parent
    return {
        **os.environ,
        "CMAKE_PREFIX_PATH": str(PREFIX),
        "JULIA_LOAD_PATH": f"{ROOT / 'bindings' / 'julia'}:@stdlib",
        "LD_LIBRARY_PATH": str(libraries),
        "MJENV_LIBRARY": str(libraries / "libmjenv.so"),
        "PATH": f"{Path(setup('reference')).parent}:{os.environ['PATH']}",
        "PKG_CONFIG_PATH": str(libraries / "pkgconfig"),
        "PYTHONPATH": ":".join(map(str, [ROOT / "bindings" / "python" / "src", *ROOT.glob("extras/*/python")])),
        "PYTHONWARNINGS": "ignore",
    }


def tree() -> Path:
    """A new copy of the repository, into which commands can write files."""
    shutil.rmtree(TREE, ignore_errors=True)
    command = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            (TREE / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, TREE / name)
    return TREE


def name(block: Block) -> str:
    """The name of the block's program."""
    return re.sub(r"\W", "_", block.where)


def run(command: list[str], cwd: Path = WORK, **variables: str) -> str:
    WORK.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(
        command,
        cwd=cwd,
        env={**environment(), **variables},
        capture_output=True,
        stdin=subprocess.DEVNULL,
        text=True,
    )
    assert done.returncode == 0, f"{' '.join(command)[-2000:]}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def compare(block: Block, printed: str) -> None:
    if block.output is None:
        return
    pattern = re.escape(block.output.rstrip("\n")).replace(r"\.\.\.", ".*")
    assert re.fullmatch(pattern, printed.rstrip("\n"), re.DOTALL), f"{block.where}: it printed\n{printed}"


def run_programs(language: str, program: list[Block], python: str = "reference", folder: Path = WORK) -> None:
    texts = [block.text for block in program]
    if language == "python":
        printed = run([setup(python), "-c", PYTHON_DRIVER, SEPARATOR.join(texts)], folder)
    else:
        script = "".join(f'{text}\nprint("{SEPARATOR}")\n' for text in texts)
        WORK.mkdir(parents=True, exist_ok=True)
        (WORK / "blocks.jl").write_text(script)
        printed = run([setup("julia"), "--startup-file=no", str(WORK / "blocks.jl")], folder)
    for block, part in zip(program, printed.split(SEPARATOR)[:-1], strict=True):
        compare(block, part)


def compiled(block: Block) -> Path:
    text, folder = block.text, WORK / "programs"
    if not re.search(r"\bmain\(", text):
        text = f"#include <mjenv/mjenv.h>\nint main(void) {{\n{text}\nreturn 0;\n}}\n"
    folder.mkdir(parents=True, exist_ok=True)
    program = folder / name(block)
    source = program.with_name(f"{program.name}.source")
    source.write_text(text)
    flags = run(["pkg-config", "--cflags", "--libs", "mjenv"]).split()
    if "<mjenv/learn.h" in text:  # learn.h or learn.hpp
        flags.append("-lmjenv-learn")
    run([*COMPILERS[block.language], str(source), "-x", "none", *flags, "-o", str(program)])
    return program


@functools.cache
def crate() -> Path:
    """All blocks of Rust, compiled at once as examples of a crate."""
    folder = WORK / "rust"
    shutil.rmtree(folder / "examples", ignore_errors=True)
    (folder / "examples").mkdir(parents=True)
    (folder / "src").mkdir(exist_ok=True)
    (folder / "src" / "lib.rs").touch()
    folders = {"mjenv": ROOT / "bindings/rust/mjenv"}
    folders |= {f"mjenv-{folder.parent.name}": folder for folder in ROOT.glob("extras/*/rust")}
    dependencies = "\n".join(f'{crate} = {{ path = "{folder}" }}' for crate, folder in folders.items())
    package = '[package]\nname = "blocks"\nversion = "0.0.0"\nedition = "2021"\n\n[workspace]\n\n[dependencies]\n'
    (folder / "Cargo.toml").write_text(f"{package}{dependencies}\n")
    for block in BLOCKS:
        if block.language == "rust" and not block.title and block.when is None:
            (folder / "examples" / f"{name(block)}.rs").write_text(block.text)
    run([setup("rust"), "build", "--quiet", "--offline", "--examples"], folder)
    return folder / "target" / "debug" / "examples"


def test_all_blocks_are_by_the_rules() -> None:
    assert len(BLOCKS) > 20
    for block in BLOCKS:
        if block.title:
            commands = [other for other in BLOCKS if other.page == block.page and other.language == "sh"]
            assert commands, f"{block.where}: the page has no commands that could use {block.title}"


def of(*languages: str, when: str | None = None) -> list[Block]:
    return [block for block in BLOCKS if block.language in languages and block.when == when and not block.title]


def where(block: Block) -> str:
    return block.where


def pages_with(language: str, when: str | None = None) -> list[str]:
    return sorted({block.page for block in of(language, when=when)})


@pytest.mark.parametrize("page", pages_with("python"))
def test_python(page: str) -> None:
    run_programs("python", [block for block in of("python") if block.page == page])


@pytest.mark.parametrize("block", of("python", when="long"), ids=where)
def test_long_python(block: Block, pytestconfig: pytest.Config) -> None:
    if not pytestconfig.getoption("long"):
        pytest.skip("--long")
    run_programs("python", [block], block.how or "reference")


@pytest.mark.parametrize("page", pages_with("julia"))
def test_julia(page: str) -> None:
    run_programs("julia", [block for block in of("julia") if block.page == page])


@pytest.mark.parametrize("block", of("c", "cpp"), ids=where)
def test_compiled(block: Block) -> None:
    compare(block, run([str(compiled(block))]))


@pytest.mark.parametrize("block", of("rust"), ids=where)
def test_rust(block: Block) -> None:
    compare(block, run([str(crate() / name(block))]))


@pytest.mark.parametrize("page", sorted({block.page for block in BLOCKS if block.language == "sh"}))
def test_commands(page: str, pytestconfig: pytest.Config) -> None:
    chosen = {None, "long"} if pytestconfig.getoption("long") else {None}
    shell = [block for block in BLOCKS if block.page == page and block.language == "sh"]
    run_commands(page, [block for block in shell if block.when in chosen])


def run_commands(page: str, commands: list[Block]) -> None:
    folder = tree()
    for block in BLOCKS:
        if block.page == page and block.title:
            (folder / block.title).parent.mkdir(parents=True, exist_ok=True)
            (folder / block.title).write_text(block.text)
    variables = installing(folder) if any("pip install" in block.text for block in commands) else {}
    for block in commands:
        # `cmake --install` writes into the folder instead of the system. pip also runs it, but must not be redirected.
        variables["DESTDIR"] = str(folder / "system") if "cmake --install" in block.text else ""
        python = "mujoco4" if block.when == "mujoco4" else block.how
        if python:
            variables["PATH"] = f"{Path(setup(python)).parent}:{os.environ['PATH']}"
        compare(block, run(["bash", "-euo", "pipefail", "-c", block.text], folder, **variables))


def installing(folder: Path) -> dict[str, str]:
    """A virtual environment to install packages into."""
    venv = folder / ".venv"  # where the documents make it
    subprocess.run([setup("python"), "-m", "venv", "--clear", venv], check=True)
    return {"PATH": f"{venv / 'bin'}:{os.environ['PATH']}", "PYTHONPATH": "", "MJENV_LIBRARY": ""}


@pytest.fixture(scope="session")
def mujoco4() -> None:
    """Installs the library on MuJoCo 4.0 beside the other. It finds MuJoCo where it was when it was built."""
    environment()
    command = ["cmake", "--install", ROOT / "build" / "mujoco4", "--prefix", PREFIX]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


@pytest.mark.usefixtures("mujoco4")
@pytest.mark.parametrize("page", pages_with("python", "mujoco4"))
def test_mujoco4_python(page: str) -> None:
    run_programs("python", [block for block in of("python", when="mujoco4") if block.page == page], "mujoco4", ROOT)


@pytest.mark.usefixtures("mujoco4")
@pytest.mark.parametrize("page", pages_with("julia", "mujoco4"))
def test_mujoco4_julia(page: str) -> None:
    run_programs("julia", [block for block in of("julia", when="mujoco4") if block.page == page], "mujoco4", ROOT)


@pytest.mark.usefixtures("mujoco4")
@pytest.mark.parametrize("page", pages_with("sh", "mujoco4"))
def test_mujoco4_commands(page: str) -> None:
    run_commands(page, [block for block in of("sh", when="mujoco4") if block.page == page])
