"""The leaf sides of a session as the contact sheet shows them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from station.console.shown_pages.layers import prefix_of
from station.console.shown_pages.rows import finding_of
from station.session import Session
from station.session.leaves.leaf import Leaf, leaves_of
from station.session.leaves.outliers import AXES, ComparedLeaf, compared_leaves
from station.session.operations.tags import arrangement_tag


def shown_leaves(session: Session) -> dict[str, Any]:
    """Return the leaf sides in their order, with the tag of the arrangement.

    Those that are left out, too.
    """
    found, decided = leaves_of(session), session.history.volume.decided
    runs = {run.start: run.model_dump(mode="json", exclude={"start"}) for run in decided.labels}
    same = _same_pages(found)
    leaves = [{**_shown(leaf), "run": runs.get(leaf.name), "same": sorted(same[leaf.name])} for leaf in found]
    return {"tag": arrangement_tag(session), "leaves": leaves}


def shown_leaf(session: Session, name: str) -> dict[str, Any]:
    """Return a leaf side as `shown_leaves` has it."""
    return next(leaf for leaf in shown_leaves(session)["leaves"] if leaf["name"] == name)


def reviewed_leaves(session: Session) -> list[dict[str, Any]]:
    """Return the delivered leaf sides in their order, each compared with its neighbours."""
    return [_reviewed(one) for one in compared_leaves(session)]


def _same_pages(leaves: Sequence[Leaf]) -> Mapping[str, set[str]]:
    """Return leaf side → those found to be the same page, of those that are delivered."""
    delivered, same = {leaf.name for leaf in leaves if not leaf.is_left_out}, defaultdict[str, set[str]](set)
    for leaf in leaves:
        others = {check.same_as for check in leaf.checks} & delivered
        for other in filter(None, others) if leaf.name in delivered else ():
            same[leaf.name].add(other)
            same[other].add(leaf.name)
    return same


def _reviewed(one: ComparedLeaf) -> dict[str, Any]:
    restored = one.leaf.restored
    width, height = restored.page_mm if restored and restored.page_mm else (None, None)
    checks = [finding_of({"same_as": check.same_as, **check.model_dump()}) for check in one.checks]
    return {
        **_shown(one.leaf),
        "level": one.level,
        "rank": round(one.rank, 3),
        "width_mm": width,
        "height_mm": height,
        "sampling_ppi": getattr(restored.measures, "sampling_ppi", None) if restored else None,
        "dpi": restored.dpi if restored else None,
        "checks": [{**check, "unit": "mm"} if check["name"] in AXES else check for check in checks],
    }


def _shown(leaf: Leaf) -> dict[str, Any]:
    run = leaf.page.restoration if leaf.restored is not None and leaf.restored.error is None else None
    return {
        "name": leaf.name,
        "tag": leaf.tag,
        "page": leaf.page.number,
        "part": leaf.part,
        "label": leaf.label,
        "side": leaf.side,
        "kind": leaf.kind,
        "position": leaf.position,
        "left_out": leaf.is_left_out,
        "missing": list(leaf.missing),
        "event": run.event.number if run else leaf.page.capture.number,
        "layer": f"{prefix_of(leaf.part, len(run.result.leaves))}page" if run else "original",
    }
