"""Every scan is restored once or set aside once, however it arrives; nothing in the watched folder is touched."""

from __future__ import annotations

import errno
import os
import shutil

import pytest

from restore import NotEnoughSurface
from restore.runtime import LibraryMissing
from station.errors import FolderInUse, UsageError
from station.intake import arrival as arrival_module
from station.intake import loop
from station.intake.records import NOTE
from station.session import Volume, create_session
from station.storage.atomic import lock_output_folder

OBJ = b"mtllib page.mtl\no page\nEND\n"
MTL = b"newmtl page\nmap_Kd -s 1 1 1 -clamp on page.bmp\n"


def kinds(station) -> list[str]:
    return [event for event, _, _ in station.events]


def test_what_is_there_is_restored_once_and_left_where_it_is(station) -> None:
    for name in ("page.glb", "sub/leaf.glb", "notes.txt", ".hidden.glb", "half.obj.part"):
        station.put(name)
    before = station.originals()
    station.run()
    assert sorted(station.results()) == ["page/page.png", "sub/leaf/leaf.png"]
    assert station.originals() == before
    station.run()  # another start
    assert len(station.library.calls) == 2
    assert kinds(station) == ["restored"] * 2
    assert sorted(path.name for path in station.out.iterdir()) == ["page", "sub"]  # nothing else is left


def test_a_file_that_grows_is_waited_for(station) -> None:
    watch = station.watch()
    path = station.put("page.glb", b"o")
    for _ in range(20):
        station.pass_time(watch, 1.0)
        with path.open("ab") as file:
            file.write(b" more")
    assert station.library.calls == []
    with path.open("ab") as file:
        file.write(b"\nEND\n")
    station.pass_time(watch, 10.0)
    assert list(station.results()) == ["page/page.png"]
    assert len(station.library.calls) == 1


def test_a_file_that_is_open_for_writing_is_waited_for_however_long_its_writer_pauses(station) -> None:
    watch = station.watch()
    with (station.folder / "page.glb").open("wb") as file:
        file.write(b"half of ")
        file.flush()
        station.pass_time(watch, 100.0)
        assert station.library.calls == []
        file.write(b"it\nEND\n")
    station.pass_time(watch, 10.0)
    assert list(station.results().values()) == [b"half of it\nEND\n"]


def test_arrival_by_rename_and_by_copy(station, tmp_path) -> None:
    watch = station.watch()
    other = tmp_path / "elsewhere.glb"
    other.write_bytes(b"END\n")
    station.pass_time(watch, 5.0)
    shutil.copy2(other, station.folder / "copied.glb")  # with an old modification time
    other.rename(station.folder / "renamed.glb")
    station.pass_time(watch, 10.0)
    assert sorted(station.results()) == ["copied/copied.png", "renamed/renamed.png"]


def test_half_a_file_is_set_aside_once_and_restored_when_the_rest_comes(station) -> None:
    watch = station.watch()
    path = station.put("sub/page.glb", b"half")
    station.pass_time(watch, 30.0)
    note = f"failed/sub/page.glb{NOTE}"
    assert list(station.notes()) == [note]
    assert f"{path} is cut short" in station.notes()[note]  # the original's name, not the copy's
    assert "export it again" in station.notes()[note]
    station.run()  # another start
    assert len(station.library.calls) == 1
    assert path.read_bytes() == b"half"
    path.write_bytes(b"all\nEND\n")
    station.run()
    assert list(station.results()) == ["sub/page/page.png"]
    assert station.notes() == {}
    assert kinds(station) == ["set aside", "restored"]


def test_the_same_file_twice_is_restored_once_another_under_its_name_again(station) -> None:
    watch = station.watch()
    path = station.put("page.glb")
    station.pass_time(watch, 10.0)
    path.unlink()
    station.pass_time(watch, 5.0)
    station.put("page.glb")
    os.utime(path, (1, 1))
    station.pass_time(watch, 10.0)
    station.run()
    assert len(station.library.calls) == 1
    station.put("page.glb", b"another page\nEND\n")
    station.pass_time(watch, 10.0)
    assert station.results() == {"page/page.png": b"o page\nEND\n", "page-2/page.png": b"another page\nEND\n"}


