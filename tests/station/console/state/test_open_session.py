"""The open session: worked on by its capture loop, or only read while another process works on it."""

from __future__ import annotations

import threading

import pytest

from restore import BadInput, RangeScan
from station.console.faults import ConsoleFault
from station.console.state.open_session import Listener, OpenSession, WritableSession
from station.errors import FolderInUse
from station.session import add_scan, open_session
from tests.station.conftest import curl_scan
from tests.station.console.conftest import StandInRestorer, wait_for


def listener(lines=None, ended=None) -> Listener:
    return Listener(
        (lines if lines is not None else []).append, lambda: None, (ended if ended is not None else []).append
    )


def test_a_session_that_is_only_read_follows_the_one_who_writes(root):
    with open_session(root / "missale") as writer:
        opened = OpenSession(root / "missale", held_by="4711")
        assert (opened.rows(), opened.is_read_only, opened.page) == ([], True, None)
        add_scan(writer, curl_scan(), facts={"by": "a test"})
        assert [row["page"] for row in opened.rows()] == [1]
        assert opened.rows() is opened.rows()
        with pytest.raises(ConsoleFault, match="no page 2"):
            opened.row(2)


def test_opening_a_session_that_is_taken_leaves_no_thread(root):
    with open_session(root / "missale"):
        writable = WritableSession(root / "missale", None, listener(), restorations=StandInRestorer())
        with pytest.raises(FolderInUse):
            writable.start()


def test_tasks_are_done_between_keys_and_closing_waits_for_them(root):
    lines, ended = [], []
    writable = WritableSession(
        root / "missale", lambda: curl_scan(), listener(lines, ended), restorations=StandInRestorer()
    )
    writable.start()
    writable.do(lambda: writable.loop.press("capture"))
    wait_for(lambda: [row["level"] for row in writable.rows()] == ["green"])
    assert (writable.page, writable.restoring, writable.recovery) == (1, [], None)
    assert writable.page_sizes() > [0]
    writable.do(lambda: writable.loop.press("mark"))
    writable.close()
    assert writable.rows()[0]["marked"]
    assert ended == [None]
    assert [line.key for line in lines] == ["title", "stored", "verdict", "marked"]


def test_a_fault_in_the_shift_ends_it_and_is_reported(root):
    ended = []

    def no_disk() -> RangeScan:
        raise OSError(5, "input/output error", "x")

    writable = WritableSession(root / "missale", no_disk, listener(ended=ended), restorations=StandInRestorer())
    writable.start()
    writable.do(lambda: writable.loop.press("capture"))
    assert writable.join(10)
    assert isinstance(ended[0], OSError)


def test_what_is_pressed_while_a_session_is_being_closed_is_refused_not_lost(root):
    go_on, ended = threading.Event(), []
    writable = WritableSession(root / "missale", None, listener([], ended), restorations=StandInRestorer())
    writable.start()
    writable.do(go_on.wait)
    closing = threading.Thread(target=writable.close)
    closing.start()
    wait_for(lambda: writable._is_leaving)
    with pytest.raises(ConsoleFault, match="is being closed"):
        writable.do(lambda: ended.append("never"))
    go_on.set()
    closing.join()
    assert ended == [None]
    with pytest.raises(ConsoleFault, match="is being closed"):
        writable.change(ended.append)


def test_the_scanner_is_free_after_a_shot_that_came_too_late(opened, served, monkeypatch):
    def refuse(task):
        raise ConsoleFault("no_session_open", "it is being closed")

    monkeypatch.setattr(served.app_state.open_session, "do", refuse)
    assert opened.post("/api/press", json={"action": "capture"}).status_code == 409
    assert opened.get("/api/state").json()["scanner"]["busy"] is None


@pytest.mark.parametrize(
    ("action", "text", "status"), [("side", "1\x1b[2J", 422), ("note", "a\nb", 202), ("side", "a\nb", 422)]
)
def test_texts_hold_no_control_characters(opened, served, action, text, status):
    assert opened.post("/api/press", json={"action": "capture"}).status_code == 202
    wait_for(lambda: [row["level"] for row in served.app_state.open_session.rows()] == ["green"])
    answer = opened.post("/api/press", json={"action": action, "page": 1, "text": text})
    assert answer.status_code == status


def test_a_fault_costs_the_decision_and_not_the_session(opened, served):
    writable = served.app_state.open_session
    for error in (ZeroDivisionError("a fault of the program"), BadInput("a value", "")):

        def fail(_loop, error=error):
            raise error

        with pytest.raises(type(error)):
            writable.ask(fail)
    assert opened.post("/api/press", json={"action": "capture"}).status_code == 202
    wait_for(lambda: [row["level"] for row in writable.rows()] == ["green"])
