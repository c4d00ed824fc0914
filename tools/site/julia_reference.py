"""The reference of the Julia package as a page, made from its documentation texts."""

from __future__ import annotations

import re
from pathlib import Path

SOURCES = Path(__file__).resolve().parents[2] / "bindings" / "julia" / "src"


def page() -> str:
    main = (SOURCES / "MJEnv.jl").read_text()
    files = re.findall(r'include\("(.*)"\)', main)
    paths = [*(SOURCES / file for file in files), *sorted(SOURCES.parents[2].glob("extras/*/julia/*.jl"))]
    texts = [text for path in paths for text in _texts(path.read_text())]
    names = {_name(text): text for text in texts}
    introduction = _linked(_texts(main)[0], set(names))
    sections = [f"## `{name}`\n\n{_linked(text, set(names))}" for name, text in names.items()]
    return "\n\n".join(["# MJEnv.jl", introduction, *sections])


def _texts(source: str) -> list[str]:
    """The texts, of which those of one line begin with their signature: "`ids()`: returns ..."."""
    short = re.sub(r'^"(`[^"\n]*)"$', lambda line: '"""\n' + line[1] + '\n"""', source, flags=re.MULTILINE)
    texts = re.findall(r'^"""\n(.*?)^"""$', short, re.MULTILINE | re.DOTALL)
    return [re.sub(r"\A`(.*?)`: (.)", lambda found: f"    {found[1]}\n\n{found[2].upper()}", text) for text in texts]


def _name(text: str) -> str:
    """Of the first signature: the indented line at the top."""
    match = re.match(r" {4}((?:MJEnv\.)?\w+!?)", text)
    if not match:
        raise ValueError(f"a documentation text without a signature: {text}")
    return match[1]


def _linked(text: str, names: set[str]) -> str:
    def link(match: re.Match[str]) -> str:
        name = match[1]
        if name not in names:
            raise ValueError(f"a reference to {name}, which has no documentation")
        return f"[`{name}`](#{re.sub('[^a-z0-9_]', '', name.lower())})"

    return re.sub(r"\[`([^`]*)`\]\(@ref\)", link, text)
