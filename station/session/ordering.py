"""Change the order of the leaf sides of a volume, leave some out, and note missing ones."""

from __future__ import annotations

import re
from collections.abc import Sequence

from station.errors import UsageError
from station.session.events import Event
from station.session.labelling import LABELS, Missing, Run
from station.session.leaves import LABEL, LEFT_OUT, MISSING, ORDER, Leaf, leaves_of, missing_of
from station.session.parts import PAGE, PARTS, parts_of
from station.session.steps import decide
from station.session.store import Session, Writer
from station.session.texts import check_text

LEAF = re.compile(r"(?P<page>[1-9]\d{0,3})(?:/(?P<part>left|right))?")
RANGE = re.compile(r"(?P<first>[1-9]\d{0,3})(?:-(?P<last>[1-9]\d{0,3}))?")


def parse_leaf(text: str) -> tuple[int, str | None]:
    """Return page and part of `12`, `12/left`. Raises UsageError.

    >>> parse_leaf("12/left"), parse_leaf("3")
    ((12, 'left'), (3, None))
    """
    match = LEAF.fullmatch(text)
    if match is None:
        raise UsageError(f"{text!r} is not a page", "write its number, and /left or /right for a leaf: 12/left")
    return int(match["page"]), match["part"]


def parse_pages(text: str) -> list[int]:
    """Return the numbers of `3,5-8`. Raises UsageError.

    >>> parse_pages("3,5-8")
    [3, 5, 6, 7, 8]
    """
    matches = [RANGE.fullmatch(part.strip()) for part in text.split(",")]
    if None in matches:
        raise UsageError(f"{text!r} are not pages", "write their numbers: 3,5-8")
    found = [range(int(one["first"]), int(one["last"] or one["first"]) + 1) for one in matches if one]
    return [number for numbers in found for number in numbers]


def leaves_named(session: Session, text: str) -> list[Leaf]:
    """Return the leaf sides of `12` or `12/left`. Raises UsageError."""
    page, part = parse_leaf(text)
    found = [leaf for leaf in leaves_of(session) if leaf.page.number == page and part in (None, leaf.part)]
    if not found:
        raise UsageError(f"the session has no leaf {text}", "planish session show lists them")
    return found


def move_leaves(writer: Writer, text: str, before: str) -> Event:
    """Move leaf sides before another one, and return the event. Raises UsageError, OSError."""
    moved = [leaf.name for leaf in leaves_named(writer.session, text)]
    target = leaves_named(writer.session, before)[0].name
    if target in moved:
        raise UsageError(f"{text} cannot be before itself", "name another leaf with --before")
    others = [leaf.name for leaf in leaves_of(writer.session) if leaf.name not in moved]
    at = others.index(target)
    return decide(writer, ORDER, [*others[:at], *moved, *others[at:]])


def leave_out(writer: Writer, text: str, *, out: bool) -> list[Event]:
    """Leave leaf sides out of what is delivered, or put them back. Raises UsageError, OSError."""
    leaves = leaves_named(writer.session, text)
    return [decide(writer, _of_part(LEFT_OUT, leaf), out, page=leaf.page.number) for leaf in leaves]


def note_missing(writer: Writer, before: str, label: str) -> Event:
    """Note that a leaf side is missing before another one. Raises UsageError, OSError."""
    target = leaves_named(writer.session, before)[0]
    return set_missing(writer, target.name, [*target.missing, label])


def set_missing(writer: Writer, before: str, labels: Sequence[str]) -> Event:
    """Set the labels of the leaf sides that are missing before another one. Raises OSError."""
    others = [one for one in missing_of(writer.session) if one.before != before]
    missing = [*others, *(Missing(before=before, label=label) for label in labels)]
    return decide(writer, MISSING, [one.model_dump(mode="json") for one in missing])


def set_runs(writer: Writer, runs: Sequence[Run]) -> Event:
    """Number the leaf sides by runs; without any by the preset. Raises OSError."""
    return decide(writer, LABELS, [run.model_dump(mode="json", by_alias=True) for run in runs])


def set_label(writer: Writer, page: int, part: str, label: str) -> Event:
    """Set the label of a part of a page. Raises OSError."""
    return decide(writer, LABEL if part == PAGE else f"{LABEL}_{part}", check_text(LABEL, label), page=page)


def parts_to_correct(leaf_parts: Sequence[str], part: str | None) -> list[str]:
    """Return the parts that a correction is of: the named one, or those that a page has."""
    return [part] if part else [name for name in PARTS if name in leaf_parts]


def _of_part(name: str, leaf: Leaf) -> str:
    """Return the name of a decision on a leaf side: of its part where the page has several."""
    run = leaf.page.runs.get("restore")
    alone = run is None or len(parts_of(run.facts["result"])) == 1
    return name if alone else f"{name}_{leaf.part}"
