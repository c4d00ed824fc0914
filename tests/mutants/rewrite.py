"""Copies the project, and rewrites the lane code of the copy so that it contains all mutants at once.

A mutant is the lane code with one small change, such as + for -. Each place that some mutant changes becomes a call of
a function in mutants.hpp, which asks at run time whether the mutant is chosen.
"""

from __future__ import annotations

import collections
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from clang.cindex import Cursor, CursorKind, Index, TypeKind

ROOT = Path(__file__).resolve().parents[2]
LANES = Path("core/engine/lanes")

# Of each operator: the function in mutants.hpp, and the mutant's operator
BINARY = {
    "+": ("plus", "-"),
    "-": ("minus", "+"),
    "*": ("times", "+"),
    "/": ("over", "*"),
    "%": ("modulo", "/"),
    "&": ("both", "|"),
    "|": ("either", "&"),
    "^": ("unlike", "&"),
    "<<": ("left", ">>"),
    ">>": ("right", "<<"),
    "<": ("less", "<="),
    "<=": ("less_equal", "<"),
    ">": ("greater", ">="),
    ">=": ("greater_equal", ">"),
}
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")
# Of each assignment: the function for its right operand, and what the mutant has instead
COMPOUND = {
    "+=": ("opposite", "-="),
    "-=": ("opposite", "+="),
    "*=": ("opposite", "*= -"),
    "/=": ("opposite", "/= -"),
    "|=": ("complement", "|= ~"),
    "&=": ("complement", "&= ~"),
}
CONSTANT = {
    CursorKind.ENUM_DECL,
    CursorKind.STATIC_ASSERT,
    CursorKind.TYPE_ALIAS_DECL,
    CursorKind.TYPEDEF_DECL,
    CursorKind.CXX_UNARY_EXPR,  # sizeof
}
POINTERS = {TypeKind.POINTER, TypeKind.CONSTANTARRAY, TypeKind.INCOMPLETEARRAY}
# Which children of a statement are statements themselves
STATEMENTS = {
    CursorKind.COMPOUND_STMT: slice(None),
    CursorKind.CASE_STMT: slice(None),
    CursorKind.DEFAULT_STMT: slice(None),
    CursorKind.IF_STMT: slice(1, None),
    CursorKind.FOR_STMT: slice(-1, None),
    CursorKind.WHILE_STMT: slice(-1, None),
    CursorKind.CXX_FOR_RANGE_STMT: slice(-1, None),
}
LITERALS = {CursorKind.INTEGER_LITERAL, CursorKind.FLOATING_LITERAL}


@dataclass(frozen=True)
class Change:
    """What a mutant replaces, and the call that can do it.

    rank: of two calls around the same text, that of the higher rank is outside.
    """

    start: int
    end: int
    new: str
    call: tuple[int, int, str, str]  # where it begins and ends, and what is inserted there; {} is the mutant's number
    has_comma: bool = False  # instead of the operator
    rank: int = 0


@dataclass
class File:
    path: Path
    text: str
    changes: dict[Change, str] = field(default_factory=dict)  # and the function that contains it


def span(cursor: Cursor) -> tuple[int, int]:
    return cursor.extent.start.offset, cursor.extent.end.offset


def bare(cursor: Cursor) -> Cursor:
    """The expression without parentheses and conversions around it."""
    while cursor.kind in (CursorKind.UNEXPOSED_EXPR, CursorKind.PAREN_EXPR):
        children = list(cursor.get_children())
        if len(children) != 1:
            break
        cursor = children[0]
    return cursor


