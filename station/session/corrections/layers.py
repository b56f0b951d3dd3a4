"""Derive from corrections and rules how a page is to be restored.

Corrections of a page hang on its scan (`edits@5`), rules on the volume (`rules`). What a page is restored with is its
preset, then the rules in their order, then its own corrections: later ones win, field by field.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

from restore import PageEdits
from station.choices import Layout
from station.session.log.history import Page
from station.session.log.store import Session
from station.session.terms.parts import LEFT, PAGE, RIGHT
from station.session.terms.rules import EDITS, Rule, edits_of

PRESET = "preset"  # the source of a field that neither a rule nor the page itself gives


def rules_of(session: Session) -> Sequence[Rule]:
    """The rules of a volume, in their order."""
    return session.history.volume.decided.rules


def own_edits(session: Session, page: Page, rules: Sequence[Rule] | None = None) -> PageEdits:
    """Return the corrections that were made on a page itself.

    As they were given, without the fields that a later rule took the place of.
    """
    edits, event, capture = page.decided.edits, page.decisions.get(EDITS), page.capture
    if edits is None or event is None or capture is None:
        return PageEdits()
    for rule in rules_of(session) if rules is None else rules:
        if rule.is_over(event.number, session.history.shots(capture)):
            edits = edits.without(rule.edits)
    return edits


def layers_of(session: Session, page: Page, rules: Sequence[Rule] | None = None) -> list[tuple[str, PageEdits]]:
    """Return the corrections of a page, each with its source.

    `preset`, `rule 41`, `page`; the later ones win.
    """
    capture, layers = page.capture, [(PRESET, _edits_of_preset(session))]
    if capture is not None:
        known = rules_of(session) if rules is None else rules
        layers += [(f"rule {rule.id}", rule.edits) for rule in known if rule.is_on(session.history.shots(capture))]
    layers.append(("page", own_edits(session, page, rules)))
    return [(source, edits) for source, edits in layers if edits.model_fields_set]


def is_corrected(session: Session, page: Page) -> bool:
    """Return whether a rule or an operator corrects a page, apart from its preset."""
    return any(source != PRESET for source, _ in layers_of(session, page))


def _edits_of_preset(session: Session) -> PageEdits:
    """Return what the preset of a session, which does not change, says of each leaf.

    Where openings are split, a page that stays whole may be two leaves or a board: it is not compared with a leaf.
    """
    values = session.volume.preset_values
    table: dict[str, Any] = {"overlap_mm": values["overlap_mm"]} if values.get("overlap_mm") is not None else {}
    if values.get("size_mm") is not None:
        leaves = (PAGE,) if _layout_of(session) == Layout.SINGLE else (LEFT, RIGHT)
        table["parts"] = {leaf: {"size_mm": values["size_mm"]} for leaf in leaves}
    return edits_of(table) if table else PageEdits()


def resolved_edits(session: Session, page: Page) -> PageEdits:
    """Add up the corrections of a page, with the layout of its preset."""
    return _with_layout(_added_up(session, page, None), _layout_of(session))


def kind_of(session: Session, page: Page, rules: Sequence[Rule] | None = None) -> str:
    """Return what a page shows, as it was corrected; empty where nothing was said."""
    given = (edits for _, edits in reversed(layers_of(session, page, rules)) if "kind" in edits.model_fields_set)
    return next(given, PageEdits()).kind or ""


def effective_edits(session: Session, page: Page, rules: Sequence[Rule] | None = None) -> dict[str, Any] | None:
    """Return what corrects a page, as JSON values, None where nothing changes its image.

    rules: of the session, where they are known. Two results that are equal give the same page.
    """
    edits = _added_up(session, page, rules)
    if not edits.model_fields_set:
        return None
    image = _with_layout(edits, _layout_of(session)).of_image()
    return image if edits.layout != "auto" or image.keys() - {"layout"} else None


def _with_layout(edits: PageEdits, layout: str) -> PageEdits:
    """Give corrections the layout of a preset, where they leave it open."""
    if edits.layout != "auto" or edits.spine is not None:
        return edits
    return edits.model_copy(update={"layout": "whole" if layout == Layout.SINGLE else layout})


def _layout_of(session: Session) -> str:
    """Return the layout of a session's preset, which does not change."""
    return str(session.history.event(1).facts.get("layout", Layout.SINGLE))


def _added_up(session: Session, page: Page, rules: Sequence[Rule] | None) -> PageEdits:
    return reduce(PageEdits.merged, [edits for _, edits in layers_of(session, page, rules)] or [PageEdits()])
