"""What mkdocs.yml adds to the pages in docs/: pages made from the library, from its header and from other documents.

A link in any page may lead to any file of the repository, as it does where the page is read beside the file: to another
page, to a picture, or to a source file, which becomes a page that shows it.
"""

from __future__ import annotations

import os
import posixpath
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

sys.path.insert(0, os.path.dirname(__file__))

import c_reference
import environments
import julia_reference
import player

ROOT = Path(__file__).resolve().parents[2]
# Documents outside of docs/ that are pages.
DOCUMENTS = {
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
    "THIRD_PARTY_NOTICES.md": "third-party.md",
    "bindings/python/README.md": "reference/python.md",
    "bindings/javascript/README.md": "reference/javascript.md",
}
PICTURES = (".png", ".svg", ".webp")
LANGUAGES = {".hpp": "cpp", ".py": "python", ".rs": "rust", ".jl": "julia"}

_LINK = re.compile(r"(?<=\]\()(?![a-z]+:|#)([^)\s#]+)")


def on_config(config: MkDocsConfig) -> None:
    for section in config.nav or []:
        for pages in section.values():
            if "environments/index.md" in pages:
                pages.extend({robot: uri} for robot, uri in environments.uris().items())


def on_files(files: Files, config: MkDocsConfig) -> None:
    for name, uri in DOCUMENTS.items():
        files.append(File.generated(config, uri, content=(ROOT / name).read_text()))
    generated: dict[str, str | bytes] = {
        **environments.pages(),
        **environments.pictures(),
        "reference/c.md": c_reference.page(),
        **c_reference.guest_pages(),
        "reference/julia.md": julia_reference.page(),
    }
    for uri, content in generated.items():
        files.append(File.generated(config, uri, content=content))
    for uri, path in player.files().items():
        files.append(File.generated(config, uri, abs_src_path=str(path)))
    linked = {path for file in files.documentation_pages() for path in _outside(file)}
    for path in sorted(linked):
        if path.endswith(PICTURES):
            files.append(File.generated(config, _uri(path), abs_src_path=str(ROOT / path)))
        else:
            files.append(File.generated(config, _uri(path), content=_shown(path), inclusion=InclusionLevel.NOT_IN_NAV))


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    def target(path: str) -> str:
        uri = _uri(_resolved(page.file, path))
        return posixpath.relpath(uri, posixpath.dirname(page.file.src_uri))

    return "".join(part if code else _LINK.sub(lambda link: target(link[1]), part) for code, part in _parts(markdown))


def _parts(markdown: str) -> Iterator[tuple[bool, str]]:
    """The text in pieces: whether each is a block of code."""
    for part in re.split(r"(^ *```.*?^ *```$\n?)", markdown, flags=re.MULTILINE | re.DOTALL):
        yield part.lstrip().startswith("```"), part


def _outside(file: File) -> Iterator[str]:
    """The files that a page links and that are no pages yet."""
    for code, part in _parts(file.content_string):
        for link in () if code else _LINK.finditer(part):
            path = _resolved(file, link[1])
            if path not in DOCUMENTS and not path.startswith("docs/") and (ROOT / path).is_file():
                yield path


def _resolved(file: File, link: str) -> str:
    """What a link of a page means in the repository."""
    origins = {uri: name for name, uri in DOCUMENTS.items()}
    origin = origins.get(file.src_uri, f"docs/{file.src_uri}")
    return posixpath.normpath(posixpath.join(posixpath.dirname(origin), link))


def _uri(path: str) -> str:
    """Where a file of the repository is in the site."""
    if path in DOCUMENTS:
        return DOCUMENTS[path]
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    return f"files/{path}" if path.endswith(PICTURES) else f"files/{path}.md"


def _shown(path: str) -> str:
    language = LANGUAGES.get(Path(path).suffix, Path(path).suffix.removeprefix("."))
    return f"# {path}\n\n````{language}\n{(ROOT / path).read_text()}````\n"
