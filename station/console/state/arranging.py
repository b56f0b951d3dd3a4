"""Arrange the leaf sides of a session: their order, their labels, and which are left out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from station.capture_loop.loop import CaptureLoop
from station.console.faults import ConsoleFault
from station.console.shown_pages.leaves import arrangement_tag, shown_leaves
from station.console.state.open_session import WritableSession
from station.session import Session, decide
from station.session.leaves.leaf import LABEL, ORDER, Leaf, leaves_of
from station.session.operations.arrangement import leave_out, set_label, set_missing, set_runs
from station.session.terms.labels import MAX_MISSING, MAX_RUNS, Run
from station.session.terms.texts import check_text


def move_leaves(opened: WritableSession, moved: Sequence[str], before: str | None, tag: int) -> None:
    """Move leaf sides before another one, or to the end, as one step.

    tag: of the arrangement that they were moved in. Nothing is recorded where the order stays.
    Raises ConsoleFault for a leaf side that the session lacks, and with the present arrangement where the tag is
    another's.
    """

    def record(loop: CaptureLoop) -> None:
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

    _arrange(opened, tag, record)


def number_from(opened: WritableSession, name: str, run: Run | None, tag: int) -> None:
    """Begin a run of labels at a leaf side, or take away the one that begins there.

    Raises ConsoleFault as `move_leaves`.
    """

    def record(loop: CaptureLoop) -> None:
        leaf_named(loop.writer.session, name)
        present = list(loop.writer.history.volume.decided.labels)
        own = [] if run is None else [run.model_copy(update={"start": name})]
        wanted = [*(one for one in present if one.start != name), *own]
        _check_count(wanted, MAX_RUNS)
        if wanted != present:
            set_runs(loop.writer, wanted)

    _arrange(opened, tag, record)


def mark_missing(opened: WritableSession, name: str, labels: Sequence[str], tag: int) -> None:
    """Set the labels of the leaf sides that are missing before another one.

    Raises ConsoleFault as `move_leaves`, UsageError for a label with control characters.
    """
    texts = [check_text(LABEL, label) for label in labels]

    def record(loop: CaptureLoop) -> None:
        present = list(leaf_named(loop.writer.session, name).missing)
        _check_count([*loop.writer.history.volume.decided.missing, *texts], MAX_MISSING + len(present))
        if present != texts:
            set_missing(loop.writer, name, texts)

    _arrange(opened, tag, record)


def _arrange(opened: WritableSession, tag: int, record: Callable[[CaptureLoop], None]) -> None:
    """Record a change of the arrangement of a tag.

    Raises ConsoleFault where it is another one by now.
    """

    def checked(loop: CaptureLoop) -> None:
        if arrangement_tag(loop.writer.session) != tag:
            raise ConsoleFault.changed("the leaves were arranged meanwhile", shown_leaves(loop.writer.session))
        record(loop)
        loop.changed()

    opened.ask(checked)


def change_leaf(opened: WritableSession, name: str, tag: int, *, left_out: bool | None, label: str | None) -> None:
    """Leave a leaf side out or put it back, and set its label; None leaves it as it is.

    tag: of the leaf side that was changed. Raises ConsoleFault for a leaf side that the session lacks, and with its
    present values where the tag is another's; UsageError for a label with control characters.
    """
    text = None if label is None else check_text(LABEL, label)

    def record(loop: CaptureLoop) -> None:
        leaf = leaf_named(loop.writer.session, name)
        if leaf.tag != tag:
            (current,) = (one for one in shown_leaves(loop.writer.session)["leaves"] if one["name"] == name)
            raise ConsoleFault.changed(f"leaf {name} was changed meanwhile", current)
        if left_out is not None and left_out != leaf.is_left_out:
            leave_out(loop.writer, name, out=left_out)
        if text is not None and text != leaf.label:
            set_label(loop.writer, leaf.page.number, leaf.part, text)
        loop.changed()

    opened.ask(record)


def _check_count(wanted: Sequence[object], most: int) -> None:
    if len(wanted) > most:
        raise ConsoleFault("invalid", f"a volume has {most} of them at most", "take others away first")


def leaf_named(session: Session, name: str) -> Leaf:
    """Return a leaf side by its name. Raises ConsoleFault."""
    for leaf in leaves_of(session):
        if leaf.name == name:
            return leaf
    raise ConsoleFault("no_page", f"the session has no leaf {name}", "load the leaves again")