def test_two_formats_of_one_name_and_files_of_others_in_the_results(station) -> None:
    foreign = station.out / "page/page.png"
    foreign.parent.mkdir(parents=True)
    foreign.write_bytes(b"mine")
    station.put("page.glb", b"1 END\n")
    station.put("page.stl", b"2 END\n")
    station.run()
    assert station.results() == {
        "page/page.png": b"mine",
        "page-2/page.png": b"1 END\n",
        "page-3/page.png": b"2 END\n",
    }
    station.run()
    assert len(station.library.calls) == 2


@pytest.mark.parametrize("order", [("page.obj", "page.mtl", "Page.BMP"), ("Page.BMP", "page.mtl", "page.obj")])
def test_a_scan_waits_for_the_files_that_it_names(station, order) -> None:
    watch = station.watch()
    content = {"page.obj": OBJ, "page.mtl": MTL, "Page.BMP": b"picture"}
    for name in order:
        assert station.library.calls == []
        station.put(name, content[name])
        station.pass_time(watch, 5.0)
    (call,) = station.library.calls
    assert call[3] == ("page.bmp", "page.mtl", "page.obj")  # under the name that the scan knows


@pytest.mark.parametrize("name", ["page.wrl", "page.vvd", "page.abs.gz", "PAGE.OBJ", "page.ply"])
def test_a_scan_without_colours_waits_for_the_picture_of_its_name(station, name) -> None:
    watch = station.watch()
    station.put(name)
    station.pass_time(watch, 8.0)
    assert station.library.calls == []
    station.put("page.JPG", b"picture")
    station.put("other.png", b"picture")
    station.pass_time(watch, 5.0)
    (call,) = station.library.calls
    assert set(call[3]) == {name, "PAGE.jpg" if name.isupper() else "page.jpg"}


def test_a_picture_that_never_comes_is_not_waited_for_for_ever(station) -> None:
    watch = station.watch()
    station.put("page.wrl")
    station.pass_time(watch, 15.0)
    assert list(station.results()) == ["page/page.png"]
    station.put("page.png", b"picture")  # late: with it the scan is another
    station.pass_time(watch, 10.0)
    assert sorted(station.results()) == ["page-2/page.png", "page/page.png"]


def test_coloured_vertices_need_no_picture(station) -> None:
    watch = station.watch()
    station.put("page.ply", b"ply\nproperty uchar red\nend_header\nEND\n")
    station.pass_time(watch, 6.0)
    assert len(station.library.calls) == 1


def test_a_picture_that_grows_delays_its_scan(station) -> None:
    watch = station.watch()
    station.put("page.vvd")
    picture = station.put("page.png", b"p")
    for _ in range(10):
        station.pass_time(watch, 1.0)
        with picture.open("ab") as file:
            file.write(b"x")
    assert station.library.calls == []


def test_names_outside_the_scans_folder_are_not_followed(station, tmp_path) -> None:
    (tmp_path / "secret.mtl").write_bytes(b"map_Kd page.png")
    station.put("page.obj", b"mtllib ../secret.mtl\nmtllib /etc/passwd\nEND\n")
    station.run()
    assert station.library.calls[0][3] == ("page.obj",)


def test_a_file_that_changes_while_it_is_copied_is_taken_later(station, monkeypatch) -> None:
    path = station.put("page.glb", b"old END\n")
    watch = station.watch()
    station.pass_time(watch, 2.0)
    monkeypatch.setattr(loop, "has_writer", lambda _path: path.write_bytes(b"newer END\n") and False)
    station.pass_time(watch, 2.0)
    monkeypatch.undo()
    assert station.library.calls == []
    station.pass_time(watch, 10.0)
    assert list(station.results().values()) == [b"newer END\n"]


