"""Change the order of the leaf sides of a volume, leave some out, and note missing ones."""

from __future__ import annotations

from collections.abc import Sequence

from station.errors import UsageError
from station.session.leaves.leaf import LABEL, LEFT_OUT, MISSING, ORDER, Leaf, leaves_of
from station.session.log.events import Event
from station.session.log.steps import decide
from station.session.log.store import Session, Writer
from station.session.terms.labels import LABELS, Missing, Run
from station.session.terms.parts import PAGE, parse_leaf
from station.session.terms.texts import check_text


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
    others = [one for one in writer.history.volume.decided.missing if one.before != before]
    missing = [*others, *(Missing(before=before, label=label) for label in labels)]
    return decide(writer, MISSING, [one.model_dump(mode="json") for one in missing])


def set_runs(writer: Writer, runs: Sequence[Run]) -> Event:
    """Number the leaf sides by runs; without any by the preset. Raises OSError."""
    return decide(writer, LABELS, [run.model_dump(mode="json", by_alias=True) for run in runs])


def set_label(writer: Writer, page: int, part: str, label: str) -> Event:
    """Set the label of a part of a page. Raises OSError."""
    return decide(writer, LABEL if part == PAGE else f"{LABEL}_{part}", check_text(LABEL, label), page=page)


def _of_part(name: str, leaf: Leaf) -> str:
    """Return the name of a decision on a leaf side: of its part where the page has several."""
    split = leaf.page.restored is not None and leaf.page.restored.is_split
    return f"{name}_{leaf.part}" if split else name
