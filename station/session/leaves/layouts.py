"""Find the layout of the pages of a session, and what becomes of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from restore import RestoreError, find_layout, load_scan
from station.progress import Progress, silent
from station.session.captures.scans import scan_path
from station.session.corrections.layers import effective_edits, rules_of
from station.session.log.history import CapturedPage
from station.session.log.store import Session

NO_SCAN = "it was photographed and has no scan"


@dataclass(frozen=True)
class PageLayout:
    """The layout of a page.

    finding  as of `LayoutFinding.as_json`; empty without one.
    by_hand  the layout that corrections set, `split` where they draw a spine; empty where they leave it open.
    problem  why it has no finding.
    """

    page: int
    finding: Mapping[str, Any]
    by_hand: str = ""
    problem: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON values."""
        return {"page": self.page, "by_hand": self.by_hand, "problem": self.problem, "layout": dict(self.finding)}


def layouts_of(session: Session, progress: Progress = silent) -> Iterator[PageLayout]:
    """Yield the layout of each page, in the order of the volume.

    That of its restoration, else it is looked for, which takes seconds for each page. Raises OSError.
    """
    pages, rules = list(session.history.pages()), rules_of(session)
    for done, page in enumerate(pages):
        progress("layout", done / len(pages))
        edits = effective_edits(session, page, rules) or {}
        by_hand = "split" if "spine" in edits and "layout" not in edits else str(edits.get("layout", ""))
        finding = _recorded(page)
        problem = ""
        if finding is None:
            finding, problem = _looked_for(session, page)
        yield PageLayout(page.number, finding, by_hand, problem)
    progress("layout", 1.0)


def _recorded(page: CapturedPage) -> Mapping[str, Any] | None:
    """Return the layout that the restoration of a page found, None without one."""
    leaves = () if page.restored is None else page.restored.leaves.values()
    return next((leaf.layout.model_extra for leaf in leaves if leaf.layout is not None), None)


def _looked_for(session: Session, page: CapturedPage) -> tuple[Mapping[str, Any], str]:
    """Return the layout of the scan of a page, and what prevents it."""
    captured = page.capture.captured
    if captured.is_photographed:
        return {}, NO_SCAN
    try:
        scan = load_scan(scan_path(session, page.capture), **captured.reading)
        return find_layout(scan).as_json(), ""
    except RestoreError as error:
        return {}, str(error)
