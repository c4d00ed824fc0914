"""The reference of the C interface as pages, made from the comments of mjenv/mjenv.h and those of extras/.

Anything in a header that this does not understand raises ValueError, so nothing is left out.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import header

_COMMENT = r"/\*(?P<{}>.*?)\*/"
_PIECE = re.compile(
    r"\s*(?:" + _COMMENT.format("comment") + r"|#define (?P<macro>\w+) \(?(?P<value>-?\w+)\)?"
    r"(?: *" + _COMMENT.format("macro_doc") + r")?\n"
    r"|typedef struct (?P<opaque>\w+) \w+;(?: *" + _COMMENT.format("opaque_doc") + r")?"
    r"|typedef int32_t (?P<enum>\w+);\s*enum (?P=enum)_value \{(?P<values>.*?)\};"
    r"|typedef struct (?P<struct>\w+) \{(?P<fields>.*?)\} \w+;"
    r"|MJENV_(?:[A-Z]+_)?API (?P<function>[^;]*);)",
    re.DOTALL,
)
_ENUMERATOR = re.compile(r"(?:/\*([^/]*?)\*/\s*)?\b(\w+) = (-?\d+),?(?: */\*(.*?)\*/)?", re.DOTALL)
_FIELD = re.compile(r"\s*(?:/\*(?P<group>.*?)\*/|(?P<code>[^;/]+);(?: */\*(?P<doc>.*?)\*/)?)", re.DOTALL)
# Words of a comment that are code.
_CODE = re.compile(r"\*?_?\w*(?:\[[\w *]*\])+|\*_\w+|\b[a-z]+_\w+\b|\bMJENV_\w+|\w+(?:->|\.)\w+_\w+|\bNULL\b|\b\w+\(\)")


class Page:
    """Collects the page; knows what its names lead to."""

    def __init__(self, api: header.Header, included: header.Header | None = None, included_page: str = "") -> None:
        """included: what the header includes, which is described on another page."""
        outside = set(_anchors(included)) if included else set()
        anchors = _anchors(api)
        self.described = {anchor for name, anchor in anchors.items() if name not in outside}
        self.links = {name: f"{included_page if name in outside else ''}#{anchor}" for name, anchor in anchors.items()}
        self.statuses = {name.removeprefix("MJENV_E_") for name in anchors if name.startswith("MJENV_E_")}
        self.lines: list[str] = []

    def add(self, *lines: str) -> None:
        self.lines += [*lines, ""]

    def text(self, comment: str | None) -> str:
        """A comment as Markdown, in one line, with links."""
        lines = (line.strip() for line in (comment or "").splitlines())
        words = " ".join("" if line == "*" else line.removeprefix("* ").strip() for line in lines).strip()
        prose, errors, listed = words.partition("Errors: ")
        return self._linked(prose) + (errors and f"{prose and '<br>'}**Errors**: {self._errors(listed)}")

    def _linked(self, prose: str) -> str:
        def code(match: re.Match[str]) -> str:
            word = match[0]
            link = self.links.get(word.removesuffix("()"))
            return f"[`{word}`]({link})" if link else f"`{word}`"

        pieces, end = [], 0
        for match in _CODE.finditer(prose):
            pieces += [_escaped(prose[end : match.start()]), code(match)]
            end = match.end()
        return "".join([*pieces, _escaped(prose[end:])])

    def _errors(self, listed: str) -> str:
        """Each word in capitals is a status."""
        pieces = re.split(r"\b([A-Z][A-Z_]{3,})\b", listed)
        if unknown := set(pieces[1::2]) - self.statuses:
            raise ValueError(f"no such status: {unknown}, in: {listed}")
        status = self.links["mjenv_status"]
        links = (f"[{word}]({status})" if index % 2 else self._linked(word) for index, word in enumerate(pieces))
        return "".join(links)

    def table(self, names: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
        self.add(_row(names), _row(("---",) * len(names)), *map(_row, rows))


def _row(cells: tuple[str, ...]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _escaped(text: str) -> str:
    return re.sub(r"([*_\[\]`])", r"\\\1", text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;"))


def _anchors(api: header.Header) -> dict[str, str]:
    """For each name of a header, that of the declaration which describes it."""
    anchors = {value: enum.name for enum in api.enums for value, _ in enum.values}
    anchors |= {named.name: named.name for named in (*api.enums, *api.structs, *api.functions)}
    return anchors | {name: name for name in api.opaques}


def page() -> str:
    """The page of mjenv.h."""
    made = Page(header.parse())
    made.add("# The C interface", "", "All of `mjenv/mjenv.h`, made from its comments.")
    return _filled(made, header.PATH)


def guest_pages() -> dict[str, str]:
    """The pages of the headers of extras/, which stand beside c.md."""
    return {f"reference/{path.stem}.md": _guest_page(path) for path in header.GUESTS}


def _guest_page(path: Path) -> str:
    made = Page(header.parse(header.PATH, path), header.parse(), "c.md")
    made.add(f"# The C interface of mjenv/{path.name}", "", f"All of `mjenv/{path.name}`, made from its comments.")
    return _filled(made, path)


def _filled(made: Page, path: Path) -> str:
    introduction, *pieces = _pieces(path.read_text())
    _introduce(made, introduction["comment"])
    about: str | None = None
    for piece in pieces:
        if piece["comment"] is None:
            _declare(made, piece, about)
            about = None
        elif section := re.fullmatch(r" ---- (.*?) ----(.*)", piece["comment"], re.DOTALL):
            made.add(f"## {section[1]}", "", made.text(section[2]))
        else:
            about = piece["comment"]
    missing = {name for name in made.described if f"### `{name}`" not in made.lines}
    if missing:
        raise ValueError(f"not in the reference: {missing}")
    return "\n".join(made.lines)


def _pieces(text: str) -> Iterator[re.Match[str]]:
    """Comments and declarations, without the header's guards and its extern "C"."""
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.DOTALL)
    text = re.sub(r"(?:/\* MJENV_API marks [^/]*\*/\n)?#if !defined\(_WIN32\).*?\n#endif\n", "", text, flags=re.DOTALL)
    text = re.sub(r"/\* Not a number.*?\n#endif\n", "", text, flags=re.DOTALL)
    text = re.sub(r"/\* clang-format (?:off|on) \*/\n", "", text)
    text = re.sub(r"^#define \w+_INIT\b(?:.*\\\n)*.*\n", "", text, flags=re.MULTILINE)
    text = re.sub(r"^#(?:ifndef|include|endif).*\n|^#define MJENV_\w+_H\n", "", text, flags=re.MULTILINE)
    position = 0
    while text[position:].strip():
        piece = _PIECE.match(text, position)
        if not piece:
            raise ValueError(f"cannot read the header from: {text[position : position + 80]}")
        position = piece.end()
        yield piece