class Finder:
    """Finds what the mutants of one file change."""

    def __init__(self, file: File) -> None:
        self.file = file
        self.function = ""

    def add(self, change: Change) -> None:
        self.file.changes.setdefault(change, self.function)

    def wrap(self, cursor: Cursor, function: str, new: str, rank: int) -> None:
        start, end = span(cursor)
        self.add(Change(start, end, new, (start, end, f"mutants::{function}({{}}, ", ")"), rank=rank))

    def operator(self, cursor: Cursor) -> tuple[str, int]:
        """The operator between two operands and its offset; "" if there is none, as in a macro."""
        children = list(cursor.get_children())
        if len(children) != 2:
            return "", 0
        start, end = span(children[0])[1], span(children[1])[0]
        gap = self.file.text[start:end] if span(children[0])[0] < start <= end else ""
        gap = re.sub(r"//[^\n]*|/\*.*?\*/", lambda comment: " " * len(comment[0]), gap, flags=re.S)
        return gap.strip(), start + len(gap) - len(gap.lstrip())

    def is_operator(self, cursor: Cursor, *operators: str) -> bool:
        cursor = bare(cursor)
        return cursor.kind == CursorKind.BINARY_OPERATOR and self.operator(cursor)[0] in operators

    def condition(self, cursor: Cursor) -> None:
        """A condition that is no operator which has mutants of its own."""
        inner = bare(cursor)
        is_not = inner.kind == CursorKind.UNARY_OPERATOR and self.file.text[span(inner)[0]] == "!"
        if not is_not and not self.is_operator(cursor, *COMPARISONS, "&&", "||"):
            self.wrap(cursor, "inverse", f"!({self.text(cursor)})", 1)

    def text(self, cursor: Cursor) -> str:
        return self.file.text[slice(*span(cursor))]

    def binary(self, cursor: Cursor) -> None:
        operator, at = self.operator(cursor)
        start, end = span(cursor)
        left, right = list(cursor.get_children()) if operator else (cursor, cursor)
        if operator in BINARY and not {left.type.kind, right.type.kind} & POINTERS:
            function, new = BINARY[operator]
            call = (start, end, f"mutants::{function}({{}}, ", ")")
            self.add(Change(at, at + len(operator), new, call, has_comma=True))
        if operator in COMPARISONS:
            self.wrap(cursor, "inverse", f"!({self.text(cursor)})", 1)
        if operator in ("&&", "||"):
            for operand in (left, right):
                if operator == "&&":
                    self.wrap(operand, "yes", "true", 2)
                else:
                    self.wrap(operand, "no", "false", 2)

    def compound(self, cursor: Cursor) -> None:
        operator, at = self.operator(cursor)
        left, right = list(cursor.get_children())
        if operator in COMPOUND and left.type.kind not in POINTERS:
            function, new = COMPOUND[operator]
            call = (*span(right), f"mutants::{function}({{}}, ", ")")
            self.add(Change(at, at + len(operator), new, call, rank=3))

    def unary(self, cursor: Cursor) -> None:
        start = span(cursor)[0]
        operand = next(cursor.get_children())
        operator = self.file.text[start : span(operand)[0]].strip()
        function = {"-": "opposite", "!": "inverse", "~": "complement"}.get(operator)
        if function and bare(operand).kind not in LITERALS:
            self.add(Change(start, start + 1, "", (*span(operand), f"mutants::{function}({{}}, ", ")"), rank=3))

    def statement(self, cursor: Cursor) -> None:
        """An expression that is a statement: the mutant does not have it."""
        inner = bare(cursor)
        start, end = span(cursor)
        is_kept = inner.kind not in (
            CursorKind.BINARY_OPERATOR,
            CursorKind.COMPOUND_ASSIGNMENT_OPERATOR,
            CursorKind.CALL_EXPR,
        ) or self.text(cursor).startswith(("++", "--"))
        semicolon = re.compile(r"\s*;").match(self.file.text, end)
        if not is_kept and semicolon:
            end = semicolon.end()
            self.add(Change(start, end, "", (start, end, "{{ if (!mutants::drop({})) ", " }}"), rank=4))

    def visit(self, cursor: Cursor) -> None:
        kind = cursor.kind
        start, end = span(cursor)
        head = self.file.text[start:end]
        if kind in CONSTANT or (kind == CursorKind.VAR_DECL and "constexpr" in head.split("=")[0].split()):
            return
        children = list(cursor.get_children())
        outer = self.function
        if kind in (
            CursorKind.CXX_METHOD,
            CursorKind.FUNCTION_DECL,
            CursorKind.FUNCTION_TEMPLATE,
            CursorKind.CONSTRUCTOR,
        ):
            self.function = cursor.spelling.partition("<")[0]
        if kind == CursorKind.BINARY_OPERATOR:
            self.binary(cursor)
        elif kind == CursorKind.COMPOUND_ASSIGNMENT_OPERATOR:
            self.compound(cursor)
        elif kind == CursorKind.UNARY_OPERATOR:
            self.unary(cursor)
        elif kind in (CursorKind.VAR_DECL, CursorKind.FIELD_DECL):
            # An array's bounds are constants.
            children = [child for child in children if not self.file.text[: span(child)[0]].rstrip().endswith("[")]
        elif kind == CursorKind.CASE_STMT:
            children = children[1:]
        if kind in (CursorKind.CONDITIONAL_OPERATOR, CursorKind.WHILE_STMT, CursorKind.IF_STMT):
            is_constant = head.startswith("if constexpr")
            first = children[0]
            if is_constant:
                children = children[1:]
            elif first.kind.is_expression() and span(first) != (start, end):  # which is so in a macro
                self.condition(first)
        for child in children[STATEMENTS[kind]] if kind in STATEMENTS else []:
            if child.kind.is_expression():
                self.statement(child)
        for child in children:
            self.visit(child)
        self.function = outer


