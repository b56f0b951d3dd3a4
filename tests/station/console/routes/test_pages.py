"""A shift as a browser works it: actions in, rows and events out; what goes wrong on the way."""

from __future__ import annotations

import json
import threading

import pytest

from drivers.scanner import LASER_MAY_BE_ON, DeviceError, TransportError
from station.console.state.scanner import ScannerOwner
from station.session import open_session, read_session
from station.session.fixity.verify import verify
from tests.station.conftest import curl_scan
from tests.station.console.conftest import TAB, GatedScanner, StandInRestorer, serving, wait_for


def press(browser, action, **further):
    return browser.post("/api/press", json={"action": action, **further})


def rows(browser):
    return browser.get("/api/pages").json()["pages"]


def shoot(browser, action="capture", **further):
    """Shoot, and wait for the verdict; the row of the page."""
    before = browser.get("/api/state").json()["session"]["events"]
    assert press(browser, action, **further).status_code == 202

    def checked():
        state = browser.get("/api/state").json()
        done = state["scanner"]["busy"] is None and state["session"]["restoring"] == []
        return state if done and state["session"]["events"] >= before + 3 else None

    state = wait_for(checked, "the verdict")
    return next(row for row in rows(browser) if row["page"] == state["session"]["current"])


def test_pages_are_shot_checked_accepted_marked_and_taken_back(opened, root):
    row = shoot(opened)
    assert (row["page"], row["label"], row["side"], row["level"], row["busy"]) == (1, "1", "right", "green", False)
    assert press(opened, "accept").json() == {"accepted": True, "action": "accept", "page": 1}
    wait_for(lambda: rows(opened)[0]["accepted"])
    shoot(opened)
    press(opened, "mark", page=1)
    press(opened, "note", page=2, text=" torn at the foot ")
    wait_for(lambda: rows(opened)[1]["note"])
    assert [(row["marked"], row["note"]) for row in rows(opened)] == [(True, ""), (False, "torn at the foot")]
    press(opened, "undo")
    wait_for(lambda: not rows(opened)[1]["note"])
    press(opened, "redo")
    wait_for(lambda: rows(opened)[1]["note"])
    opened.post("/api/close")
    assert verify(root / "missale").problems == ()


def test_a_page_is_shot_again_and_the_first_shot_comes_back(opened):
    first = shoot(opened)
    again = shoot(opened, "again", page=1)
    assert again["page"] == 1
    assert again["capture"] > first["capture"]
    detail = opened.get("/api/pages/1").json()
    assert [shot["current"] for shot in detail["shots"]] == [False, True]
    press(opened, "undo")
    wait_for(lambda: rows(opened)[0]["capture"] == first["capture"])
    assert rows(opened)[0]["restore"] == first["restore"]


def test_a_page_is_put_between_two(opened):
    shoot(opened)
    shoot(opened)
    inserted = shoot(opened, "insert", page=2)
    wait_for(lambda: [row["page"] for row in rows(opened)] == [1, 3, 2])
    assert inserted["page"] == 3
    assert [row["position"] for row in rows(opened)] == [1, 2, 3]
    orders = [row["order"] for row in rows(opened)]
    assert orders == sorted(orders)
    shoot(opened, "insert", page=1)
    wait_for(lambda: [row["page"] for row in rows(opened)] == [4, 1, 3, 2])


def test_a_page_shows_its_findings_next_to_their_limits(served, opened):
    served.restorer.measures["blur_px"] = 2.5
    row = shoot(opened)
    assert row["level"] == "red"
    assert row["rank"] > 2.0
    detail = opened.get("/api/pages/1").json()
    worst = detail["checks"][0]
    assert (worst["name"], worst["level"], worst["value"], worst["limits"]) == ("blur_px", "red", 2.5, [1.2, 2.0])
    assert (worst["unit"], worst["less_is_worse"]) == ("px", False)
    covered = next(one for one in detail["checks"] if one["name"] == "measured_fraction")
    assert covered["less_is_worse"]
    assert "fingerprint" not in json.dumps(detail)
    assert [event["name"] for event in detail["events"]] == ["capture", "restore", "verdict"]
    assert detail["page_mm"] == [120.0, 80.0]
    assert sum(file["bytes"] for file in detail["files"]) > 0


