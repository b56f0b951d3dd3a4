"""Plan a rule: which pages it is on, and which of them have corrections of their own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from restore import PageEdits
from station.errors import UsageError
from station.session.corrections.fields import changed
from station.session.corrections.layers import own_edits
from station.session.log.history import CapturedPage
from station.session.log.store import Session
from station.session.terms.parts import PARTS, parse_leaf, parse_pages
from station.session.terms.rules import Rule, Scope

FOLLOWING = "following:"
SIDES: Mapping[str, Literal["left", "right"]] = {"left": "left", "right": "right"}


@dataclass(frozen=True)
class PlannedRule:
    """A rule before it is recorded.

    pages  that it is on → fields of the rule that the page has itself, and keeps.
    tag    of the rules of the volume that it comes after.
    """

    scope: Scope
    edits: PageEdits
    pages: Mapping[int, tuple[str, ...]]
    tag: int

    @property
    def own(self) -> dict[int, tuple[str, ...]]:
        """The pages that keep fields of their own."""
        return {page: fields for page, fields in self.pages.items() if fields}

    def as_json(self) -> dict[str, Any]:
        """Return the rule as JSON values."""
        scope = self.scope.model_dump(mode="json", exclude={"over"})
        return {"scope": scope, "edits": self.edits.given(), "pages": list(self.pages), "own_corrections": self.own}

    def lines(self) -> Iterator[str]:
        """Return what an operator has to know of it."""
        yield f"pages      {', '.join(map(str, self.pages)) or 'only later ones'}"
        for page, names in self.own.items():
            yield f"own        page {page}: its {', '.join(names)} is kept"
        if self.scope.future:
            yield "future     pages that are captured later, too"


def parse_rule(session: Session, words: Sequence[str], to: str, *, future: bool) -> tuple[Scope, PageEdits]:
    """Read a rule. words: `FIELD=VALUE`; to: all, left, right, following:PAGE, or `3,5-8`.

    Raises UsageError for a field or pages that a rule cannot have, BadInput for a value that cannot be.
    """
    for word in words:
        if word.endswith("="):
            raise UsageError(f"a rule cannot set {word!r}", "set it on each page: planish session edits")
    side = SIDES.get(to)
    edits = changed(PageEdits(), words, [side] if side else PARTS)
    if side and edits.model_fields_set != {"parts"}:
        raise UsageError(f"--to {to} is for fields of a leaf, and not of the whole page", "use --to all, or name pages")
    pages = _pages(session, to)
    scope = Scope(
        captures="all" if to in ("all", *SIDES) else [page.capture.number for page in pages],
        side=side or "any",
        future=future,
    )
    return scope, edits


def _pages(session: Session, to: str) -> list[CapturedPage]:
    """Return the pages that a text names. Raises UsageError."""
    pages = list(session.history.pages())
    if to in ("all", *SIDES):
        return pages
    numbers = [page.number for page in pages]
    if to.startswith(FOLLOWING):
        first, _ = parse_leaf(to.removeprefix(FOLLOWING))
        wanted = numbers[numbers.index(first) :] if first in numbers else [first]
    else:
        wanted = parse_pages(to)
    unknown = [number for number in wanted if number not in numbers]
    if unknown:
        raise UsageError(f"the session has no page {unknown[0]}", "planish session show lists its pages")
    return [page for page in pages if page.number in wanted]


def pages_of(session: Session, rule: Rule) -> dict[int, tuple[str, ...]]:
    """Return the pages that a rule is on → the fields of it that a page has itself, and keeps."""
    pages = (page for page in session.history.pages() if rule.is_on(session.history.shots(page.capture)))
    return {page.number: _kept_fields(own_edits(session, page), rule.edits) for page in pages}


def _kept_fields(own: PageEdits, edits: PageEdits) -> tuple[str, ...]:
    return tuple(name for name in own.names if name in edits.names and not name.endswith(".masks"))
