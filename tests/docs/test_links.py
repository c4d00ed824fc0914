"""Each relative link of a document leads to a file of the repository, as in a checkout, where there is no site."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"\]\((?![a-z]+:|#)([^)\s#]+)")
CODE = re.compile(r"^```.*?^```$|`[^`\n]*`", re.MULTILINE | re.DOTALL)
# Pages that only the site has, which the text says beside the link.
OF_THE_SITE = tuple(
    f"docs/{page}.md" for page in ("reference/c", "reference/learn", "reference/julia", "environments/index")
)


def documents() -> list[str]:
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return listed.split()


@pytest.mark.parametrize("document", documents())
def test_links(document: str) -> None:
    path = ROOT / document
    linked = [(path.parent / link).resolve() for link in LINK.findall(CODE.sub("", path.read_text()))]
    dead = [str(file) for file in linked if not file.exists() and str(file.relative_to(ROOT)) not in OF_THE_SITE]
    assert not dead