def test_a_shot_under_way_takes_no_second_one_and_shows_its_laser(served, opened):
    served.scanner.gate.clear()
    assert press(opened, "capture").status_code == 202
    assert served.scanner.in_shot.wait(10)
    state = opened.get("/api/state").json()["scanner"]
    assert (state["busy"], state["laser"], state["step"]) == ("capture", "on", "scan")
    for action in ("capture", "preview"):
        refused = press(opened, action)
        assert (refused.status_code, refused.json()["error"]["key"]) == (409, "busy")
    assert opened.post("/api/close").json()["error"]["key"] == "session_open"
    served.scanner.gate.set()
    wait_for(lambda: len(rows(opened)) == 1)
    wait_for(lambda: opened.get("/api/state").json()["scanner"]["laser"] == "off")
    assert len(served.scanner.shots) == 1


def test_a_browser_that_goes_in_the_middle_of_a_shot_interrupts_nothing(served):
    """The tab closed, the cable pulled, the laptop asleep: the laser goes off, the frame is kept."""
    with served.client() as browser:
        browser.post("/api/sessions/missale/open")
        with browser.stream("GET", f"/api/events?tab={TAB}") as events:
            next(events.iter_lines())
            served.scanner.gate.clear()
            press(browser, "capture")
            assert served.scanner.in_shot.wait(10)
    wait_for(lambda: served.app_state.event_stream.count == 0)
    served.scanner.gate.set()
    wait_for(lambda: not served.scanner.laser and served.app_state.open_session.rows())
    assert served.app_state.scanner.as_json()["laser"] == "off"
    wait_for(lambda: served.app_state.scanner.as_json()["busy"] is None)
    served.app_state.close()
    assert verify(served.root / "missale").problems == ()


def test_a_server_that_ends_in_the_middle_of_a_shot_keeps_the_frame(root):
    scanner = GatedScanner(curl_scan())
    restorer = StandInRestorer()
    with serving(root, scanner, restorer) as served:
        with served.client() as browser:
            browser.post("/api/sessions/missale/open")
            scanner.gate.clear()
            press(browser, "capture")
            assert scanner.in_shot.wait(10)
        threading.Timer(0.3, scanner.gate.set).start()
        served.app_state.end()
        assert (scanner.laser, scanner.closed) == (False, 1)
        served.app_state.scanner = ScannerOwner(None, lambda: None, lambda: None)  # the block ends it once more
    (page,) = read_session(root / "missale").history.pages()
    assert page.capture is not None
    assert verify(root / "missale").problems == ()


def test_what_a_crash_left_is_taken_up(root):
    scanner, restorer = GatedScanner(curl_scan()), StandInRestorer()
    with serving(root, scanner, restorer) as served, served.client() as browser:
        browser.post("/api/sessions/missale/open")
        restorer.gate.clear()
        press(browser, "capture")
        wait_for(lambda: rows(browser))
    with serving(root, scanner, restorer) as served, served.client() as browser:
        restorer.gate.clear()
        recovery = browser.post("/api/sessions/missale/open").json()["recovery"]
        assert (recovery["resumed"], recovery["completed"]) == ([1], False)
        wait_for(lambda: browser.get("/api/state").json()["recovery"]["left"] == 1)
        restorer.gate.set()
        wait_for(lambda: browser.get("/api/state").json()["recovery"]["left"] == 0)
        wait_for(lambda: rows(browser)[0]["restored"])


@pytest.mark.parametrize(
    ("fault", "laser"),
    [(DeviceError("no laser", "look"), "off"), (TransportError("gone"), "off"), (DeviceError("stuck"), "unknown")],
)
def test_a_fault_of_the_scanner_is_shown_and_the_next_shot_works(served, opened, fault, laser):
    if laser == "unknown":
        fault.add_note(LASER_MAY_BE_ON)
    served.scanner.fault = fault
    press(opened, "capture")
    state = wait_for(
        lambda: (state := opened.get("/api/state").json()["scanner"])["problem"] and not state["busy"] and state
    )
    assert (state["problem"]["text"], state["laser"]) == (str(fault), laser)
    served.scanner.fault = None
    shoot(opened)
    state = opened.get("/api/state").json()["scanner"]
    assert (state["problem"], state["laser"], state["connected"]) == (None, "off", True)


