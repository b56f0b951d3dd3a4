"""All files of a run or none."""

from __future__ import annotations

import stat

import pytest

from station.errors import OverwriteError
from station.export import atomic
from station.export.atomic import new_folder, writable, write_all


def listing(folder):
    return sorted(path.name for path in folder.iterdir())


def test_all_are_written(tmp_path):
    paths = write_all([(tmp_path / "a", b"1"), (tmp_path / "b", b"22")])
    assert [path.read_bytes() for path in paths] == [b"1", b"22"]
    assert listing(tmp_path) == ["a", "b"]


def test_files_have_the_rights_that_the_umask_leaves(tmp_path):
    (tmp_path / "ordinary").touch()
    write_all([(tmp_path / "a", b"1")])
    rights = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("a", "ordinary")]
    assert rights[0] == rights[1]


@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt(), ZeroDivisionError()])
def test_none_is_written_when_one_cannot_be_made(tmp_path, error):
    (tmp_path / "a").write_bytes(b"before")

    def files():
        yield tmp_path / "a", b"1"
        yield tmp_path / "b", b"2"
        raise error

    with pytest.raises(type(error)):
        write_all(files(), force=True)
    assert listing(tmp_path) == ["a"]
    assert (tmp_path / "a").read_bytes() == b"before"


def test_a_write_that_stops_halfway_leaves_nothing(tmp_path, monkeypatch):
    def half(file, data):
        file.write(data[: len(data) // 2])
        raise OSError("disk full")

    monkeypatch.setattr(atomic, "_flush_out", half)
    with pytest.raises(OSError, match="disk full"):
        write_all([(tmp_path / "a", b"1234")])
    assert listing(tmp_path) == []


def test_names_that_agree_at_the_beginning_do_not_meet(tmp_path):
    stem = "x" * 200
    write_all([(tmp_path / f"{stem}-flat.obj", b"1"), (tmp_path / f"{stem}-warped.obj", b"2")])
    assert (tmp_path / f"{stem}-flat.obj").read_bytes() == b"1"


def test_a_file_that_appears_in_the_meantime_is_kept(tmp_path):
    def files():
        yield tmp_path / "a", b"1"
        (tmp_path / "a").write_bytes(b"somebody else's")

    with pytest.raises(OverwriteError):
        write_all(files())
    assert (tmp_path / "a").read_bytes() == b"somebody else's"
    assert listing(tmp_path) == ["a"]


def test_a_folder_appears_complete_or_not_at_all(tmp_path):
    with new_folder(tmp_path / "scan") as part:
        part.mkdir()
        (part / "a").write_bytes(b"1")
        assert not (tmp_path / "scan").exists()
    assert (tmp_path / "scan" / "a").read_bytes() == b"1"
    with pytest.raises(ZeroDivisionError), new_folder(tmp_path / "other") as part:
        part.mkdir()
        raise ZeroDivisionError
    assert listing(tmp_path) == ["scan"]


def test_a_folder_is_replaced_with_force_only(tmp_path):
    def fill(content, **options):
        with new_folder(tmp_path / "scan", **options) as part:
            part.mkdir()
            (part / content).touch()

    fill("first")
    with pytest.raises(OverwriteError):
        fill("second")
    assert listing(tmp_path / "scan") == ["first"]
    fill("second", force=True)
    assert listing(tmp_path / "scan") == ["second"]
    assert listing(tmp_path) == ["scan"]


def test_a_folder_that_cannot_take_its_place_leaves_the_old_one(tmp_path):
    (tmp_path / "scan").mkdir()
    (tmp_path / "scan" / "old").touch()
    with pytest.raises(OSError), new_folder(tmp_path / "scan", force=True):
        pass  # nothing was filled: there is no folder to put in place
    assert listing(tmp_path / "scan") == ["old"]
    assert listing(tmp_path) == ["scan"]


def test_a_folder_is_tried_before_the_work(tmp_path, monkeypatch):
    with writable(tmp_path / "deep" / "out"):
        assert listing(tmp_path / "deep" / "out") == []

    def full(file, data):
        raise OSError("disk full")

    monkeypatch.setattr(atomic, "_flush_out", full)
    with pytest.raises(OSError, match="disk full"), writable(tmp_path / "deep" / "other"):
        pass
    assert listing(tmp_path / "deep") == ["out"]


def test_a_folder_made_for_work_that_fails_does_not_stay_behind_empty(tmp_path):
    with pytest.raises(RuntimeError), writable(tmp_path / "deep" / "out"):
        raise RuntimeError
    assert listing(tmp_path) == []
    with pytest.raises(RuntimeError), writable(tmp_path / "deep" / "out"):
        (tmp_path / "deep" / "out" / "scan").touch()
        raise RuntimeError
    assert listing(tmp_path / "deep" / "out") == ["scan"]
