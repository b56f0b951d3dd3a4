"""The leaf sides of a session as the contact sheet shows them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from station.console.shown_pages.layers import prefix_of
from station.session import VOLUME, Session
from station.session.leaves.leaf import LABEL, LEFT_OUT, MISSING, ORDER, Leaf, leaves_of, runs_of
from station.session.terms.labels import LABELS
from station.session.terms.parts import RESTORE, parts_of
from station.verdict.checks import same_as


def shown_leaves(session: Session) -> dict[str, Any]:
    """Return the leaf sides in their order, with the tag of the arrangement.

    Those that are left out, too.
    """
    found = [leaf for leaf in leaves_of(session) if leaf.page.capture is not None]
    runs = {run.start: run.model_dump(mode="json", exclude={"start"}) for run in runs_of(session)}
    same = _same_pages(found)
    leaves = [{**_shown(leaf), "run": runs.get(leaf.name), "same": sorted(same[leaf.name])} for leaf in found]
    return {"tag": arrangement_tag(session), "leaves": leaves}


def arrangement_tag(session: Session) -> int:
    """Return the number of the last decision on order, runs and missing leaves.

    0 for none.
    """
    decisions = session.history.page(VOLUME).decisions
    return max((decisions[name].number for name in (ORDER, LABELS, MISSING) if name in decisions), default=0)


def _same_pages(leaves: Sequence[Leaf]) -> Mapping[str, set[str]]:
    """Return leaf side → those found to be the same page.

    Of those that are delivered.
    """
    delivered, same = {leaf.name for leaf in leaves if not leaf.is_left_out}, defaultdict[str, set[str]](set)
    for leaf in leaves:
        others = {other for check in leaf.checks if check["level"] != "green" and (other := same_as(check))}
        for other in others & delivered if leaf.name in delivered else ():
            same[leaf.name].add(other)
            same[other].add(leaf.name)
    return same


def leaf_tag(leaf: Leaf) -> int:
    """Return the number of the last decision on a leaf side.

    On its label, or that it is left out; 0 for none.
    """
    names = {end for name in (LABEL, LEFT_OUT) for end in (name, f"{name}_{leaf.part}")}
    return max((decision.number for name, decision in leaf.page.decisions.items() if name in names), default=0)


def _shown(leaf: Leaf) -> dict[str, Any]:
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
