"""Demonstrate a shift: an operator captures a simulated volume, opening by opening.

The volume is that of a configuration with `[[scanner.book]]`. The operator captures every opening, captures again what
is red, writes the labels, splits what the station asks about, and accepts every page.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import drivers
from restore import PageEdits
from station.capture_loop.loop import CaptureLoop, Show
from station.capture_loop.turning import turn
from station.config import StationConfig
from station.errors import UsageError
from station.session import Page, Session, Volume, correct, create_session, open_session, read_session
from station.session.derivation.service import Done, restore_keeping
from station.session.leaves.leaf import Leaf, leaves_of, picture_of
from station.session.log.results import Checked, QualityCheck, Restored
from station.session.operations.description import describe_page
from station.session.terms.parts import PAGE
from station.session.terms.presets import load_preset
from station.storage.atomic import lock_output_folder, new_folder, refuse_captured
from station.workers.background import background

PRESET = "book"
SESSION, SIDES = "book", "leaves"  # folders of a shift
VALUE = re.compile(r" \d.*")  # of a check, after what is checked
LAYOUT = "layout"  # the check that asks for the layout


class Opening(NamedTuple):
    """An opening of the volume as it was worked.

    first, again: what each capture gave; again is empty without one.
    """

    number: int
    lies: str
    first: str
    again: str = ""


class Shift(NamedTuple):
    """A shift over a volume: its openings, and the images of its leaf sides."""

    openings: list[Opening]
    files: list[Path]

    def as_json(self) -> dict[str, Any]:
        """The shift as JSON values."""
        return {"openings": [one._asdict() for one in self.openings], "leaf_sides": [str(path) for path in self.files]}


def demonstrate(output: Path, station: StationConfig, show: Show) -> Shift:
    """Work a shift in a session `book` of a folder.

    Its leaf sides are copied to a folder `leaves` next to it.
    Raises OverwriteError before any work where there is one of them; as `work_shift`.
    """
    sides = output / SIDES
    refuse_captured([output / SESSION, sides], hint="choose another folder, or remove what an earlier shift left")
    worked = work_shift(output / SESSION, station, show)
    session = read_session(output / SESSION)
    with lock_output_folder(output) as lock, new_folder(lock, SIDES) as folder:
        folder.mkdir()
        names = [_copied(session, leaf, folder) for leaf in leaves_of(session)]
    return Shift(worked, [sides / name for name in names])


def _copied(session: Session, leaf: Leaf, folder: Path) -> str:
    """Copy the image of a leaf side as `03-left.png`, and return that name."""
    stored = picture_of(session, leaf)
    assert stored is not None
    side = "" if leaf.part == PAGE else f"-{leaf.part}"
    name = f"{leaf.page.number:02}{side}.png"
    shutil.copyfile(stored, folder / name)
    return name


def table(shift: Shift) -> str:
    """Return the table of a shift: what lay there, and what each capture gave."""
    rows = [("opening", "what lies there", "first shot", "after r"), *(map(str, one) for one in shift.openings)]
    lines = ["{:>7}  {:<42} {:<30} {}".format(*row).rstrip() for row in rows]
    return "\n".join([*lines, totals(shift.openings, len(shift.files))])


def work_shift(folder: Path, station: StationConfig, show: Show) -> list[Opening]:
    """Capture the volume of a configuration into a new session.

    Returns its openings as they were worked.
    show: prints a line for the operator. Raises UsageError without a volume, ScannerError, OSError.
    """
    book = station.scanner.get("book")
    if not book:
        raise UsageError("the configuration has no [[scanner.book]]", "use simulated-book")
    preset = load_preset(PRESET).model_dump(mode="json", exclude_none=True)
    create_session(folder, Volume(title="A book of fifteen openings", preset=PRESET, preset_values=preset))
    with (
        open_session(folder) as writer,
        drivers.open_scanner(station.scanner) as scanner,
        background(restore_keeping) as submit,
    ):
        take = partial(scanner.capture, station.capture)
        loop = CaptureLoop(writer, take, submit, show, turn=partial(turn, scanner))
        for _ in book:
            loop.press("capture")
            _finish(loop, waiting=False)
        _finish(loop)
        for number in _red(writer.session):
            loop.press("again", page=number)
        _finish(loop)
        _write_labels(loop, book)
        worked = openings_of(writer.session, book)
        for number in _asked(writer.session):
            loop.change(partial(correct, page=number, edits=PageEdits(layout="split")))
        _finish(loop)
        for page in list(writer.history.pages()):
            loop.press("accept", page=page.number)
    return worked


def openings_of(session: Session, book: Sequence[Mapping[str, Any]]) -> list[Opening]:
    """Return what each capture of each opening gave, in the words of the operator's table."""
    labels = {leaf.page.number: leaf.label for leaf in leaves_of(session)}
    worked = []
    for page, opening in zip(session.history.pages(), book, strict=True):
        kind = str(opening.get("kind", ""))
        cells = [outcome(result, quality, kind, labels[page.number]) for result, quality in _shots(session, page)]
        worked.append(Opening(page.number, str(opening.get("lies", "")), *cells[:2]))
    return worked