def _introduce(made: Page, comment: str) -> None:
    """The comment at the top: paragraphs and an example, then rules, each after its title on a line of its own."""
    start, *rules = re.split(r"^ \* ([A-Z]\w+)\n", comment.partition("\n *\n")[2], flags=re.MULTILINE)
    for is_deep, lines in _blocks(start, 5):
        made.add(*(["```c", *(line[5:] for line in lines), "```"] if is_deep else [made.text("\n".join(lines))]))
    for title, body in zip(rules[::2], rules[1::2], strict=True):
        lead = f"**{title}.** "
        for is_deep, lines in _blocks(body, 5):
            if is_deep:
                items = re.split(r"\n(?= {5}(?:- |[A-Z]+  ))", "\n".join(lines))
                made.add(*(f"- {made.text(item.strip().removeprefix('- '))}" for item in items))
            else:
                made.add(lead + made.text("\n".join(lines)))
                lead = ""
    made.add("## Types")


def _describe(made: Page, comment: str) -> None:
    """The comment of a function: prose, and a list of parameters, which are indented by three blanks."""
    for is_deep, lines in _blocks(comment, 3):
        if is_deep:
            items = (item.split(maxsplit=1) for item in re.split(r"\n(?= {3}\w)", "\n".join(lines)))
            made.add(*(f"- `{name}`: {made.text(meaning)}" for name, meaning in items))
        else:
            made.add(made.text("\n".join(lines)))


def _blocks(text: str, depth: int) -> Iterator[tuple[bool, list[str]]]:
    """The lines that follow each other and are indented by at least `depth` blanks, or by fewer."""
    lines = filter(None, (line.removeprefix(" *").rstrip() for line in text.splitlines()))
    for is_deep, group in groupby(lines, key=lambda line: line.startswith(" " * depth)):
        yield is_deep, list(group)


def _declare(made: Page, piece: re.Match[str], about: str | None) -> None:
    if piece["function"]:
        name = piece["function"].partition("(")[0].split()[-1].lstrip("*")
        made.add(f"### `{name}`", "", "```c", _reflowed(piece["function"]) + ";", "```")
        _describe(made, about or "")
    elif piece["macro"]:
        made.add(f"### `{piece['macro']}`", "", f"`{piece['value']}`. {made.text(piece['macro_doc'] or about)}")
    elif piece["opaque"]:
        made.add(f"### `{piece['opaque']}`", "", f"A handle: {made.text(piece['opaque_doc'])}.")
    elif piece["enum"]:
        made.add(f"### `{piece['enum']}`", "", made.text(about))
        values = _ENUMERATOR.findall(piece["values"])
        rows = [(f"`{name}`", value, made.text(before or after)) for before, name, value, after in values]
        made.table(("name", "value", "meaning"), rows)
    else:
        made.add(f"### `{piece['struct']}`", "", made.text(about))
        made.table(("field", "meaning"), list(_members(made, piece["fields"])))


def _members(made: Page, fields: str) -> Iterator[tuple[str, ...]]:
    """A comment on a line of its own stands before the fields that it tells of."""
    position = 0
    while fields[position:].strip():
        field = _FIELD.match(fields, position)
        if not field:
            raise ValueError(f"cannot read the fields from: {fields[position : position + 80]}")
        position = field.end()
        if field["group"] is not None:
            yield ("", f"*{made.text(field['group'])}*")
        else:
            yield (f"`{' '.join(field['code'].split())}`", made.text(field["doc"]))


def _reflowed(prototype: str) -> str:
    """With each parameter on a line of its own where one line is too long."""
    text = " ".join(prototype.split())
    if len(text) <= 90:
        return text
    start, _, parameters = text.removesuffix(")").partition("(")
    return f"{start}(\n    " + ",\n    ".join(parameters.split(", ")) + ")"