def test_a_restoration_that_fails_costs_its_page(served, opened):
    served.restorer.fault = ValueError("a fault of the program")
    press(opened, "capture")
    wait_for(lambda: rows(opened) and rows(opened)[0]["failed"])
    served.restorer.fault = None
    shoot(opened)
    assert [row["restored"] for row in rows(opened)] == [False, True]


def test_a_full_disk_ends_the_shift_and_says_so(served, opened, monkeypatch):
    monkeypatch.setattr(
        "station.capture_loop.loop.add_shot", lambda *_a, **_k: (_ for _ in ()).throw(OSError(28, "full", "x"))
    )
    press(opened, "capture")
    failed = wait_for(lambda: opened.get("/api/state").json()["failed"])
    assert "full" in failed["text"]
    assert opened.get("/api/pages").json()["error"]["key"] == "no_session_open"
    assert opened.get("/api/state").json()["scanner"]["busy"] is None
    monkeypatch.undo()
    assert opened.post("/api/sessions/missale/open").json()["failed"] is None
    shoot(opened)


def test_every_line_and_row_is_sent_to_every_tab(served, opened):
    with served.client("b" * 16) as watcher, watcher.stream("GET", f"/api/events?tab={'b' * 16}") as events:
        lines = events.iter_lines()
        seen: dict[str, list] = {}
        served.scanner.gate.clear()
        press(opened, "capture")
        name = ""
        for line in lines:
            if line.startswith("event: "):
                name = line[7:]
            elif line.startswith("data: "):
                seen.setdefault(name, []).append(json.loads(line[6:]))
            if any(state["scanner"]["laser"] == "on" for state in seen.get("state", ())):
                served.scanner.gate.set()
            if any(one.get("key") == "verdict" for one in seen.get("message", ())):
                break
    assert (seen["message"][0]["key"], seen["message"][0]["page"]) == ("stored", 1)
    assert seen["page"][0]["page"]["page"] == 1
    assert any(state["scanner"]["laser"] == "on" for state in seen["state"])


def test_a_second_tab_watches_until_it_takes_control(served, opened):
    with served.client("b" * 16) as second:
        refused = press(second, "capture")
        assert (refused.status_code, refused.json()["error"]["key"]) == (409, "read_only")
        assert refused.json()["error"]["data"]["held_by"]["tab"] == TAB
        assert second.get("/api/pages").status_code == 200
        state = second.post("/api/control", json={"tab": "b" * 16}).json()
        assert state["control"]["tab"] == "b" * 16
        assert press(opened, "mark").json()["error"]["key"] == "read_only"
        shoot(second)


def test_a_session_that_another_process_has_is_named_and_can_be_watched(served, client, root):
    with open_session(root / "missale"):
        assert "of" in client.get("/api/sessions").json()["sessions"][0]["held_by"]
        refused = client.post("/api/sessions/missale/open")
        assert (refused.status_code, refused.json()["error"]["key"]) == (409, "in_use")
        assert "of" in refused.json()["error"]["data"]["held_by"]
        state = client.post("/api/sessions/missale/open", json={"read_only": True}).json()
        assert state["session"]["read_only"]
        assert "of" in state["session"]["held_by"]
        assert press(client, "capture").json()["error"]["key"] == "in_use"
    assert client.get("/api/sessions").json()["sessions"][0]["held_by"] is None


def test_what_cannot_be_done_says_why(served, client, root):
    assert press(client, "capture").json()["error"]["key"] == "no_session_open"
    assert client.get("/api/pages").json()["error"]["key"] == "no_session_open"
    assert client.post("/api/sessions/gone/open").json()["error"]["key"] == "no_session"
    client.post("/api/sessions/missale/open")
    assert press(client, "accept").json()["error"]["key"] == "no_page"
    assert press(client, "mark", page=7).json()["error"]["key"] == "no_page"
    assert client.get("/api/pages/7").json()["error"]["key"] == "no_page"
    assert client.get("/api/preview").json() is None
    assert press(client, "fly").status_code == 422


def test_without_a_configuration_pages_are_looked_at_and_none_is_shot(root):
    with (
        serving(root, GatedScanner(curl_scan()), StandInRestorer(), config=None) as served,
        served.client() as browser,
    ):
        browser.post("/api/sessions/missale/open")
        assert press(browser, "capture").json()["error"]["key"] == "no_scanner"
        assert browser.get("/api/state").json()["scanner"]["configured"] is False
