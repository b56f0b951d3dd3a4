"""The capture loop: what happens on each key, and when a restoration ends."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from threading import Thread

from drivers import ScannerError
from drivers.scanner import Shot
from restore import BadInput, PageEdits
from station.capture_loop.inbox import Inbox
from station.capture_loop.keys import ACTIONS, HELP, Action
from station.capture_loop.turning import Place, place_of, stay
from station.session import (
    VOLUME,
    Event,
    Page,
    Writer,
    correct,
    redo,
    undo,
)
from station.session.captures.originals import add_shot
from station.session.corrections.transfer import carried_edits, uncarried
from station.session.derivation.quality import note_lines, verdict_lines
from station.session.derivation.service import Derivation, Done, Submit
from station.session.leaves.leaf import labels_of, missing_labels
from station.session.log.results import QualityCheck
from station.session.operations.description import describe_page
from station.session.terms.parts import PAGE
from station.session.terms.rules import EDITS, RULES

Task = Callable[[], None]
ERASE = "\b\x7f"  # what terminals send for backspace


@dataclass(frozen=True)
class Carried:
    """The corrections of an earlier scan as they fit a later one, when they are found."""

    capture: Event
    future: Future[PageEdits]


@dataclass(frozen=True)
class Message:
    """Line for the operator. key: what it reports. page: of which page, None for the volume."""

    text: str
    key: str = "line"
    page: int | None = None


Show = Callable[[Message], None]


@dataclass
class CaptureLoop:
    """The work at the scanner: keys, restorations, verdicts.

    shoot    captures a page; None without a scanner: the rest is restored and checked.
    submit   restores in the background.
    turn     turns the leaves to the place of a capture, before it; does nothing where the operator turns them.
    show     shows a line to the operator.
    changed  is called after every event.
    inbox    keys, restorations that have ended, and tasks to be done between the two.
    outputs  files of a restoration in addition to those of the preset.
    ahead    due pages that are handed out: one is restored, and the next one waits for it.
    """

    writer: Writer
    shoot: Callable[[], Shot] | None
    submit: Submit
    show: Show
    changed: Callable[[], None] = lambda: None
    inbox: Inbox[str | Done | Carried | Task] = field(default_factory=Inbox)
    outputs: tuple[str, ...] = ()
    ahead: int = 2
    turn: Callable[[Place], None] = stay

    def __post_init__(self) -> None:
        self._derivation = Derivation(self.writer, outputs=self.outputs, checked=self._show_quality)
        self._waiting: set[int] = set()
        self._carrying: set[int] = set()
        self._due: set[int] = set()
        self._noted: set[str] = set()
        self._page: int | None = None
        self._leaving = False
        self._typed: str | None = None

    def run(self) -> None:
        """Continue what an earlier loop left, then work until the operator leaves.

        Every restoration has then ended. Raises OSError when the disk refuses; the captures are stored by then.
        """
        self._take_up()
        while self.is_busy or not self._leaving:
            message = self.inbox.get()
            if isinstance(message, Done):
                self.finish(message)
            elif isinstance(message, Carried):
                self.record_carried(message)
            elif self._leaving:
                continue
            elif isinstance(message, str):
                self.type(message)
            else:
                message()

    @property
    def is_busy(self) -> bool:
        """Whether a restoration is under way, or corrections are carried over."""
        return bool(self._waiting or self._carrying or self._due)

    @property
    def page(self) -> int | None:
        """The number of the page that keys act on; None before the first."""
        return self._page

    @property
    def restoring(self) -> list[int]:
        """The pages whose restoration is under way."""
        events = (self.writer.history.event(number) for number in [*self._waiting, *self._carrying])
        return sorted({*self._due, *(event.page for event in events)})

    def type(self, key: str) -> None:
        """One key of the operator: an action, or a character of a note."""
        if self._typed is not None and key:
            self._add_to_note(key)
        else:
            self.press(ACTIONS.get(key, "help"))

    def press(self, action: Action, *, page: int | None = None) -> None:
        """What one key does, on a page that is named, or else on that of the last key."""
        if page is not None:
            self._page = page
        {
            "capture": lambda: self._shoot(None),
            "again": lambda: self._shoot(self._page),
            "accept": self._accept,
            "undo": lambda: self._step(undo(self.writer), "undone", "undone"),
            "redo": lambda: self._step(redo(self.writer), "done again", "redone"),
            "mark": self._mark,
            "note": self._note,
            "help": lambda: self.show(Message(HELP)),
            "quit": self._leave,
        }[action]()

    def _take_up(self) -> None:
        pages = list(self.writer.history.pages())
        self._page = pages[-1].number if pages else None
        self.show(Message(f"{self.writer.session.volume.title}: {len(pages)} pages. {HELP}", "title"))
        for gap in missing_labels(self.writer.session):
            self.show(Message(f"pages are missing {gap}", "missing"))
        self.catch_up()

    def catch_up(self) -> None:
        """Restore pages that are not as they are corrected, and check the others."""
        self._due = {capture.page for capture in self._derivation.due(running=self._waiting)}
        self._restore_next()

    def _restore_next(self) -> None:
        """Restore the next pages that are due, first those next to the operator's page.

        Few are handed out ahead, so that a page that the operator changes does not wait for hundreds.
        """
        while self._due and len(self._waiting) + len(self._carrying) < self.ahead:
            self._restore_page(min(self._due, key=lambda page: abs(page - (self._page or 0))))

    def _restore_page(self, page: int) -> None:
        self._due.discard(page)
        for capture in self._derivation.due(page=page, running=self._waiting):
            self._begin(capture)

    def _shoot(self, page: int | None) -> None:
        if self.shoot is None:
            self.show(Message("no scanner is configured: name its configuration with --config", "no_scanner"))
            return
        try:
            self.turn(place_of(self.writer.history, page))
            event = add_shot(self.writer, self.shoot(), page=page)
        except (ScannerError, BadInput) as error:
            self.show(Message(f"not captured: {error}" + (f" ({error.hint})" if error.hint else ""), "not_shot"))
            return
        self._page = event.page
        self._show_of_page(event.page, "stored", "stored")
        self._begin(event)

    def _carry(self, capture: Event, earlier: Event, edits: PageEdits) -> None:
        """Carry corrections over to a scan: in a thread where their points have to be found on it."""

        session, done = self.writer.session, Carried(capture, Future())
        self._carrying.add(capture.number)

        def work() -> None:
            try:
                done.future.set_result(carried_edits(session, earlier, capture, edits))
            except Exception as error:  # raised again in the loop
                done.future.set_exception(error)
            self.inbox.put(done)

        if edits.has_points:
            Thread(target=work, name="carry", daemon=True).start()
        else:
            done.future.set_result(carried_edits(session, earlier, capture, edits))
            self.record_carried(done)

    def record_carried(self, done: Carried) -> None:
        """Record corrections that were carried over, and restore the page with them.

        They are dropped where the operator has corrected the page or gone back to another scan meanwhile.
        Raises OSError.
        """
        capture, edits = done.capture, done.future.result()
        self._carrying.discard(capture.number)
        current = self.writer.history.page(capture.page).capture
        if current == capture and uncarried(self.writer.history, capture) is not None:
            correct(self.writer, capture.page, edits)
            self._show_of_page(capture.page, f"corrections {edits.by.tool}", f"edits_{edits.by.tool}")
        if current == capture and capture.number not in self._waiting:
            self._restore(capture)
        self._restore_next()

    def _begin(self, capture: Event) -> None:
        """Restore a scan, with the corrections of the one that it replaced."""
        if capture.number in self._carrying:
            return
        found = uncarried(self.writer.history, capture)
        if found is None:
            self._restore(capture)
        else:
            self._carry(capture, *found)

    def _restore(self, capture: Event) -> None:
        job = self._derivation.job(capture)
        future = self.submit(job.source, job.parameters, job.folder)
        self._waiting.add(capture.number)
        future.add_done_callback(lambda done: self.inbox.put_result(Done(job, done)))

    def finish(self, done: Done) -> None:
        """Record a restoration, and check its quality.

        One whose process crashed is tried once more, then recorded as failed.
        """
        capture = done.job.capture
        self._waiting.discard(capture.number)
        if done.future.cancelled():
            return
        settled = self._derivation.settle_done(done)
        if settled is None:
            self._begin(capture)
            return
        for part, leaf in settled.run.result.failures:
            name = f"{self._name(capture.page)}{'' if part == PAGE else f', {part}'}"
            self.show(
                Message(f"{name}: RED  not restored: {leaf.error} ({leaf.hint})", "restored_failed", capture.page)
            )
        if settled.quality is not None:
            self._show_quality(capture.page, settled.quality)
        self.changed()
        self._restore_page(capture.page)
        self._restore_next()

    def _show_quality(self, page: int, quality: QualityCheck) -> None:
        new = [line for line in note_lines(quality) if line not in self._noted]  # not with every page
        self._noted.update(new)
        for line in (*verdict_lines(self._name(page), quality), *new):
            self.show(Message(line, "verdict", page))

    def _accept(self) -> None:
        page = self._current()
        if page is None or page.capture is None:
            return
        describe_page(self.writer, page.number, {"accept": True})
        self._show_of_page(page.number, "accepted", "accepted")

    def _mark(self) -> None:
        page = self._current()
        if page is not None:
            marked = not page.decided.mark
            describe_page(self.writer, page.number, {"mark": marked})
            self._show_of_page(page.number, *(("marked", "marked") if marked else ("no longer marked", "unmarked")))

    def _note(self) -> None:
        if self._current() is not None:
            self._typed = ""
            self.show(Message("note, then enter:"))

    def _add_to_note(self, key: str) -> None:
        """Add one character to a note.

        Enter ends it; an empty note is not recorded.
        """
        typed, page = self._typed or "", self._current()
        if key not in "\r\n":
            self._typed = typed[:-1] if key in ERASE else typed + key * key.isprintable()
            return
        self._typed = None
        if page is not None and typed.strip():
            self.note(typed.strip())

    def note(self, text: str, *, page: int | None = None) -> None:
        """Write a note on a page that is named, or else on that of the last key.

        An empty note removes it.
        """
        self._page = self._page if page is None else page
        current = self._current()
        if current is not None:
            describe_page(self.writer, current.number, {"note": text})
            self._show_of_page(current.number, f"note: {text}", "note")

    def _step(self, step: Event | None, word: str, key: str) -> None:
        if step is None:
            self.show(Message("there is nothing more", "nothing_more"))
            return
        if step.page != VOLUME:
            self._page = step.page
        self._show_of_page(step.page, f"{step.name} {word}", key)
        if step.page == VOLUME:
            self.catch_up()
        else:
            self._restore_page(step.page)

    def change(self, operation: Callable[[Writer], Event | None]) -> Event | None:
        """Have an operation change the session, and restore the pages that it corrects.

        Returns its event, None where nothing changes.
        """
        event = operation(self.writer)
        if event is None or event.name not in (EDITS, RULES):
            self.changed()
            return event
        if event.name == EDITS:
            self._page = event.page
            self._show_of_page(event.page, "corrected", "corrected")
            self._restore_page(event.page)
        else:
            self._show_of_page(VOLUME, f"rule {event.number} recorded", "rule")
            self.catch_up()
        return event

    def _leave(self) -> None:
        self._leaving = True
        count = len(self._waiting) + len(self._due)
        if count:
            self.show(Message(f"{count} pages are still being restored; Ctrl-C leaves them for the next shift"))

    def _show_of_page(self, page: int, text: str, key: str) -> None:
        self.changed()
        self.show(Message(f"{self._name(page)}: {text}", key, page or None))

    def _current(self) -> Page | None:
        if self._page is None:
            self.show(Message("no page has been captured yet: space captures the first", "no_page"))
            return None
        return self.writer.history.page(self._page)

    def _name(self, number: int) -> str:
        """`page 3 [2r]`: its number and its label; `the volume`."""
        if number == VOLUME:
            return "the volume"
        label = labels_of(self.writer.session).get(number)
        return f"page {number} [{label}]" if label else f"page {number}"
