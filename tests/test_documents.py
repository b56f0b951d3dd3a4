"""Every path of the repository that a document names exists."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
FOLDERS = ("bench", "configs", "docs", "drivers", "examples", "oracles", "restore", "station", "tests")
LINK = re.compile(r"\]\(([^)\s#]+)(?:#[^)\s]*)?\)")
# A code span without blanks that begins with a folder of the sources, or ends as only their files do. Names of output
# files (`page.png`, `axis.toml`) are neither. NAME is a placeholder.
CODE_PATH = re.compile(rf"`((?:(?:{'|'.join(FOLDERS)})/[^`\s*]*|[^`\s*]+\.(?:py|sh|md)))`")


def named_paths(text: str) -> Iterator[str]:
    """Targets of the links of a document, web addresses excluded, and the paths in its code spans."""
    yield from (target for target in LINK.findall(text) if "://" not in target)
    yield from (path for path in CODE_PATH.findall(text) if "NAME" not in path)


def missing_paths(document: Path) -> list[str]:
    """Paths that exist neither in the folder of the document nor in the root of the repository."""
    paths = dict.fromkeys(named_paths(document.read_text("utf-8")))
    return [path for path in paths if not ((document.parent / path).exists() or (ROOT / path).exists())]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_named_path_exists(document: Path) -> None:
    assert missing_paths(document) == []


def test_a_missing_path_is_found(tmp_path: Path) -> None:
    document = tmp_path / "page.md"
    document.write_text(
        "See [a](gone.md#part), `restore/gone.py`, `restore/scan.py`, `page.png`, [b](https://x.org/c)."
    )
    assert missing_paths(document) == ["gone.md", "restore/gone.py"]