@pytest.mark.parametrize("fault", [NotEnoughSurface("too small", "scan more"), ValueError("a bug"), MemoryError()])
def test_any_fault_of_a_scan_sets_it_aside_and_the_watch_goes_on(station, fault) -> None:
    station.library.fault = fault
    station.put("page.glb")
    watch = station.watch()
    station.pass_time(watch, 10.0)
    station.library.fault = None
    station.put("next.glb")
    station.pass_time(watch, 10.0)
    assert kinds(station) == ["set aside", "restored"]


@pytest.mark.parametrize("fault", [OSError(errno.ENOSPC, "No space left on device"), LibraryMissing("libGL", "apt")])
def test_a_fault_of_the_computer_ends_the_watch_and_the_scan_is_restored_later(station, fault) -> None:
    station.library.fault = fault
    station.put("page.glb")
    with pytest.raises(type(fault)):
        station.run()
    assert station.notes() == {}
    station.library.fault = None
    station.run()
    assert list(station.results()) == ["page/page.png"]


def test_ctrl_c_leaves_nothing_half_done(station) -> None:
    station.put("page.glb")
    for _ in range(3):
        station.library.fault = KeyboardInterrupt()
        with pytest.raises(KeyboardInterrupt):
            station.run()
        assert not station.out.exists() or list(station.out.rglob("*")) == []
    station.library.fault = None
    station.run()
    assert kinds(station) == ["restored"]


def test_a_scan_that_ends_the_program_is_set_aside_at_the_third_start(station, monkeypatch) -> None:
    """As a crash of a native library or a power cut: no line of ours runs after it."""
    station.put("page.glb")
    for _ in range(2):
        with monkeypatch.context() as crash:
            crash.setattr(loop.records, "end_attempt", lambda out, arrival: None)
            station.library.fault = KeyboardInterrupt()
            with pytest.raises(KeyboardInterrupt):
                station.run()
    station.library.fault = None
    station.run()
    assert kinds(station) == ["set aside"]
    assert "2 times" in next(iter(station.notes().values()))
    assert len(station.notes()) == 1


def test_a_file_that_may_not_be_read_is_set_aside_once(station, monkeypatch) -> None:
    station.put("page.glb")

    def refuse(self, to):
        raise PermissionError(errno.EACCES, "Permission denied", "page.glb")

    monkeypatch.setattr(loop.Arrival, "copy", refuse)
    station.run()
    station.run()
    assert kinds(station) == ["set aside"]
    assert "Permission denied" in next(iter(station.notes().values()))


def test_a_network_drive_that_is_gone_for_a_while_is_waited_for(station, monkeypatch) -> None:
    station.put("page.glb")
    watch = station.watch()

    def gone(*_arguments, **_options):
        raise OSError(errno.EHOSTDOWN, "Host is down")

    with monkeypatch.context() as patch:
        patch.setattr(loop, "list_files", gone)
        station.pass_time(watch, 5.0)
    with monkeypatch.context() as patch:
        patch.setattr(loop.Arrival, "copy", gone)
        station.pass_time(watch, 10.0)
    station.pass_time(watch, 10.0)
    assert kinds(station) == ["waiting", "waiting", "restored"]  # told once each


def test_a_file_that_vanishes_is_not_a_fault(station) -> None:
    watch = station.watch()
    path = station.put("page.glb")
    station.pass_time(watch, 2.0)
    path.unlink()
    station.pass_time(watch, 10.0)
    assert station.events == []


def test_results_below_the_watched_folder_are_not_scans(station) -> None:
    station.out = station.folder / "results"
    station.put("page.glb")
    station.put("results/page-flat.obj")
    station.run()
    assert [call[0] for call in station.library.calls] == ["page.glb"]


