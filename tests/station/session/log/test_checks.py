"""Sessions by others: they are read with facts that can be shown, or refused with a reason."""

from __future__ import annotations

import base64
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from restore import BadInput
from station.session import Event, SessionDamaged, Volume, open_session, read_session
from station.session.log import bag
from station.session.log import reading as reading_module
from station.session.log.events import RECORD
from station.verdict.packed import PACKED_BYTES, pack, unpack

TIME = "2026-01-02T03:04:05.000Z"
PRINT = pack(bytes(PACKED_BYTES))
CHECK = {"name": "blur_px", "level": "green", "value": 1.0, "limits": [1.5, 2.5], "text": "focus", "hint": "none"}


def written(folder: Path, events: list[Event]) -> Path:
    """A session of these events whose files agree with each other, as a program of somebody else writes it."""
    for event in events:
        (folder / bag.PAYLOAD / event.folder).mkdir(parents=True)
        (folder / bag.PAYLOAD / event.folder / RECORD).write_bytes(event.line)
    for name, data in bag.tag_files(events).items():
        (folder / name).write_bytes(data)
    return folder


def events(**changed: Any) -> list[Event]:
    """A page that is scanned, restored, judged and labelled. changed: name of an event → its facts."""
    facts: dict[str, Any] = {
        "session": {"id": "an-id", "volume": Volume(title="A volume").model_dump(mode="json")},
        "capture": {"scan": "original/scan"},
        "restore": {"result": {"page_mm": [120.0, 80], "dpi": 150.0, "measures": {"fingerprint": PRINT, "blur_px": 1}}},
        "verdict": {"result": {"level": "green", "checks": [CHECK]}},
        "label": {"value": "1r"},
    } | changed
    kinds = {"session": "session", "capture": "capture", "restore": "stage", "verdict": "stage"}
    slots = {"restore": "restore@2", "verdict": "verdict@3"}
    return [
        Event(n, int(n > 1), kinds.get(name, "decision"), slots.get(name, name), None, TIME, "a test 1", one)  # type: ignore[arg-type]
        for n, (name, one) in enumerate(facts.items(), 1)
    ]


def test_what_is_written_here_is_read(tmp_path):
    session = read_session(written(tmp_path / "s", events(position={"value": 3.5}, accept={"value": False})))
    (page,) = session.history.pages()
    assert (page.decided.label, page.decided.position) == ("1r", 3.5)


BOMB = base64.b64encode(zlib.compress(bytes(2**24), 1)).decode()
WRONG: dict[str, dict[str, Any]] = {
    "no identifier": {"session": {"volume": {}}},
    "no title": {"session": {"id": "x", "volume": {}}},
    "a preset that is none": {
        "session": {"id": "x", "volume": {"title": "x", "preset_values": {"settings": {"dpi": "x"}}}}
    },
    "a source elsewhere": {"capture": {"scan": "../../../etc"}},
    "an absolute source": {"capture": {"scan": "/etc/passwd"}},
    "no source": {"capture": {}},
    "a level that is none": {"verdict": {"result": {"level": "purple", "checks": []}}},
    "a level that is a list": {"verdict": {"result": {"level": [], "checks": []}}},
    "no findings": {"verdict": {"result": {"level": "red"}}},
    "one limit": {"verdict": {"result": {"level": "red", "checks": [CHECK | {"limits": [1.0]}]}}},
    "a value that is text": {"verdict": {"result": {"level": "red", "checks": [CHECK | {"value": "x"}]}}},
    "no result": {"restore": {}},
    "parameters that are a list": {"restore": {"result": {}, "parameters": [1]}},
    "a result that is a list": {"restore": {"result": [1]}},
    "a size without height": {"restore": {"result": {"page_mm": [120.0]}}},
    "no pixels to an inch": {"restore": {"result": {"dpi": 0.0}}},
    "measures without a print": {"restore": {"result": {"measures": {}}}},
    "a measure that is text": {"restore": {"result": {"measures": {"fingerprint": PRINT, "blur_px": "x"}}}},
    "a print that is none": {"restore": {"result": {"measures": {"fingerprint": "####"}}}},
    "a print that fills the memory": {"restore": {"result": {"measures": {"fingerprint": BOMB}}}},
    "a label that is none": {"label": {"value": {"a": 1}}},
    "a place beyond every number": {"position": {"value": 10**400}},
    "settings that are none": {"settings": {"value": {"settings": {"dpi": "x"}}}},
}


