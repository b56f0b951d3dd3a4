"""The listing of the watched folder, and the question who writes to a file."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from drivers.simulated.device.clock import VirtualClock
from station.intake.listing import MAX_DEPTH, Quiet, Stamp, has_writer, list_files
from station.session import Volume, create_session


@pytest.fixture
def leases(tmp_path: Path) -> None:
    """Skip where the file system knows no leases."""
    path = tmp_path / "probe"
    with path.open("wb"):
        if not has_writer(path):
            pytest.skip("no leases on this file system")


def test_regular_files_that_are_not_hidden(tmp_path: Path) -> None:
    (tmp_path / "sub/.rsync").mkdir(parents=True)
    for name in ("a.obj", "sub/b.obj", ".hidden.obj", "sub/.rsync/c.obj"):
        (tmp_path / name).write_bytes(b"123")
    (tmp_path / "folder.obj").mkdir()
    (tmp_path / "broken.obj").symlink_to("nothing")
    (tmp_path / "circle").symlink_to(tmp_path)
    os.mkfifo(tmp_path / "pipe.obj")
    listing = list_files(tmp_path, without=tmp_path / "out")
    assert sorted(map(str, listing)) == ["a.obj", "sub/b.obj"]
    assert listing[Path("a.obj")].size == 3


def test_sessions_are_left_out_and_named(tmp_path: Path) -> None:
    for name in ("book", "sub/map", "lost"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        create_session(tmp_path / name, Volume(title=name))
    (tmp_path / "lost/events.jsonl").unlink()
    (tmp_path / "sub/a.obj").write_bytes(b"")
    found: list[Path] = []
    assert [*list_files(tmp_path, without=tmp_path / "out", left_out=found.append)] == [Path("sub/a.obj")]
    assert found == [Path("book"), Path("lost"), Path("sub/map")]


def test_the_results_are_left_out_and_depth_has_a_limit(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out/a.obj").touch()
    deep = tmp_path.joinpath(*["d"] * (MAX_DEPTH + 1))
    deep.mkdir(parents=True)
    (deep / "b.obj").touch()
    (deep.parent / "c.obj").touch()
    assert [path.name for path in list_files(tmp_path, without=tmp_path / "out")] == ["c.obj"]


def test_a_folder_that_cannot_be_read_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        list_files(tmp_path / "gone", without=tmp_path)


def test_quiet_counts_from_the_last_change() -> None:
    clock, path = VirtualClock(), Path("a.obj")
    quiet = Quiet(clock)
    for size, wait in ((1, 2.0), (1, 2.0), (2, 1.0)):
        quiet.update({path: Stamp(size, 7)})
        clock.sleep(wait)
    assert quiet.seconds(path) == 1.0
    quiet.update({})
    quiet.update({path: Stamp(2, 7)})
    assert quiet.seconds(path) == 0.0  # it was gone in the meantime


def test_a_writer_is_seen_in_this_process_and_in_another(tmp_path: Path, leases: None) -> None:
    path = tmp_path / "a.obj"
    path.touch()
    assert not has_writer(path)
    with path.open("rb"):
        assert not has_writer(path)
    with path.open("ab"):
        assert has_writer(path)
    code = "import sys; file = open(sys.argv[1], 'ab'); print(flush=True); sys.stdin.read()"
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", code, str(path)], stdin=pipe, stdout=pipe) as writer:
        writer.stdout.readline()
        assert has_writer(path)
        writer.stdin.close()
    assert not has_writer(path)


def test_a_writer_that_the_kernel_does_not_list_does_not_count(tmp_path: Path) -> None:
    assert not has_writer(tmp_path / "gone")
    path, answers = tmp_path / "a.obj", []
    with path.open("wb"):
        other = threading.Thread(target=lambda: answers.append(has_writer(path)))  # where no handler can be set
        other.start()
        other.join()
    assert answers == [False]
