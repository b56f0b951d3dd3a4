"""The index holds what the folders say, whoever wrote it."""

from __future__ import annotations

import errno
import os
import shutil
import sqlite3
from contextlib import closing

import pytest

from restore import BadInput
from station.session import Volume, add_scan, create_session, open_session, read_session
from station.session.leaves.index import INDEX, IndexUnusable, default_index, find, pages, reindex, sessions, update
from station.session.log.steps import decide, record_run


def test_rebuilt_it_is_equal_to_the_one_that_grew(volume, tiny_scan, tmp_path):
    index, other = tmp_path / "index" / "grown", tmp_path / "rebuilt"
    create_session(tmp_path / "second", Volume(title="Another"))
    update(index, read_session(tmp_path / "second"))
    with open_session(volume) as writer:
        for number in (1, 2, 3):
            capture = add_scan(writer, tiny_scan, facts={})
            run = record_run(writer, "restore", capture, parameters={}, result={})
            record_run(writer, "verdict", run, parameters={}, result={"level": "amber", "checks": []})
            decide(writer, "accept", number == 1, page=number, on=capture)
            update(index, writer.session)
        decide(writer, "position", 0.5, page=3)
        update(index, writer.session)
    assert reindex(other, [tmp_path]) == []
    assert (sessions(index), pages(index)) == (sessions(other), pages(other))
    reported = [(one.page, one.state, one.level) for one in pages(index)]
    assert reported == [(3, "again", "amber"), (1, "accepted", "amber"), (2, "again", "amber")]
    assert reindex(index, []) == []
    assert (sessions(index), pages(index)) == (sessions(other), pages(other))


def test_its_modes(volume, tmp_path):
    index = tmp_path / "index"
    update(index, read_session(volume))
    with sqlite3.connect(index) as database:
        assert database.execute("pragma journal_mode").fetchone() == ("wal",)
    database.close()


def test_a_session_is_found_by_folder_identifier_or_title(volume, tmp_path):
    index = tmp_path / "index"
    update(index, read_session(volume))
    assert find(index, str(volume)) == find(index, "an-id") == find(index, "A volume") == volume
    create_session(tmp_path / "second", Volume(title="A volume"))
    update(index, read_session(tmp_path / "second"))
    with pytest.raises(BadInput, match="2 sessions"):
        find(index, "A volume")


def test_a_damaged_index_is_reported_and_rebuilt(volume, tmp_path):
    index = tmp_path / INDEX
    index.write_bytes(b"no database at all" * 100)
    with pytest.raises(IndexUnusable, match="cannot be used"):
        update(index, read_session(volume))
    reindex(index, [tmp_path])
    assert [one.id for one in sessions(index)] == ["an-id"]


def test_a_file_that_is_not_an_index_is_neither_replaced_nor_added_to(volume, tmp_path):
    (tmp_path / "scan.ply").write_bytes(b"ply\n")
    with closing(sqlite3.connect(tmp_path / "other.sqlite")) as database:
        database.execute("create table photographs (name text)")
    for name in ("scan.ply", "other.sqlite"):
        before = (tmp_path / name).read_bytes()
        for use in (sessions, lambda path: update(path, read_session(volume)), lambda path: reindex(path, [volume])):
            with pytest.raises(BadInput, match="is not an index of sessions"):
                use(tmp_path / name)
        assert (tmp_path / name).read_bytes() == before


def test_an_empty_file_becomes_an_index(volume, tmp_path):
    (tmp_path / "index").touch()
    update(tmp_path / "index", read_session(volume))
    assert [one.id for one in sessions(tmp_path / "index")] == ["an-id"]


def test_a_damaged_session_is_left_out_and_named(volume, tmp_path):
    create_session(tmp_path / "second", Volume(title="Another"))
    (volume / "events.jsonl").write_bytes(b"x\n")
    (problem,) = reindex(tmp_path / "index", [tmp_path])
    assert str(volume) in problem
    assert [one.title for one in sessions(tmp_path / "index")] == ["Another"]
    shutil.rmtree(tmp_path / "second")
    (problem,) = reindex(tmp_path / "index", [])
    assert problem.startswith(f"{tmp_path / 'second'} is gone: ")
    assert sessions(tmp_path / "index") == []