def outcome(result: Restored, quality: QualityCheck, kind: str, label: str) -> str:
    """Return what a capture gave: the worst check, else what became of the page.

    kind: of what lies there. label: of the page.
    """
    if quality.level != "green":
        return f"{quality.level} {_named(quality.checks[0])}"
    parts = list(result.leaves)
    if len(parts) == 2:
        return 'green, split, no "same page"' if kind == "blank" else "green, split"
    if parts != [PAGE]:
        return f"green, {parts[0]} kept"
    if kind == "cover":
        return "green, cover"
    return f"green, whole, {label or 'not split'}"


def totals(worked: Sequence[Opening], sides: int) -> str:
    """Return the last line of the table. sides: leaf sides that are delivered."""

    def levels(cells: Sequence[str]) -> list[str]:
        counts = {name: sum(cell.startswith(name) for cell in cells) for name in ("green", "amber", "red")}
        return [f"{count} {name}" for name, count in counts.items() if count]

    shots = len(worked) + sum(bool(one.again) for one in worked)
    first, last = levels([one.first for one in worked]), levels([one.again or one.first for one in worked])
    again = shots - len(worked)
    counted = {0: "without `r`", 1: "after one `r`", 2: "after the two `r`"}.get(again, f"after {again} `r`")
    return (
        f"{len(worked)} openings, {shots} shots: at first {', '.join(first)}; {counted} {', '.join(last)}; "
        f"{sides} leaf sides delivered"
    )


def _finish(loop: CaptureLoop, *, waiting: bool = True) -> None:
    """Record restorations that have ended; wait for those under way as well."""
    while loop.is_busy if waiting else not loop.inbox.empty():
        message = loop.inbox.get()
        assert isinstance(message, Done)
        loop.finish(message)


def _red(session: Session) -> list[int]:
    return [page.number for page in session.history.pages() if page.level == "red"]


def _asked(session: Session) -> list[int]:
    """The pages of which the station asks for the layout."""
    pages = session.history.pages()
    return [page.number for page in pages if page.quality and any(one.name == LAYOUT for one in page.quality.checks)]


def _shots(session: Session, page: Page) -> Iterator[tuple[Restored, QualityCheck]]:
    """The result of the first restoration of each capture of a page, and its checks."""
    events = [event for event in session.history.events if event.page == page.number]
    for capture in (event for event in events if event.kind == "capture"):
        run = next(one for one in events if one.restored and one.on == capture.number)
        check = next(one for one in events if one.checked and one.on == run.number)
        assert run.restored is not None
        assert check.checked is not None
        yield run.restored, check.checked


def _named(check: Checked) -> str:
    """The check in the words of the table."""
    if check.name == LAYOUT:
        return "layout, `2` splits it"
    same = check.same_as
    return f"same page as {same.partition('/')[0]}" if same else VALUE.split(check.text, maxsplit=1)[0]


def _write_labels(loop: CaptureLoop, book: Sequence[Mapping[str, Any]]) -> None:
    """Label each leaf side as it is printed; those without a number have none."""
    writer = loop.writer
    for page, opening in zip(list(writer.history.pages()), book, strict=True):
        labels = list(opening.get("labels", ()))
        names = ["label_left", "label_right"] if opening.get("kind", "spread") in ("spread", "blank") else ["label"]
        describe_page(writer, page.number, dict(zip(names, labels or [""] * len(names), strict=True)))
