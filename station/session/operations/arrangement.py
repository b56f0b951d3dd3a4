"""Arrange the leaf sides of a volume: order, labels, missing ones, and those left out.

expected: the tag of what a change was made from; None for whatever stands. Nothing is recorded, and None returned,
where nothing changes. Each raises Stale, UsageError for what a volume cannot have, OSError.
"""

from __future__ import annotations

from collections.abc import Sequence

from station.errors import UsageError
from station.session.leaves.leaf import LABEL, LEFT_OUT, MISSING, ORDER, Leaf, leaves_of
from station.session.log.events import Event
from station.session.log.steps import decide
from station.session.log.store import Session, Writer
from station.session.operations.tags import arrangement_tag, check_tag
from station.session.terms.labels import LABELS, MAX_MISSING, MAX_RUNS, Missing, Run
from station.session.terms.parts import PAGE, parse_leaf
from station.session.terms.texts import check_text


class NoSuchLeaf(UsageError):
    """Raised for a leaf side that a session lacks."""

    def __init__(self, name: str) -> None:
        super().__init__(f"the session has no leaf {name}", "planish session show lists them")


def leaves_named(session: Session, text: str) -> list[Leaf]:
    """Return the leaf sides of `12` or `12/left`. Raises UsageError."""
    page, part = parse_leaf(text)
    found = [leaf for leaf in leaves_of(session) if leaf.page.number == page and part in (None, leaf.part)]
    if not found:
        raise NoSuchLeaf(text)
    return found


def leaf_named(session: Session, name: str) -> Leaf:
    """Return a leaf side by its name. Raises NoSuchLeaf."""
    for leaf in leaves_of(session):
        if leaf.name == name:
            return leaf
    raise NoSuchLeaf(name)


def move_leaves(
    writer: Writer, moved: Sequence[str], before: str | None, *, expected: int | None = None
) -> Event | None:
    """Move leaf sides before another one, or to the end, as one step."""
    _check_arrangement(writer, expected)
    for name in (*moved, *([] if before is None else [before])):
        leaf_named(writer.session, name)
    if before in moved:
        raise UsageError(f"leaf {before} cannot be before itself", "name another leaf")
    names = [leaf.name for leaf in leaves_of(writer.session)]
    others = [name for name in names if name not in moved]
    at = len(others) if before is None else others.index(before)
    wanted = [*others[:at], *dict.fromkeys(moved), *others[at:]]
    return None if wanted == names else decide(writer, ORDER, wanted)


def number_from(writer: Writer, name: str, run: Run | None, *, expected: int | None = None) -> Event | None:
    """Begin a run of labels at a leaf side, or take away the one that begins there."""
    _check_arrangement(writer, expected)
    leaf_named(writer.session, name)
    own = [] if run is None else [run.model_copy(update={"start": name})]
    return set_runs(writer, [*(one for one in writer.history.volume.decided.labels if one.start != name), *own])


def keep_both(writer: Writer, number: int) -> Event | None:
    """Keep a page and those that it was found the same as; return the event, if any."""
    page = writer.history.captured(number)
    same = {check.same_as for check in page.quality.checks if check.same_as} if page and page.quality else set()
    if page is None or not same:
        return None
    return decide(writer, "keep_both", sorted({*page.decided.keep_both, *same}), page=number, on=page.capture)


def set_runs(writer: Writer, runs: Sequence[Run], *, expected: int | None = None) -> Event | None:
    """Number the leaf sides by runs; without any by the preset."""
    _check_arrangement(writer, expected)
    _check_count(runs, MAX_RUNS)
    if list(runs) == list(writer.history.volume.decided.labels):
        return None
    return decide(writer, LABELS, [run.model_dump(mode="json", by_alias=True) for run in runs])


def mark_missing(writer: Writer, name: str, labels: Sequence[str], *, expected: int | None = None) -> Event | None:
    """Set the labels of the leaf sides that are missing before another one."""
    texts = [check_text(LABEL, label) for label in labels]
    _check_arrangement(writer, expected)
    present = list(leaf_named(writer.session, name).missing)
    known = writer.history.volume.decided.missing
    _check_count([*known, *texts], MAX_MISSING + len(present))
    if present == texts:
        return None
    others = [one for one in known if one.before != name]
    missing = [*others, *(Missing(before=name, label=label) for label in texts)]
    return decide(writer, MISSING, [one.model_dump(mode="json") for one in missing])


def change_leaf(
    writer: Writer, name: str, *, left_out: bool | None = None, label: str | None = None, expected: int | None = None
) -> Event | None:
    """Leave a leaf side out or put it back, and set its label; None leaves it as it is.

    expected: the tag of the leaf side. Returns the last event.
    """
    text, event = None if label is None else check_text(LABEL, label), None
    leaf = leaf_named(writer.session, name)
    check_tag(expected, leaf.tag, f"leaf {name} was changed meanwhile")
    if left_out is not None and left_out != leaf.is_left_out:
        split = leaf.page.restored is not None and leaf.page.restored.is_split
        slot = f"{LEFT_OUT}_{leaf.part}" if split else LEFT_OUT
        event = decide(writer, slot, left_out, page=leaf.page.number)
    if text is not None and text != leaf.label:
        event = set_label(writer, leaf.page.number, leaf.part, text)
    return event


def set_label(writer: Writer, page: int, part: str, label: str) -> Event:
    """Set the label of a part of a page, which need not be restored yet."""
    return decide(writer, LABEL if part == PAGE else f"{LABEL}_{part}", check_text(LABEL, label), page=page)


def _check_arrangement(writer: Writer, expected: int | None) -> None:
    check_tag(expected, arrangement_tag(writer.session), "the leaves were arranged meanwhile")


def _check_count(wanted: Sequence[object], most: int) -> None:
    if len(wanted) > most:
        raise UsageError(f"a volume has {most} of them at most", "take others away first")
