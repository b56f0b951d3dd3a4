"""Pages of a session as lists show them.

Each surface takes what it shows from one view of a page.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from restore import PageEdits
from station.session.corrections.layers import effective_edits, is_corrected, layers_of, own_edits
from station.session.derivation.parameters import outdated_pages
from station.session.leaves.leaf import Leaf, label_of, leaves_by_page
from station.session.log.history import CapturedPage, Page, Restoration
from station.session.log.results import Checked
from station.session.log.store import Session
from station.verdict.checks import LEVELS


@dataclass(frozen=True)
class PageView:
    """A page with a scan, in the order of the volume.

    position  among the pages, from 1.
    leaves    its leaf sides.
    outdated  whether it was corrected since it was restored.
    """

    session: Session
    page: CapturedPage
    position: int
    leaves: Sequence[Leaf]
    outdated: bool

    @property
    def label(self) -> str:
        """The labels of its leaf sides."""
        return label_of(self.leaves)

    @property
    def side(self) -> str:
        """`left` or `right`; empty for an opening and for single sheets."""
        return self.leaves[0].side if len(self.leaves) == 1 else ""

    @property
    def kind(self) -> str:
        """What the scan shows; empty where it was not set."""
        return self.leaves[0].kind

    @property
    def mark(self) -> bool:
        """Whether the operator marked it."""
        return self.page.decided.mark

    @property
    def note(self) -> str:
        """The operator's note."""
        return self.page.decided.note

    @property
    def is_accepted(self) -> bool:
        """Whether the operator accepted it."""
        return self.page.decided.accept is True

    @property
    def is_edited(self) -> bool:
        """Whether a rule or an operator corrects it."""
        return is_corrected(self.session, self.page)

    @property
    def failure(self) -> dict[str, str] | None:
        """Why the whole of it could not be restored, with a hint."""
        return None if self.page.restored is None else self.page.restored.failure

    @property
    def restoration(self) -> Restoration | None:
        """Its restoration, unless it failed."""
        return self.page.restoration if self.failure is None else None

    @property
    def questions(self) -> list[Checked]:
        """The checks that a correction answers; none of a page that was accepted as it is."""
        return questions_of(self.page)

    @property
    def rank(self) -> float:
        """How bad it is."""
        return rank_of(self.page)


def views_of(session: Session) -> Iterator[PageView]:
    """Yield the pages of a session in the order of the volume."""
    outdated = frozenset(outdated_pages(session))
    for position, leaves in enumerate(leaves_by_page(session).values(), 1):
        page = leaves[0].page
        yield PageView(session, page, position, leaves, page.number in outdated)


@dataclass(frozen=True)
class CorrectionsView:
    """The corrections of a page as they are shown.

    own        that were made on the page itself.
    effective  what it is restored with, as JSON values; None where nothing changes its image.
    layers     each with its source; later ones win.
    """

    own: PageEdits
    effective: Mapping[str, Any] | None
    layers: Sequence[tuple[str, PageEdits]]


def corrections_view(session: Session, page: Page) -> CorrectionsView:
    """Return the corrections of a page."""
    own, layers = own_edits(session, page), layers_of(session, page)
    return CorrectionsView(own, effective_edits(session, page), layers)


def questions_of(page: Page) -> list[Checked]:
    """Return the checks of a page that a correction answers, none of an accepted page."""
    return (
        [] if page.quality is None or page.decided.accept else [one for one in page.quality.checks if one.is_question]
    )


def rank_of(page: Page) -> float:
    """Return how bad a page is.

    The number of its level, and how far its worst measure is past the limit, 0 to 1. A page that could not be restored
    is worst of all; one that is not checked comes before green ones.
    """
    if page.restored is not None and any(page.restored.failures):
        return float(len(LEVELS))
    return 0.5 if page.quality is None else page.quality.rank
