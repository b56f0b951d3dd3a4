"""Arrange the leaf sides of a session: their order, their labels, and which are left out."""

from __future__ import annotations

from collections.abc import Sequence

from station.capture_loop.loop import CaptureLoop
from station.console.faults import ConsoleFault
from station.console.shown_pages.leaves import leaf_tag, order_tag, shown_leaf, shown_leaves
from station.console.state.open_session import WritableSession
from station.session import Session, decide
from station.session.leaves import LABEL, ORDER, Leaf, leaves_of
from station.session.ordering import leave_out, set_label
from station.session.texts import check_text


def move_leaves(opened: WritableSession, moved: Sequence[str], before: str | None, tag: int) -> None:
    """Move leaf sides before another one, or to the end, as one step.

    tag: of the order that they were moved in. Nothing is recorded where the order stays. Raises ConsoleFault for a leaf
    side that the session lacks, and with the present order where the tag is another's.
    """

    def record(loop: CaptureLoop) -> None:
        if order_tag(loop.writer.session) != tag:
            raise ConsoleFault.changed("the leaves were moved meanwhile", shown_leaves(loop.writer.session))
        names = [leaf.name for leaf in leaves_of(loop.writer.session)]
        for name in (*moved, *([] if before is None else [before])):
            leaf_named(loop.writer.session, name)
        if before in moved:
            raise ConsoleFault("invalid", f"leaf {before} cannot be before itself", "name another leaf")
        others = [name for name in names if name not in moved]
        at = len(others) if before is None else others.index(before)
        wanted = [*others[:at], *dict.fromkeys(moved), *others[at:]]
        if wanted != names:
            decide(loop.writer, ORDER, wanted)
            loop.changed()

    opened.ask(record)


def change_leaf(opened: WritableSession, name: str, tag: int, *, left_out: bool | None, label: str | None) -> None:
    """Leave a leaf side out or put it back, and set its label; None leaves it as it is.

    tag: of the leaf side that was changed. Raises ConsoleFault for a leaf side that the session lacks, and with its
    present values where the tag is another's; UsageError for a label with control characters.
    """
    text = None if label is None else check_text(LABEL, label)

    def record(loop: CaptureLoop) -> None:
        leaf = leaf_named(loop.writer.session, name)
        if leaf_tag(leaf) != tag:
            raise ConsoleFault.changed(f"leaf {name} was changed meanwhile", shown_leaf(leaf))
        if left_out is not None and left_out != leaf.is_left_out:
            leave_out(loop.writer, name, out=left_out)
        if text is not None and text != leaf.label:
            set_label(loop.writer, leaf.page.number, leaf.part, text)
        loop.changed()

    opened.ask(record)


def leaf_named(session: Session, name: str) -> Leaf:
    """Return a leaf side by its name. Raises ConsoleFault."""
    for leaf in leaves_of(session):
        if leaf.name == name:
            return leaf
    raise ConsoleFault("no_page", f"the session has no leaf {name}", "load the leaves again")