def test_folders_that_cannot_be(station, tmp_path) -> None:
    station.out = station.folder
    with pytest.raises(UsageError, match="would be scans"):
        station.run()
    station.out = tmp_path
    with pytest.raises(UsageError, match="would be scans"):
        station.run()
    station.folder, station.out = tmp_path / "nothing", tmp_path / "out"
    with pytest.raises(UsageError, match="not a folder"):
        station.run()


def test_one_watch_for_the_results(station) -> None:
    with lock_output_folder(station.out), pytest.raises(FolderInUse):
        station.run()


def test_a_session_in_the_folder_is_named_once_and_left_alone(station) -> None:
    create_session(station.folder / "book", Volume(title="A book"))
    station.put("book/data/0001-000002-capture/original/page.glb")
    watch = station.watch()
    station.pass_time(watch, 20.0)
    ((event, path, text),) = station.events
    assert (event, path) == ("left out", "book")
    assert f"planish batch {station.folder / 'book'} -o OUT" in text
    assert station.library.calls == []


def test_a_session_is_not_a_folder_to_watch(station) -> None:
    create_session(station.folder / "book", Volume(title="A book"))
    station.folder = station.folder / "book/data"
    with pytest.raises(UsageError, match="not a folder of scans"):
        station.run()


@pytest.mark.parametrize("bytes_", [180, 244, 250, 255])
def test_a_long_name_is_restored_or_set_aside_as_any_other(station, bytes_) -> None:
    station.put("ä" * ((bytes_ - 4) // 2) + "a" * (bytes_ % 2) + ".glb")
    station.put("b" * (bytes_ - 4) + ".glb", b"cut")
    station.put("page.glb")
    station.run()
    assert sorted(kinds(station)) == ["restored", "restored", "set aside"]
    assert len(station.results()) == 2
    assert len(station.notes()) == 1
    station.run()  # known again by the same names
    assert len(kinds(station)) == 3


@pytest.mark.parametrize("first", ["x.glb", "x/x.png/y.glb"])
def test_results_that_would_collide_get_folders_of_their_own(station, first) -> None:
    """The page of x is `x/x.png`, where the results of the folder `x/x.png` would lie."""
    station.put(first)
    station.run()
    for name in ("x.glb", "x/x.png/y.glb", "a.glb"):
        station.put(name)
    station.run()
    station.run()
    assert kinds(station) == ["restored"] * 3
    assert len(station.results()) == 3


def test_a_note_and_a_folder_of_its_name(station) -> None:
    station.put("x.glb", b"cut")
    station.put("x.glb.txt/y.glb", b"cut")
    station.run()
    station.run()
    assert kinds(station) == ["set aside"] * 2
    assert len(station.notes()) == 2


@pytest.mark.parametrize(
    "fault", [RecursionError(), ValueError("embedded null byte"), OSError(errno.ENAMETOOLONG, "x")]
)
def test_whatever_looking_at_a_scan_raises_the_others_are_restored(station, monkeypatch, fault) -> None:
    companions = loop.Pairing.companions

    def refuse(self, source):
        if source.name == "bad.glb":
            raise fault
        return companions(self, source)

    monkeypatch.setattr(loop.Pairing, "companions", refuse)
    for name in ("bad.glb", "page.glb"):
        station.put(name)
    station.run()
    assert sorted(kinds(station)) == ["restored", "set aside"]


def test_an_original_that_cannot_be_read_to_its_end_is_set_aside(station, monkeypatch) -> None:
    def refuse(self, to):
        raise arrival_module.Unreadable(errno.ENODATA, "No data available", "page.glb")

    for name in ("bad.glb", "page.glb"):
        station.put(name)
    copy = loop.Arrival.copy
    monkeypatch.setattr(loop.Arrival, "copy", lambda self, to: (refuse if "bad" in self.stem else copy)(self, to))
    station.run()
    assert sorted(kinds(station)) == ["restored", "set aside"]