def parse(source: Path, arguments: list[str]) -> Iterator[Cursor]:
    unit = Index.create().parse(str(source), arguments)
    errors = [str(error) for error in unit.diagnostics if error.severity >= 3]
    if errors:
        raise SystemExit("\n".join(errors))
    for cursor in unit.cursor.get_children():
        if cursor.location.file and ROOT / LANES in Path(cursor.location.file.name).parents:
            yield cursor


def find(commands: list[Path]) -> list[File]:
    """Finds the changes in the files of the lane code that are compiled on this machine."""
    files: dict[Path, File] = {}
    for entry in [entry for path in commands for entry in json.loads(path.read_text())]:
        source = Path(entry["file"])
        if ROOT / LANES not in source.parents:
            continue
        kept = re.findall(r"(?<!\S)(-[DI]\S+|-isystem \S+|-std=\S+|-m\S+)", entry["command"])
        arguments = [part for argument in kept for part in argument.split(" ")]
        for cursor in parse(source, arguments):
            path = Path(cursor.location.file.name)
            # Offsets are those of bytes.
            file = files.setdefault(path, File(path, path.read_bytes().decode("latin-1")))
            Finder(file).visit(cursor)
    return [files[path] for path in sorted(files)]


def rewritten(file: File, first: int) -> tuple[str, list[dict[str, object]]]:
    """The file with calls, and its mutants, whose numbers begin at `first`."""
    text = file.text
    mutants: list[dict[str, object]] = []
    seen: collections.Counter[str] = collections.Counter()
    # Where, three numbers for the order, what is inserted, and how much it replaces
    edits: list[tuple[int, int, int, int, str, int]] = []
    for change in sorted(file.changes, key=lambda change: (change.start, change.end, change.rank)):
        start, end, before, after = change.call
        # At one offset, what ends there comes first, from the inside out; then what begins there, from the outside in.
        edits.append((start, 1, -end, -change.rank, before.format(first + len(mutants)), 0))
        edits.append((end, 0, -start, change.rank, after.format(), 0))
        if change.has_comma:
            edits.append((change.start, 2, 0, 0, ",", change.end - change.start))
        line_start = text.rfind("\n", 0, change.start) + 1
        line_end = (text + "\n").index("\n", change.end)
        shown = f"[{text[change.start : change.end]} -> {change.new}]".join(
            (text[line_start : change.start], text[change.end : line_end])
        )
        shown = " ".join(shown.split())
        seen[shown] += 1
        mutants.append(
            {
                "number": first + len(mutants),
                "file": str(file.path.relative_to(ROOT / LANES)),
                "line": text.count("\n", 0, change.start) + 1,
                "function": file.changes[change],
                "source": " ".join(text[line_start:line_end].split()),
                "text": shown if seen[shown] == 1 else f"{shown} ({seen[shown]})",
            }
        )
    result = ['#include "engine/lanes/mutants.hpp"\n#line 1\n']
    at = 0
    for offset, *_, inserted, replaced in sorted(edits):
        result += [text[at:offset], inserted]
        at = offset + replaced
    return "".join([*result, text[at:]]), mutants


def write(path: Path, text: str) -> None:
    """Leaves a file with the same text as it is, so that nothing is compiled again."""
    if not path.exists() or path.read_text("latin-1") != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "latin-1")


def main() -> None:
    """Usage: rewrite.py FOLDER COMPILE_COMMANDS ...: writes FOLDER/source and FOLDER/mutants.json."""
    folder, *commands = map(Path, sys.argv[1:])
    mutants: list[dict[str, object]] = []
    texts: dict[Path, str] = {}
    for file in find(commands):
        texts[file.path.relative_to(ROOT)], found = rewritten(file, len(mutants))
        mutants += found
    header = Path(__file__).with_name("mutants.hpp").read_text()
    texts[LANES / "mutants.hpp"] = header.replace(
        "#pragma once\n", f"#pragma once\n\n#define MJENV_MUTANTS {len(mutants)}\n", 1
    )
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for name in listed.split("\0"):
        source = ROOT / name
        if name and source.is_file() and not source.is_symlink() and Path(name) not in texts:
            write(folder / "source" / name, source.read_text("latin-1"))
            shutil.copymode(source, folder / "source" / name)
    for path, text in texts.items():
        write(folder / "source" / path, text)
    (folder / "mutants.json").write_text("[\n" + ",\n".join(map(json.dumps, mutants)) + "\n]\n")
    print(len(mutants), "mutants")


if __name__ == "__main__":
    main()
