"""A shift as it is worked: keys in, lines out, events in the session."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from threading import Event

import numpy as np
import pytest

from drivers import ScannerError
from restore import PageEdits, RangeScan
from station.capture_loop import loop as loop_module
from station.capture_loop.loop import CaptureLoop
from station.session import Page, Volume, add_rule, add_scan, correct, create_session, open_session, read_session
from station.session.corrections.transfer import carried_edits
from station.session.derivation.restoration import Run
from station.session.fixity.verify import verify
from station.session.terms.presets import load_preset
from station.session.terms.rules import Scope, edits_of
from station.verdict.same_page import fingerprint
from tests.station.conftest import GOOD


class Restorer:
    """Restores at once, or when `release` is called; every page looks otherwise, unless `same` is set."""

    def __init__(self) -> None:
        self.held: list[Callable[[], None]] = []
        self.hold = self.same = False
        self.crashes, self.measures, self.calls = 0, dict(GOOD), 0

    def submit(self, source: Path, parameters: object, folder: Path) -> Future[Run]:
        future: Future[Run] = Future()
        self.calls += 1
        random = np.random.default_rng(0 if self.same else self.calls)
        picture = fingerprint(random.integers(0, 256, (200, 200, 3), np.uint8))

        def finish() -> None:
            if self.crashes:
                self.crashes -= 1
                future.set_exception(BrokenProcessPool())
                return
            assert source.exists()
            folder.mkdir()
            (folder / "page.png").write_bytes(bytes([self.calls]))
            future.set_result(Run({"measures": {**self.measures, "fingerprint": picture}}, {"seconds": 1}))

        self.held.append(finish)
        if not self.hold:
            self.release()
        return future

    def release(self) -> None:
        held, self.held = self.held, []
        for finish in held:
            finish()


@pytest.fixture
def book(tmp_path: Path) -> Path:
    settings = load_preset("leaflet").model_dump(mode="json", exclude_none=True)
    create_session(tmp_path / "book", Volume(title="A book", preset_values=settings))
    return tmp_path / "book"


@contextmanager
def loop_of(book: Path, scan: RangeScan, restorer: Restorer) -> Iterator[tuple[CaptureLoop, list[str]]]:
    lines = list[str]()
    with open_session(book) as writer:
        yield CaptureLoop(writer, lambda: scan, restorer.submit, lambda message: lines.append(message.text)), lines


def work(book: Path, scan: RangeScan, restorer: Restorer, keys: str) -> list[str]:
    with loop_of(book, scan, restorer) as (loop, lines):
        for key in keys:
            loop.inbox.put(key)
        loop.inbox.put("")
        loop.run()
    assert verify(book).problems == ()
    return lines


def pages(book: Path) -> list[Page]:
    return list(read_session(book).history.pages())


def test_pages_are_shot_restored_checked_and_accepted(book, tiny_scan):
    lines = work(book, tiny_scan, Restorer(), " \n \nm")
    assert [(page.state, sorted(page.runs)) for page in pages(book)] == [("accepted", ["restore", "verdict"])] * 2
    assert "page 1 [1r]: GREEN  8 checks" in lines
    assert "page 2 [1v]: GREEN  9 checks" in lines  # the second is compared with the first
    assert "page 2 [1v]: marked" in lines
    assert pages(book)[0].runs["verdict"].facts["result"]["level"] == "green"


def test_a_bad_shot_is_reported_next_to_its_limits_and_shot_again(book, tiny_scan):
    restorer = Restorer()
    restorer.measures["blur_px"] = 2.0
    restorer.measures["hole_mm"] = 40.0
    lines = work(book, tiny_scan, restorer, " ")
    assert "page 1 [1r]: RED  8 checks" in lines
    assert any("red    widest hole 40.0 mm (amber > 5.0 mm, red > 15.0 mm)" in line for line in lines)
    assert any("amber  focus 2.0 px" in line for line in lines)
    restorer.measures = dict(GOOD)
    assert "page 1 [1r]: GREEN  8 checks" in work(book, tiny_scan, restorer, "r")
    (page,) = pages(book)
    assert page.capture.parent is not None
    work(book, tiny_scan, restorer, "u")
    assert pages(book)[0].runs["verdict"].facts["result"]["level"] == "red"


def test_the_same_page_twice_is_seen(book, tiny_scan):
    restorer = Restorer()
    restorer.same = True
    lines = work(book, tiny_scan, restorer, "  ")
    assert any("same page as page 1 1.00" in line for line in lines)


def test_the_next_page_is_shot_while_the_last_is_restored(book, tiny_scan):
    restorer = Restorer()
    restorer.hold = True
    with loop_of(book, tiny_scan, restorer) as (loop, lines):
        loop.press("capture")
        loop.press("capture")
        assert [len(page.runs) for page in loop.writer.history.pages()] == [0, 0]
        loop.press("again")
        restorer.release()
        loop.inbox.put("q")
        loop.run()
        assert [line for line in lines if "GREEN" in line] == ["page 1 [1r]: GREEN  8 checks"] + [
            "page 2 [1v]: GREEN  9 checks"
        ] * 2
    assert [len(page.runs) for page in pages(book)] == [2, 2]


def test_a_shift_is_taken_up_where_it_was(book, tiny_scan):
    restorer = Restorer()
    restorer.hold = True
    with loop_of(book, tiny_scan, restorer) as (loop, _):
        loop.press("capture")  # and the power fails
    lines = work(book, tiny_scan, Restorer(), "\n ")
    assert lines[0].startswith("A book: 1 pages.")
    assert [(page.state, sorted(page.runs)) for page in pages(book)] == [
        ("accepted", ["restore", "verdict"]),
        ("restored", ["restore", "verdict"]),
    ]


def test_a_note_is_typed_and_no_key_of_it_is_an_action(book, tiny_scan):
    lines = work(book, tiny_scan, Restorer(), " ntorn rq\x7f at the top\n")
    assert pages(book)[0].decided.note == "torn r at the top"
    assert "page 1 [1r]: note: torn r at the top" in lines


def test_undo_and_redo(book, tiny_scan):
    lines = work(book, tiny_scan, Restorer(), " \nuuUU?x")
    assert pages(book)[0].state == "accepted"
    assert lines.count("page 1 [1r]: accept undone") == 1
    assert "there is nothing more" in work(book, tiny_scan, Restorer(), "U")


@pytest.mark.parametrize(("crashes", "reported"), [(1, "GREEN"), (2, "not restored: the program ended")])
def test_a_crash_of_a_restoration_is_tried_again_once(book, tiny_scan, crashes, reported):
    restorer = Restorer()
    restorer.crashes = crashes
    assert any(reported in line for line in work(book, tiny_scan, restorer, " "))


def test_a_fault_of_the_program_costs_one_page(book, tiny_scan):
    restorer = Restorer()

    def faulty(source: Path, parameters: object, folder: Path) -> Future[Run]:
        future: Future[Run] = Future()
        folder.mkdir()
        (folder / "half.png").write_bytes(b"half")
        future.set_exception(ZeroDivisionError("no such page"))
        return future

    with loop_of(book, tiny_scan, restorer) as (loop, lines):
        loop.submit = faulty
        loop.press("capture")
        loop.finish(loop.inbox.get())
        loop.submit = restorer.submit
        loop.press("capture")
        loop.finish(loop.inbox.get())
    assert any("RED  not restored: unexpected fault: ZeroDivisionError: no such page" in line for line in lines)
    first, second = pages(book)
    assert (dict(first.runs["restore"].files), "verdict" in first.runs) == ({}, False)
    assert "verdict" in second.runs


def test_a_full_disk_ends_the_shift(book, tiny_scan):
    with loop_of(book, tiny_scan, Restorer()) as (loop, _):
        future: Future[Run] = Future()
        future.set_exception(OSError(28, "No space left on device"))
        loop.submit = lambda *_: future
        loop.press("capture")
        with pytest.raises(OSError, match="No space"):
            loop.finish(loop.inbox.get())


def test_a_scanner_that_fails_ends_no_shift(book, tiny_scan):
    with loop_of(book, tiny_scan, Restorer()) as (loop, lines):

        def fail() -> RangeScan:
            raise ScannerError("the barrier is on", "take it off")

        loop.shoot = fail
        loop.press("capture")
        loop.shoot = None
        loop.press("capture")
        loop.press("accept")
    assert lines == [
        "not captured: the barrier is on (take it off)",
        "no scanner is configured: name its configuration with --config",
        "no page has been captured yet: space captures the first",
    ]


SPINE = edits_of({"spine": [[3.0, 0.0], [3.0, 7.0]], "by": {"operator": "A. B.", "tool": "cli"}})


def test_keys_work_while_corrections_are_carried_to_a_new_scan(book, tiny_scan, monkeypatch):
    """The scan of twenty points shows no page, so that its spine is dropped, and the page says so."""
    begun, free = Event(), Event()

    def held(*arguments):
        begun.set()
        assert free.wait(60)
        return carried_edits(*arguments)

    monkeypatch.setattr(loop_module, "carried_edits", held)
    with loop_of(book, tiny_scan, Restorer()) as (loop, lines):
        loop.press("capture")
        loop.finish(loop.inbox.get())
        loop.change(partial(correct, page=1, edits=SPINE))
        loop.finish(loop.inbox.get())
        loop.press("again")
        assert begun.wait(60)
        loop.press("mark")
        assert (loop.is_busy, loop.restoring) == (True, [1])
        assert "edits" not in loop.writer.history.page(1).decisions
        free.set()
        loop.inbox.put("q")
        loop.run()
        assert "page 1 [1r]: corrections dropped" in lines
    (page,) = pages(book)
    assert page.decided.edits.given()["by"] == {"operator": "A. B.", "tool": "dropped"}
    assert "restore" in page.runs
    assert page.decided.mark is True


def test_a_shift_that_ended_before_corrections_were_carried_carries_them(book, tiny_scan):
    with open_session(book) as writer:
        add_scan(writer, tiny_scan, facts={})
        correct(writer, 1, PageEdits(kind="leaf"))
        add_scan(writer, tiny_scan, page=1, facts={})
    lines = work(book, tiny_scan, Restorer(), "")
    assert "page 1 [1r]: corrections carried" in lines
    assert pages(book)[0].decided.edits.kind == "leaf"
    lines = work(book, tiny_scan, Restorer(), "u")  # and what was undone is not carried again
    assert not pages(book)[0].decided.edits
    assert "page 1 [1r]: corrections carried" not in work(book, tiny_scan, Restorer(), "")


def test_a_person_is_served_before_the_pages_that_are_due(book, tiny_scan):
    with open_session(book) as writer:
        for _ in range(6):
            add_scan(writer, tiny_scan, facts={})
    restorer = Restorer()
    restorer.hold = True
    with loop_of(book, tiny_scan, restorer) as (loop, lines):
        loop.catch_up()
        assert (restorer.calls, loop.restoring) == (2, [1, 2, 3, 4, 5, 6])
        loop.change(partial(correct, page=5, edits=PageEdits(layout="whole")))
        assert restorer.calls == 3
        restorer.hold = False
        restorer.release()  # three results wait before the keys
        for key in "mq":
            loop.inbox.put(key)
        loop.run()
        restored = [event.page for event in loop.writer.history.events if event.name == "restore"]
    assert lines.index("page 6 [3v]: marked") < next(at for at, line in enumerate(lines) if "GREEN" in line)
    assert "6 pages are still being restored; Ctrl-C leaves them for the next shift" in lines
    assert restored == [1, 2, 5, 6, 4, 3]  # those next to the operator's page first


def test_a_page_that_was_corrected_back_is_not_restored(book, tiny_scan):
    restorer = Restorer()
    work(book, tiny_scan, restorer, "   ")
    with loop_of(book, tiny_scan, restorer) as (loop, _):
        restorer.hold = True
        loop.change(partial(add_rule, scope=Scope(), edits=PageEdits(layout="whole", kind="plate")))
        assert (restorer.calls, loop.restoring) == (5, [1, 2, 3])
        loop.press("undo")
        assert loop.restoring == [1, 2]  # those that were handed out