@pytest.mark.parametrize("changed", WRONG.values(), ids=WRONG.keys())
def test_what_cannot_be_is_refused_with_its_event(tmp_path, changed):
    folder = written(tmp_path / "s", events(**changed))
    with pytest.raises(SessionDamaged, match=r"event \d"):
        read_session(folder)
    with pytest.raises(SessionDamaged, match=r"event \d"), open_session(folder):
        pass


@pytest.mark.parametrize(
    ("number", "changes"),
    [
        (1, {"number": 2}),
        (2, {"kind": "decision"}),
        (3, {"slot": "restore"}),
        (3, {"page": 2}),
        (5, {"kind": "session"}),
        (5, {"slot": "capture"}),
        (5, {"time": "yesterday"}),
        (2, {"files": {"../../event.json": "0" * 128}}),
    ],
)
def test_events_that_do_not_fit_each_other_are_refused(tmp_path, number, changes):
    made = events()
    made[number - 1] = replace(made[number - 1], **changes)
    with pytest.raises(SessionDamaged):
        read_session(written(tmp_path / "s", made))


def test_doubled_lines_of_the_log_are_refused(tmp_path):
    folder = written(tmp_path / "s", events())
    log = folder / bag.LOG
    log.write_bytes(log.read_bytes() + events()[-1].line)
    with pytest.raises(SessionDamaged, match="event 5 follows event 5"):
        read_session(folder)


def test_a_clock_that_leaps_changes_no_order(tmp_path):
    made = events(mark={"value": True}, note={"value": "last"})
    times = ["2026-01-02T03:04:05.000Z", "1970-01-01T00:00:00.000Z", "2091-01-01T00:00:00.000Z"]
    made = [replace(event, time=times[event.number % 3]) for event in made]
    session = read_session(written(tmp_path / "s", made))
    assert [event.name for event in session.history.events][-2:] == ["mark", "note"]
    assert next(session.history.pages()).decided.note == "last"


def test_more_events_than_a_session_has_are_refused_before_they_are_read(tmp_path, monkeypatch):
    folder = written(tmp_path / "s", events())
    monkeypatch.setattr(reading_module, "MAX_EVENTS", 4)
    with pytest.raises(SessionDamaged, match="5 events"):
        read_session(folder)
    monkeypatch.setattr(reading_module, "MAX_TAG_FILE_BYTES", 100)
    with pytest.raises(SessionDamaged, match="larger than 100 bytes"):
        read_session(folder)


def test_a_folder_that_was_replaced_is_not_written_to(volume, tmp_path):
    with open_session(volume) as writer:
        volume.rename(tmp_path / "moved")
        written(volume, events())
        before = {path: path.read_bytes() for path in volume.rglob("*") if path.is_file()}
        with pytest.raises(Exception, match="no longer the folder"):
            writer.record("decision", "note", page=1, facts={"value": "lost"})
        assert {path: path.read_bytes() for path in volume.rglob("*") if path.is_file()} == before


def test_a_fingerprint_is_unpacked_to_its_size():
    assert unpack(PRINT) == bytes(PACKED_BYTES)
    for text in (BOMB, "", "ä", pack(bytes(PACKED_BYTES - 1)), PRINT[:-8]):
        with pytest.raises(ValueError, match="fingerprint"):
            unpack(text)


@pytest.mark.parametrize("name", [bag.BAGIT, bag.LOG, bag.MANIFEST, bag.TAG_MANIFEST])
@pytest.mark.parametrize("put", ["a folder", "a link to itself", "a link to a folder"])
def test_what_is_not_a_file_is_damage_and_not_the_disks_fault(tmp_path, name, put):
    folder = written(tmp_path / "s", events())
    (folder / name).unlink()
    if put == "a folder":
        (folder / name).mkdir()
    else:
        (folder / name).symlink_to(name if put == "a link to itself" else folder / "data")
    with pytest.raises((SessionDamaged, BadInput)), open_session(folder):
        pass


def test_a_last_event_without_its_files_is_damage(tmp_path):
    made = events()
    folder = written(tmp_path / "s", made)
    (folder / bag.TAG_MANIFEST).write_bytes(bag.tag_files(made[:-1])[bag.TAG_MANIFEST])
    record = folder / bag.PAYLOAD / made[-1].folder / RECORD
    record.unlink()
    record.mkdir()
    with pytest.raises(SessionDamaged), open_session(folder):
        pass
