"""The leaf sides of a session as the contact sheet shows them."""

from __future__ import annotations

from typing import Any

from station.console.shown_pages.layers import prefix_of
from station.session import Session
from station.session.leaves import Leaf, leaves_of
from station.session.parts import RESTORE, parts_of


def shown_leaves(session: Session) -> list[dict[str, Any]]:
    """Return the leaf sides in their order, those that are left out, too."""
    return [_shown(leaf) for leaf in leaves_of(session) if leaf.page.capture is not None]


def _shown(leaf: Leaf) -> dict[str, Any]:
    restored = leaf.page.runs.get(RESTORE)
    drawn = restored is not None and "error" not in leaf.report
    count = 0 if restored is None else len(parts_of(restored.facts["result"]))
    assert leaf.page.capture is not None
    return {
        "name": leaf.name,
        "page": leaf.page.number,
        "part": leaf.part,
        "label": leaf.label,
        "side": leaf.side,
        "kind": leaf.kind,
        "position": leaf.position,
        "left_out": leaf.is_left_out,
        "missing": list(leaf.missing),
        "event": restored.number if restored and drawn else leaf.page.capture.number,
        "layer": f"{prefix_of(leaf.part, count)}page" if drawn else "original",
    }
