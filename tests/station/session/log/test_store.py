"""Sessions on the disk: growing bags, one writer, interruptions."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path

import bagit
import numpy as np
import pytest

from restore import BadInput, load_scan
from station.errors import FolderInUse, OverwriteError, StationError, explain
from station.session import (
    SessionBroken,
    SessionDamaged,
    Volume,
    add_files,
    add_scan,
    create_session,
    open_session,
    read_session,
    redo,
    scan_path,
    undo,
)
from station.session.log import bag, store
from station.session.log.steps import decide, record_run
from station.storage.folder_lock import WORK

EVERY = 61  # bytes between two states that are tried: a record and its manifest line have some hundreds


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def filled(folder: Path, scan) -> None:
    """A scan with a run, in a session."""
    with open_session(folder) as writer:
        capture = add_scan(writer, scan, facts={"by": "a test"})
        made = writer.staging("run")
        made.mkdir()
        (made / "page.txt").write_bytes(b"a page")
        record_run(writer, "restore", capture, parameters={"dpi": 150}, result={"size": 1}, files=made)


def test_a_session_is_a_valid_bag_after_every_event(volume, tiny_scan):
    bagit.Bag(str(volume)).validate()
    with open_session(volume) as writer:
        capture = add_scan(writer, tiny_scan, facts={})
        bagit.Bag(str(volume)).validate()
        decide(writer, "accept", True, page=1, on=capture)
        bagit.Bag(str(volume)).validate()
        undo(writer)
        bagit.Bag(str(volume)).validate()
    assert not (volume / WORK).exists()
    info = bagit.Bag(str(volume)).info
    assert (info["External-Identifier"], info["External-Description"]) == ("an-id", "A volume")


def test_a_session_is_read_as_it_was_written(volume, tiny_scan):
    filled(volume, tiny_scan)
    session = read_session(volume)
    assert (session.identifier, session.volume.title, session.volume.project) == ("an-id", "A volume", "tests")
    (page,) = session.history.pages()
    assert page.capture.facts == {"scan": "original/scan", "by": "a test"}
    loaded = load_scan(scan_path(session, page.capture))
    assert np.array_equal(loaded.points, tiny_scan.points)
    run = page.runs["restore"]
    assert session.path(run, "page.txt").read_bytes() == b"a page"
    assert [(one.event, one.sha512) for one in run.inputs] == [(page.capture.number, page.capture.sha512)]


def test_nothing_in_a_session_may_be_written(volume, tiny_scan):
    filled(volume, tiny_scan)
    files = [path for path in (volume / bag.PAYLOAD).rglob("*") if path.is_file()]
    assert len(files) == 7
    assert {path.stat().st_mode & 0o777 for path in files} == {0o444}


def test_a_session_moved_elsewhere_opens_there(volume, tiny_scan, tmp_path):
    filled(volume, tiny_scan)
    moved = tmp_path / "another disk" / "renamed"
    shutil.copytree(volume, moved)
    shutil.rmtree(volume)
    with open_session(moved) as writer:
        decide(writer, "note", "moved", page=1)
    assert read_session(moved).history.page(1).decided.note == "moved"
    bagit.Bag(str(moved)).validate()


def test_the_steps_of_undo_and_redo(volume, tiny_scan):
    with open_session(volume) as writer:
        assert undo(writer) is None
        first = add_scan(writer, tiny_scan, facts={})
        second = add_scan(writer, tiny_scan, page=1, facts={})
        assert undo(writer) == second
        assert writer.history.page(1).capture == first
        assert redo(writer) == second
        assert redo(writer) is None
        undo(writer), undo(writer)
        assert list(writer.history.pages()) == []
        again = add_scan(writer, tiny_scan, facts={})
        assert (again.page, again.parent) == (1, None)


def test_files_of_others_are_stored_unchanged(volume, tmp_path):
    (tmp_path / "a b.obj").write_bytes(b"mtllib m.mtl\r\n")
    (tmp_path / "m.mtl").write_bytes(b"\xff\x00")
    files = {"a b.obj": tmp_path / "a b.obj", "sub/m.mtl": tmp_path / "m.mtl"}
    with open_session(volume) as writer:
        event = add_files(writer, files, "a b.obj", facts={"from": "elsewhere"})
        assert scan_path(writer.session, event).read_bytes() == b"mtllib m.mtl\r\n"
        assert writer.session.path(event, "original/sub/m.mtl").read_bytes() == b"\xff\x00"
        with pytest.raises(BadInput, match="per cent"):
            add_files(writer, {"50%0A.obj": tmp_path / "m.mtl"}, "50%0A.obj", facts={})
        decide(writer, "note", "goes on", page=1)
    bagit.Bag(str(volume)).validate()


def test_a_second_writer_is_refused_by_the_name_of_the_first(volume):
    with open_session(volume), pytest.raises(FolderInUse, match=f"process {os.getpid()}"), open_session(volume):
        pass


def test_a_session_is_never_created_over_anything(volume):
    before = contents(volume)
    with pytest.raises(OverwriteError):
        create_session(volume, Volume(title="another"))
    assert contents(volume) == before


def test_a_folder_that_is_not_a_session(tmp_path):
    with pytest.raises(BadInput, match="is not a session"):
        read_session(tmp_path)
    with pytest.raises(BadInput, match="is not a session"), open_session(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []


def interrupted_states(before: dict[str, bytes], after: dict[str, bytes]) -> list[dict[str, bytes]]:
    """Every state between a session and the same with one more event, as a kill or a power cut leaves it."""
    new = {name: data for name, data in after.items() if name not in before}
    states, state = [], {**before, **new}
    for name in (bag.LOG, bag.MANIFEST):
        old, whole = before[name], after[name]
        for size in (*range(len(old), len(whole), EVERY), len(whole) - 1):
            states.append({**state, name: whole[:size]})
            states.append({**state, name: whole[:size] + b"\0" * (len(whole) - size)})
        state = {**state, name: whole}
    return [*states, state]


def test_an_interrupted_event_is_completed_at_any_byte(volume, tiny_scan, tmp_path):
    filled(volume, tiny_scan)
    before = contents(volume)
    with open_session(volume) as writer:
        decide(writer, "note", "x", page=1)
    after, target = contents(volume), tmp_path / "interrupted"
    states = interrupted_states(before, after)
    for state in states:
        shutil.rmtree(target, ignore_errors=True)
        for name, data in state.items():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            (target / name).write_bytes(data)
        assert read_session(target).history.page(1).decided.note == "x"
        assert contents(target) == state  # reading changes nothing
        with open_session(target):
            pass
        assert contents(target) == after
    assert len(states) > 15


@pytest.mark.parametrize("name", [bag.BAG_INFO, bag.LOG, bag.MANIFEST, bag.TAG_MANIFEST])
@pytest.mark.parametrize("change", ["flip", "cut", "grow", "delete"])
def test_damage_is_not_mistaken_for_an_interruption(volume, tiny_scan, name, change):
    filled(volume, tiny_scan)
    path = volume / name
    data = path.read_bytes()
    changed = {"flip": bytes([data[0] ^ 1]) + data[1:], "cut": data[: len(data) // 3], "grow": data + b"x"}
    path.unlink() if change == "delete" else path.write_bytes(changed[change])
    before = contents(volume)
    with pytest.raises(SessionDamaged) as raised, open_session(volume):
        pass
    assert explain(raised.value).exit_code == 6
    assert contents(volume) == before


def test_where_the_disk_refuses_the_session_stays_and_nothing_more_is_written(volume, tiny_scan, monkeypatch):
    filled(volume, tiny_scan)
    before = contents(volume)

    def full(*_arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    with open_session(volume) as writer:
        monkeypatch.setattr(store, "append", full)
        with pytest.raises(OSError, match="No space"):
            decide(writer, "note", "x", page=1)
        monkeypatch.undo()
        with pytest.raises(SessionBroken):
            decide(writer, "note", "y", page=1)
    with open_session(volume) as writer:
        assert writer.history.page(1).decided.note == "x"
    assert contents(volume).items() >= {name: data for name, data in before.items() if name.startswith("data/")}.items()
    bagit.Bag(str(volume)).validate()


def test_a_refusal_before_the_event_is_in_place_leaves_the_session_as_it_was(volume, tiny_scan, monkeypatch):
    before = contents(volume)

    def full(*_arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    with open_session(volume) as writer:
        monkeypatch.setattr(store, "write_file", full)
        with pytest.raises(OSError, match="No space"):
            add_scan(writer, tiny_scan, facts={})
        monkeypatch.undo()
    assert contents(volume) == before
    with open_session(volume) as writer:
        assert add_scan(writer, tiny_scan, facts={}).number == 2


def test_a_log_that_another_program_changed_is_not_extended(volume):
    with open_session(volume) as writer:
        path = volume / bag.LOG
        path.write_bytes(path.read_bytes() + b" ")
        with pytest.raises(StationError, match="where this run left"):
            decide(writer, "note", "x", page=1)
