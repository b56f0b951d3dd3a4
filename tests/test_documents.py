"""Every path and heading that a document names exists, and the site has every page."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
FOLDERS = ("bench", "configs", "docs", "drivers", "examples", "oracles", "restore", "station", "tests")
LINK = re.compile(r"\]\(([^)\s#]+)(?:#[^)\s]*)?\)")
ANCHORED = re.compile(r"\]\(([^)\s#:]*\.md|)#([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
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


def anchors(document: Path) -> set[str]:
    """The headings of a document as the site and code hosts name them in addresses."""
    headings = HEADING.findall(FENCED.sub("", document.read_text("utf-8")))
    return {re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", heading)).strip("-").lower() for heading in headings}


def missing_anchors(document: Path) -> list[str]:
    """Headings that a document links to and that are not there."""
    links = ANCHORED.findall(document.read_text("utf-8"))
    return [
        f"{page}#{name}" for page, name in links if name not in anchors(document.parent / page if page else document)
    ]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_heading_that_is_linked_exists(document: Path) -> None:
    assert missing_anchors(document) == []


def test_the_layers_that_the_architecture_draws_are_those_of_the_contract() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    (layers,) = (one["layers"] for one in contracts if one["name"] == "restore layers")
    drawn = "".join(f"   {layer.replace('|', '·')}\n" for layer in layers)
    text = (ROOT / "docs" / "explanation" / "architecture.md").read_text("utf-8")
    assert f"import each other:\n{drawn}```" in text, f"draw these layers:\n{drawn}"


def test_the_site_has_every_page() -> None:
    """All pages but single decisions, which their overview lists."""
    site = (ROOT / "mkdocs.yml").read_text("utf-8")
    pages = {str(path.relative_to(ROOT)) for path in DOCUMENTS if path.parent.name != "decisions"}
    assert {page for page in pages if page not in site} == set()
    overview = (ROOT / "docs" / "decisions" / "README.md").read_text("utf-8")
    decisions = {path.name for path in DOCUMENTS if path.parent.name == "decisions" and path.name != "README.md"}
    assert {name for name in decisions if f"({name})" not in overview} == set()


def test_a_missing_heading_is_found(tmp_path: Path) -> None:
    (tmp_path / "other.md").write_text("# A head, with `code`\n```\n# no head\n```\n")
    (tmp_path / "page.md").write_text("[a](other.md#a-head-with-code) [b](other.md#no-head) [c](#gone)")
    assert missing_anchors(tmp_path / "page.md") == ["other.md#no-head", "#gone"]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_named_path_exists(document: Path) -> None:
    assert missing_paths(document) == []


def test_a_missing_path_is_found(tmp_path: Path) -> None:
    document = tmp_path / "page.md"
    document.write_text(
        "See [a](gone.md#part), `restore/gone.py`, `restore/scan.py`, `page.png`, [b](https://x.org/c)."
    )
    assert missing_paths(document) == ["gone.md", "restore/gone.py"]
