"""All files of a run or none."""

from __future__ import annotations

import errno
import os
import signal
import stat
import subprocess
import sys
from itertools import count

import pytest

from station.errors import FolderInUse, JournalDamaged, OverwriteError
from station.storage import disk, journal
from station.storage.atomic import lock_output_folder, new_folder, write_all
from station.storage.folder_lock import WORK, lock_folder, recover
from station.storage.journal import JOURNAL

EVENTS = {"os.rename", "os.remove", "os.link", "os.mkdir", "os.rmdir", "open"}
MIN_EVENTS = 20  # of a run that replaces three files: the sweep saw the whole of it
BEFORE = {"page": b"old page", "report": b"old report", "extra": b"old extra"}
AFTER = {"page": b"new page", "report": b"new report", "more": b"new more"}

HOLDER = """
import sys, time
from pathlib import Path
from station.storage.atomic import lock_output_folder
with lock_output_folder(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def listing(folder):
    return sorted(path.name for path in folder.iterdir())


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def write_before(folder):
    for name, data in BEFORE.items():
        (folder / name).write_bytes(data)


def replace_all(folder):
    files = [(folder / name, data) for name, data in AFTER.items()]
    write_all(files, force=True, superseded=[folder / "extra"])


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
    assert contents(tmp_path) == {"a": b"before"}


def test_a_write_that_stops_halfway_leaves_nothing_and_names_the_file(tmp_path, monkeypatch):
    def half(file, data):
        file.write(data[: len(data) // 2])
        raise OSError(errno.ENOSPC, "disk full")

    monkeypatch.setattr(disk, "write_and_sync", half)
    with pytest.raises(OSError, match="disk full") as caught:
        write_all([(tmp_path / "a", b"1234")])
    assert caught.value.filename.endswith("/a")
    assert listing(tmp_path) == []


def test_a_name_as_long_as_the_disk_takes(tmp_path):
    name = "x" * 255
    write_all([(tmp_path / name, b"1")])
    assert listing(tmp_path) == [name]


def test_a_file_that_appears_in_the_meantime_is_kept(tmp_path):
    def files():
        yield tmp_path / "a", b"1"
        (tmp_path / "a").write_bytes(b"somebody else's")

    with pytest.raises(OverwriteError):
        write_all(files())
    assert contents(tmp_path) == {"a": b"somebody else's"}


def test_a_folder_that_bears_the_name_of_a_result_is_refused_before_anything_is_replaced(tmp_path):
    write_before(tmp_path)
    (tmp_path / "more").mkdir()
    with pytest.raises(OverwriteError, match="is a folder"):
        replace_all(tmp_path)
    (tmp_path / "more").rmdir()
    assert contents(tmp_path) == BEFORE


def test_what_an_earlier_run_wrote_and_this_one_does_not_goes_with_it(tmp_path):
    write_before(tmp_path)
    replace_all(tmp_path)
    assert contents(tmp_path) == AFTER


def killed_at(event, folder):
    """Replace all in a child process that dies at the given file event. Returns whether it got that far."""
    child = os.fork()
    if child == 0:
        seen = count(1)

        def die(name, _arguments):
            if name in EVENTS and next(seen) == event:
                os._exit(9)

        sys.addaudithook(die)
        replace_all(folder)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 9


def test_killed_at_any_file_event_the_next_start_finds_the_old_or_the_new_and_nothing_else(tmp_path):
    outcomes = []
    for event in count(1):
        folder = tmp_path / str(event)
        folder.mkdir()
        write_before(folder)
        died = killed_at(event, folder)
        recover(folder)
        assert contents(folder) in (BEFORE, AFTER), f"event {event}"
        outcomes.append(contents(folder) == AFTER)
        if not died:
            break
    assert event > MIN_EVENTS
    assert outcomes[0] is False
    assert outcomes[-1] is True


@pytest.mark.parametrize("number", [errno.EIO, errno.ENOSPC])
def test_a_disk_that_fails_at_any_step_leaves_the_old_or_the_new(tmp_path, monkeypatch, number):
    real = {name: getattr(os, name) for name in ("rename", "replace", "link", "unlink", "fsync")}

    def failing(name, wanted, seen):
        def call(*arguments, **options):
            if next(seen) == wanted:
                raise OSError(number, os.strerror(number))
            return real[name](*arguments, **options)

        return call

    for wanted in count(1):
        folder, seen = tmp_path / str(wanted), count(1)
        folder.mkdir()
        write_before(folder)
        with monkeypatch.context() as patch:
            for name in real:
                patch.setattr(os, name, failing(name, wanted, seen))
            try:
                replace_all(folder)
            except OSError as error:
                assert error.errno == number
        recover(folder)
        assert contents(folder) in (BEFORE, AFTER), f"step {wanted}"
        if next(seen) <= wanted:
            break
    assert wanted > len(AFTER) * 2
    assert contents(folder) == AFTER


def test_where_the_disk_has_no_hard_links_the_old_still_comes_back(tmp_path, monkeypatch):
    write_before(tmp_path)
    renamed = []

    def refuse(*_arguments, **_options):
        raise OSError(errno.EPERM, "Operation not permitted")

    def fail_third(source, target):
        renamed.append(source)
        if len(renamed) == 3:
            raise OSError(errno.EIO, "Input/output error")
        real(source, target)

    real = os.replace
    monkeypatch.setattr(os, "link", refuse)
    monkeypatch.setattr(os, "replace", fail_third)
    with pytest.raises(OSError, match="Input/output"):
        replace_all(tmp_path)
    assert contents(tmp_path) == BEFORE


def test_two_runs_never_write_into_one_folder(tmp_path):
    command = [sys.executable, "-c", HOLDER, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(FolderInUse, match=f"process {holder.pid}"):
            write_all([(tmp_path / "a", b"1")])
        assert recover(tmp_path) is False  # a live run is let be
        holder.send_signal(signal.SIGKILL)
    write_all([(tmp_path / "a", b"1")])
    assert listing(tmp_path) == ["a"]


def test_one_process_does_not_claim_a_folder_twice(tmp_path):
    with lock_folder(tmp_path), pytest.raises(FolderInUse, match=str(os.getpid())), lock_folder(tmp_path):
        pass
    assert listing(tmp_path) == []


def test_a_journal_that_the_disk_does_not_give_back_is_the_disks_fault(tmp_path, monkeypatch):
    work = tmp_path / WORK
    work.mkdir()
    (work / JOURNAL).write_text("{}")

    def refuse(path, _limit):
        raise OSError(errno.EIO, "Input/output error", str(path))

    monkeypatch.setattr(journal, "read_regular", refuse)
    with pytest.raises(OSError, match="Input/output error"):
        journal.roll_back(tmp_path, work)


@pytest.mark.parametrize("damage", ["{", "[]", '{"put": ["../a"], "removed": [], "before": []}', "[" * 100_000])
def test_a_damaged_journal_is_reported_and_touches_nothing(tmp_path, damage):
    (tmp_path / "inner" / WORK).mkdir(parents=True)
    (tmp_path / "a").write_bytes(b"outside")
    (tmp_path / "inner" / WORK / JOURNAL).write_text(damage)
    with pytest.raises(JournalDamaged, match="damaged"):
        recover(tmp_path / "inner")
    assert (tmp_path / "a").read_bytes() == b"outside"
    assert (tmp_path / "inner" / WORK / JOURNAL).read_text() == damage
    assert listing(tmp_path / "inner" / WORK) == [JOURNAL]


def test_a_link_in_the_place_of_the_hidden_folder_is_not_followed(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / WORK).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(FileExistsError):
        write_all([(tmp_path / "out" / "a", b"1")])
    assert listing(tmp_path / "elsewhere") == []


def test_a_folder_appears_complete_or_not_at_all(tmp_path):
    with lock_output_folder(tmp_path) as lock, new_folder(lock, "scan") as part:
        part.mkdir()
        (part / "a").write_bytes(b"1")
        assert not (tmp_path / "scan").exists()
    assert (tmp_path / "scan" / "a").read_bytes() == b"1"
    with pytest.raises(ZeroDivisionError), lock_output_folder(tmp_path) as lock, new_folder(lock, "other") as part:
        part.mkdir()
        raise ZeroDivisionError
    assert listing(tmp_path) == ["scan"]


def test_a_capture_is_never_replaced(tmp_path):
    (tmp_path / "scan").mkdir()
    (tmp_path / "scan" / "old").touch()
    with pytest.raises(OverwriteError), lock_output_folder(tmp_path) as lock, new_folder(lock, "scan") as part:
        part.mkdir()
    assert listing(tmp_path / "scan") == ["old"]
    assert listing(tmp_path) == ["scan"]


def test_a_folder_is_tried_before_the_work(tmp_path, monkeypatch):
    with lock_output_folder(tmp_path / "deep" / "out"):
        assert listing(tmp_path / "deep" / "out") == [WORK]

    def full(_descriptor):
        raise OSError(errno.ENOSPC, "disk full")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="disk full"), lock_output_folder(tmp_path / "deep" / "other"):
        pass
    assert listing(tmp_path / "deep") == ["out"]


def test_a_folder_made_for_work_that_fails_does_not_stay_behind_empty(tmp_path):
    with pytest.raises(RuntimeError), lock_output_folder(tmp_path / "deep" / "out"):
        raise RuntimeError
    assert listing(tmp_path) == []
    with pytest.raises(RuntimeError), lock_output_folder(tmp_path / "deep" / "out"):
        (tmp_path / "deep" / "out" / "scan").touch()
        raise RuntimeError
    assert listing(tmp_path / "deep" / "out") == ["scan"]


def test_what_a_dead_run_left_is_removed_by_the_next(tmp_path):
    (tmp_path / WORK / "new").mkdir(parents=True)
    (tmp_path / WORK / "new" / "half").write_bytes(b"1")
    assert recover(tmp_path) is True
    assert listing(tmp_path) == []
    assert recover(tmp_path) is False