def test_a_folder_that_is_not_there_leaves_the_index_as_it_is(volume, tmp_path):
    index = tmp_path / "index"
    update(index, read_session(volume))
    for absent in (tmp_path / "absent", index):
        with pytest.raises(BadInput, match=f"the folder {absent} does not exist"):
            reindex(index, [tmp_path, absent])
    assert [one.id for one in sessions(index)] == ["an-id"]


def test_a_rebuild_that_fails_leaves_the_index_as_it_is(volume, tmp_path, monkeypatch):
    index = tmp_path / "place" / "index"
    update(index, read_session(volume))

    def stop(_folder):
        raise KeyboardInterrupt

    monkeypatch.setattr("station.session.leaves.index.read_session", stop)
    with pytest.raises(KeyboardInterrupt):
        reindex(index, [tmp_path])
    assert [one.id for one in sessions(index)] == ["an-id"]
    assert [path.name for path in index.parent.iterdir()] == ["index"]


def test_a_log_of_the_old_index_is_not_replayed_into_the_new_one(volume, tmp_path):
    index = tmp_path / "index"
    update(index, read_session(volume))
    with closing(sqlite3.connect(index)) as held:  # its log stays while it is open
        held.execute("begin")
        held.execute("select * from sessions").fetchall()
        create_session(tmp_path / "second", Volume(title="Another"))
        update(index, read_session(tmp_path / "second"))
        shutil.rmtree(tmp_path / "second")
        assert reindex(index, [tmp_path]) == []
        assert [one.id for one in sessions(index)] == ["an-id"]


def test_a_session_under_a_path_that_is_not_utf8_is_left_out_and_named(volume, tmp_path):
    elsewhere = tmp_path / os.fsdecode(b"M\xfcller")
    create_session(elsewhere, Volume(title="Another"))
    with pytest.raises(BadInput, match="is not UTF-8"):
        update(tmp_path / "index", read_session(elsewhere))
    (problem,) = reindex(tmp_path / "index", [tmp_path])
    assert "M\\udcfcller' is not UTF-8" in problem
    assert [one.id for one in sessions(tmp_path / "index")] == ["an-id"]


def test_a_session_that_cannot_be_read_is_left_out_and_named(volume, tmp_path, monkeypatch):
    def refuse(folder):
        raise PermissionError(errno.EACCES, "Permission denied", str(folder / "events.jsonl"))

    monkeypatch.setattr("station.session.leaves.index.read_session", refuse)
    assert reindex(tmp_path / "index", [tmp_path]) == [f"{volume} cannot be read: Permission denied"]


def test_a_session_that_was_renamed_is_found_next_to_its_old_place(volume, tmp_path):
    index = tmp_path / "index"
    update(index, read_session(volume))
    volume.rename(tmp_path / "new name")
    for name in ("A volume", "an-id", str(volume)):
        with pytest.raises(BadInput, match="'A volume' is no longer in") as caught:
            find(index, name)
        assert f"planish session recover '{tmp_path / 'new name'}'" in caught.value.hint


def test_a_session_that_is_elsewhere_is_not_mistaken_for_the_one_in_its_place(volume, tmp_path):
    index = tmp_path / "index"
    update(index, read_session(volume))
    shutil.rmtree(volume)
    create_session(volume, Volume(title="Another"))
    with pytest.raises(BadInput, match="no longer in") as caught:
        find(index, "A volume")
    assert "planish reindex FOLDER" in caught.value.hint
    shutil.rmtree(tmp_path / "volume")
    assert reindex(index, []) == [f"{volume} is gone: where it was moved, planish reindex FOLDER enters it"]


def test_a_damaged_session_is_found_by_its_title(volume, tmp_path):
    update(tmp_path / "index", read_session(volume))
    (record,) = volume.glob("data/*/event.json")
    record.unlink()
    assert find(tmp_path / "index", "A volume") == volume


def test_the_place_of_the_index(tmp_path):
    assert default_index({"XDG_DATA_HOME": "/x", "HOME": "/h"}).as_posix() == "/x/planish/sessions.sqlite"
    assert default_index({"HOME": "/h"}).as_posix() == "/h/.local/share/planish/sessions.sqlite"
