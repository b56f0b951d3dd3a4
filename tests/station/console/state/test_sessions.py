"""The sessions of a folder: made, listed, looked up by name; what is a link is none of them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from restore import BadInput
from station.console.state import sessions
from station.errors import UsageError
from station.session import SessionDamaged, open_session, read_session
from station.session.fixity.tree import tree_digests
from station.session.log.current import preset_of
from station.storage.folder_lock import WORK
from tests.station.conftest import curl_scan
from tests.station.console.conftest import GatedScanner, StandInRestorer, serving
from tests.station.session.log.test_checks import events, written


def test_a_session_is_made_opened_and_closed(client, root):
    made = client.post("/api/sessions", json={"name": "graduale", "title": "Graduale", "preset": "leaflet"})
    assert made.status_code == 201
    assert (made.json()["name"], made.json()["pages"]) == ("graduale", 0)
    assert client.post("/api/sessions", json={"name": "graduale", "title": "x"}).json()["error"]["key"] == "exists"
    assert client.post("/api/sessions", json={"name": "x", "title": "x", "preset": "none"}).status_code == 422
    assert client.post("/api/sessions", json={"name": "x", "title": " \t"}).status_code == 422
    names = [entry["name"] for entry in client.get("/api/sessions").json()["sessions"]]
    assert sorted(names) == ["graduale", "missale"]
    assert client.post("/api/sessions/graduale/open").json()["session"]["name"] == "graduale"
    assert client.post("/api/sessions/missale/open").json()["session"]["name"] == "missale"
    assert client.post("/api/close").json()["session"] is None
    with open_session(root / "missale"):
        pass  # nobody has it any more


def test_names_lead_nowhere_else(client, root):
    for name in ("../up", "a/b", ".hidden", "a\0b", "", "x" * 101, "a\nb", "/etc"):
        assert client.post("/api/sessions", json={"name": name, "title": "x"}).status_code == 422
    (root / "link").symlink_to(root / "missale")
    assert [entry["name"] for entry in client.get("/api/sessions").json()["sessions"]] == ["missale"]
    assert client.post("/api/sessions/link/open").json()["error"]["key"] == "no_session"
    assert client.post("/api/sessions", json={"name": "link", "title": "x"}).json()["error"]["key"] == "exists"


def test_the_folders_of_exports_and_batches_are_not_names_of_sessions(client, root):
    for name in ("exports", "batches", "Exports"):
        refused = client.post("/api/sessions", json={"name": name, "title": "x"})
        assert (refused.status_code, refused.json()["error"]["key"]) == (422, "invalid")
        assert not (root / name).exists()


def test_a_session_in_their_place_is_not_written_into(client, root):
    for name, path, wanted in (
        ("exports", "/api/export", {"session": "missale", "format": "bagit"}),
        ("batches", "/api/batch", {"sessions": ["missale"]}),
    ):
        shutil.copytree(root / "missale", root / name)  # of an older version, or from another station
        before = tree_digests(root / name, without=WORK)
        refused = client.post(path, json=wanted)
        assert (refused.status_code, refused.json()["error"]["key"]) == (422, "invalid")
        assert tree_digests(root / name, without=WORK) == before


def test_a_damaged_session_is_listed_with_what_is_wrong_and_hides_no_other(client, root):
    (root / "hurt" / "data").mkdir(parents=True)
    for name in ("bagit.txt", "events.jsonl"):
        (root / "hurt" / name).write_text("damaged")
    entries = {entry["name"]: entry for entry in client.get("/api/sessions").json()["sessions"]}
    assert entries["hurt"]["problem"]["text"]
    assert entries["missale"]["problem"] is None
    refused = client.post("/api/sessions/hurt/open")
    assert (refused.status_code, refused.json()["error"]["key"]) == (422, "damaged")


def test_a_session_whose_words_are_read(client, root, monkeypatch):
    monkeypatch.setattr(sessions, "find_tesseract", lambda: Path("tesseract"))
    monkeypatch.setattr(sessions, "check_language", lambda *_: None)
    wanted = {"name": "herbal", "title": "Herbal", "words": True}
    assert client.post("/api/sessions", json=wanted).status_code == 201
    assert client.post("/api/sessions", json={"name": "map", "title": "Map"}).status_code == 201
    assert ["ocr" in preset_of(read_session(root / name)).outputs for name in ("herbal", "map")] == [True, False]


def test_words_are_refused_where_nothing_reads_them(client, root, monkeypatch):
    def missing():
        raise UsageError("Tesseract is not there", "sudo apt install tesseract-ocr")

    monkeypatch.setattr(sessions, "find_tesseract", missing)
    refused = client.post("/api/sessions", json={"name": "herbal", "title": "Herbal", "words": True})
    assert (refused.status_code, refused.json()["error"]["key"]) == (422, "invalid")
    assert "tesseract-ocr" in refused.json()["error"]["hint"]
    assert not (root / "herbal").exists()


def test_the_presets_are_listed(client):
    names = [preset["name"] for preset in client.get("/api/presets").json()["presets"]]
    assert {"book", "map", "leaflet", "crumpled"} <= set(names)


def test_a_lock_that_a_killed_process_left_is_nobodys(root):
    work = root / "missale" / ".planish-run"
    work.mkdir()
    (work / "lock").write_text("4711 of anna on scriptorium")
    assert sessions.holder_of(root / "missale") is None
    (work / "lock").unlink()
    (work / "lock").symlink_to("/etc/passwd")
    assert sessions.holder_of(root / "missale") is None


@pytest.mark.parametrize("read_only", [True, False])
def test_a_session_that_cannot_be_shown_is_not_open_and_says_why(client, root, read_only):
    wrong = {"verdict": {"result": {"level": "purple", "checks": []}}}
    written(root / "foreign", events(**wrong))
    refused = client.post("/api/sessions/foreign/open", json={"read_only": read_only})
    assert (refused.status_code, refused.json()["error"]["key"]) == (422, "damaged")
    assert "event 4, verdict: level" in refused.json()["error"]["text"]
    state = client.get("/api/state")
    assert (state.status_code, state.json()["session"]) == (200, None)
    with pytest.raises(SessionDamaged), open_session(root / "foreign"):
        pass  # nobody has it
    assert client.post("/api/sessions/missale/open").status_code == 200


def test_a_session_that_is_damaged_while_it_is_looked_at_is_let_go(client, root):
    assert client.post("/api/sessions/missale/open", json={"read_only": True}).status_code == 200
    (root / "missale" / "events.jsonl").chmod(0o600)
    (root / "missale" / "events.jsonl").write_bytes(b"damaged\n")
    state = client.get("/api/state").json()
    assert state["session"] is None
    assert "damaged" in state["failed"]["text"]


@pytest.mark.parametrize("read_only", [True, False])
def test_a_session_without_its_log_is_damaged_and_not_the_disks_fault(client, root, read_only):
    (root / "missale" / "events.jsonl").unlink()
    (root / "missale" / "events.jsonl").symlink_to("events.jsonl")
    refused = client.post("/api/sessions/missale/open", json={"read_only": read_only})
    assert (refused.status_code, refused.json()["error"]["key"]) == (422, "damaged")


def test_a_session_that_the_index_refuses_is_not_left_open(root):
    def refuse(_session):
        raise BadInput("the index cannot be used")

    scanner, restorer = GatedScanner(curl_scan()), StandInRestorer()
    with serving(root, scanner, restorer, enter=refuse) as served, served.client() as browser:
        assert browser.post("/api/sessions/missale/open").status_code == 422
        with open_session(root / "missale"):
            pass
