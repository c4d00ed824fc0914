"""The blocks of code in the documents, and how each is run.

The rules for a document:
- The `python` blocks of a page are one program, from the top of the page to its end; so are the `julia` blocks.
- Each `c`, `cpp` or `rust` block is a program. A `c` block without a main is the body of a function.
- `sh` blocks are commands. They run in a checkout of the repository, with mjenv installed.
- A block with title="NAME" is a file, which is written before the first `sh` block of the page runs.
- Each `js` block is a program, which part javascript of tests/run runs (bindings/javascript/test/documents.test.js).
- A `text` block is what the block before it prints; "..." stands for any text.
- A comment above a block says when it runs: `<!-- long -->` only with --long; `<!-- long: training -->` only with
  --long, as a separate program, with the Python that `tools/setup training` makes; `<!-- not run: REASON -->` never.
  `<!-- mujoco4 -->` only with --mujoco4, which needs build/mujoco4 and takes the Python of `tools/setup mujoco4`.
  The `python` blocks of a page that are so marked are one program, which runs in the repository.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ("python", "julia", "c", "cpp", "rust", "sh")
FILES = ("cmake", "toml", "xml")
ELSEWHERE = ("js",)  # run by other tests

_BLOCK = re.compile(
    r"(?:^ *<!-- (?P<when>long|mujoco4|not run)(?:: (?P<how>.*?))? -->\n\s*)?"
    r'^(?P<indent> *)```(?P<language>\w*)(?: title="(?P<title>[\w./-]+)")?(?P<rest>[^\n]*)\n'
    r"(?P<text>.*?)^(?P=indent)```$",
    re.MULTILINE | re.DOTALL,
)


@dataclass
class Block:
    page: str
    line: int
    language: str
    text: str
    title: str | None = None
    when: str | None = None  # "long", "mujoco4", "not run", or None: always
    how: str | None = None  # of "long": the Python; of "not run": the reason
    output: str | None = None

    @property
    def where(self) -> str:
        return f"{self.page}:{self.line}"


def pages() -> list[str]:
    command = ("git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md")
    return sorted(subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split())


def blocks_of(page: str) -> list[Block]:
    """Raises ValueError for a block that breaks the rules."""
    found: list[Block] = []
    for block in _parsed(page, (ROOT / page).read_text()):
        if block.language == "text" and block.when is None:
            if not found or found[-1].title:
                raise ValueError(f"{block.where}: no block that could have printed this stands before it")
            found[-1].output = block.text
        else:
            found.append(block)
    return found


def _parsed(page: str, text: str) -> Iterator[Block]:
    end = 0
    for match in _BLOCK.finditer(text):
        line = text.count("\n", 0, match.start("indent")) + 1
        if "```" in text[end : match.start()] or match["rest"]:
            raise ValueError(f"{page}: cannot read the blocks before line {line}")
        end = match.end()
        indent = len(match["indent"])
        block = Block(
            page,
            line,
            match["language"],
            "".join(row[indent:] or "\n" for row in match["text"].splitlines(keepends=True)),
            match["title"],
            match["when"],
            match["how"],
        )
        _check(block)
        yield block
    if "```" in text[end:]:
        raise ValueError(f"{page}: cannot read a block after line {text.count(chr(10), 0, end) + 1}")
    if re.search(r"\n\n {4}\S", _BLOCK.sub("", text)):
        raise ValueError(f"{page}: an indented block, which nothing runs: fence it")


def _check(block: Block) -> None:
    if block.when == "not run" and not block.how:
        raise ValueError(f"{block.where}: no reason is given for not running it")
    if block.when is None and block.language not in (*PROGRAMS, *FILES, *ELSEWHERE, "text"):
        raise ValueError(f"{block.where}: nothing runs a block of {block.language or 'no language'}")
    if block.language in FILES and not block.title:
        raise ValueError(f"{block.where}: a file without a title")
