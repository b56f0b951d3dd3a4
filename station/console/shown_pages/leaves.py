"""The leaf sides of a session as the contact sheet shows them."""

from __future__ import annotations

from typing import Any

from station.console.shown_pages.layers import prefix_of
from station.session import VOLUME, Session
from station.session.leaves import LABEL, LEFT_OUT, ORDER, Leaf, leaves_of
from station.session.parts import RESTORE, parts_of


def shown_leaves(session: Session) -> dict[str, Any]:
    """Return the leaf sides in their order, with its tag.

    Those that are left out, too.
    """
    leaves = [shown_leaf(leaf) for leaf in leaves_of(session) if leaf.page.capture is not None]
    return {"tag": order_tag(session), "leaves": leaves}


def order_tag(session: Session) -> int:
    """Return the number of the decision on the order.

    0 where the leaf sides lie as they were captured.
    """
    decision = session.history.page(VOLUME).decisions.get(ORDER)
    return 0 if decision is None else decision.number


def leaf_tag(leaf: Leaf) -> int:
    """Return the number of the last decision on a leaf side.

    On its label, or that it is left out; 0 for none.
    """
    names = {end for name in (LABEL, LEFT_OUT) for end in (name, f"{name}_{leaf.part}")}
    return max((decision.number for name, decision in leaf.page.decisions.items() if name in names), default=0)


def shown_leaf(leaf: Leaf) -> dict[str, Any]:
    """Return a leaf side as JSON values, with its tag."""
    restored = leaf.page.runs.get(RESTORE)
    drawn = restored is not None and "error" not in leaf.report
    count = 0 if restored is None else len(parts_of(restored.facts["result"]))
    assert leaf.page.capture is not None
    return {
        "name": leaf.name,
        "tag": leaf_tag(leaf),
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
