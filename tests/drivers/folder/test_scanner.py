"""A folder in which scans arrive: whole, in pieces, twice under one name, or not at all."""

from __future__ import annotations

import os

import pytest

from drivers import SettingsError
from drivers.folder.config import FolderConfig, FolderSettings
from drivers.folder.scanner import FolderScanner
from drivers.scanner import DeviceError, SelfTriggered, TransportError

ANY = FolderSettings(deadline_s=30)
WAIT_S = 5.0  # of the test's own clock


class Clock:
    """Time that passes only in sleep. does: what happens then, once."""

    def __init__(self) -> None:
        self.now, self.does = 0.0, []

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds
        if self.does:
            self.does.pop(0)()


@pytest.fixture
def stand(tmp_path):
    """The folder, with a file that was there before, the scanner, and its clock."""
    (tmp_path / "old.ply").write_bytes(b"old")
    clock = Clock()
    config = FolderConfig(folder=tmp_path, pattern="*.ply")
    with FolderScanner(config, clock=clock, sleep=clock.sleep) as scanner:
        yield tmp_path, scanner, clock


def test_each_new_file_is_one_shot_in_the_order_of_their_times(stand):
    folder, scanner, _clock = stand
    assert isinstance(scanner, SelfTriggered)
    assert not scanner.wait(WAIT_S)
    for name, time in (("b.ply", 1), ("a.ply", 2), ("b.jpg", 3), (".c.ply", 4), ("d.part", 5), ("e.ply", 6)):
        (folder / name).write_bytes(b"" if name == "e.ply" else b"new")
        os.utime(folder / name, (time, time))
    shots = []
    while scanner.wait(WAIT_S):
        shots.append(scanner.capture(ANY))
    assert [shot.path.name for shot in shots] == ["b.ply", "a.ply"]
    shots[0].discard()
    assert shots[0].path.exists()


def test_a_file_is_taken_when_the_folder_has_been_still(stand):
    folder, scanner, clock = stand
    parts = [b"x" * size for size in range(1, 40)]
    clock.does = [lambda part=part: (folder / "new.ply").write_bytes(part) for part in parts]
    shot = scanner.capture(ANY)
    assert shot.path.read_bytes() == parts[-1]
    assert clock.now >= len(parts) * 0.1 + 1.0 - 0.01


def test_a_companion_that_is_still_written_holds_the_shot(stand):
    folder, scanner, _clock = stand
    (folder / "new.ply").write_bytes(b"new")
    assert not scanner.wait(0.5)
    (folder / "new.png").write_bytes(b"half")
    assert not scanner.wait(0.8)
    assert scanner.wait(WAIT_S)


def test_a_name_that_is_written_again_is_a_new_shot(stand):
    folder, scanner, _clock = stand
    for content in (b"first", b"second"):
        (folder / "old.ply").write_bytes(content)
        assert scanner.wait(WAIT_S)
        assert scanner.capture(ANY).path.read_bytes() == content
        assert not scanner.wait(WAIT_S)


def test_a_key_waits_and_says_when_nothing_comes(stand):
    folder, scanner, _clock = stand
    steps = []
    with pytest.raises(DeviceError, match=r"no new \*.ply came within 30 s") as caught:
        scanner.capture(ANY, lambda *step: steps.append(step))
    assert str(folder) in caught.value.hint
    assert steps[0] == ("waiting for a scan", 0.0)
    assert steps[-1][1] == pytest.approx(1.0, abs=0.01)


def test_a_folder_that_vanishes_is_said_and_waited_for(stand):
    folder, scanner, _clock = stand
    (folder / "old.ply").unlink()
    folder.rmdir()
    assert not scanner.wait(WAIT_S)
    with pytest.raises(TransportError, match="does not exist"):
        scanner.capture(ANY)
    folder.mkdir()
    (folder / "new.ply").write_bytes(b"new")
    assert scanner.wait(WAIT_S)


def test_a_folder_that_is_not_there_is_a_mistake(tmp_path):
    with pytest.raises(SettingsError, match=r"scanner\.folder: .* does not exist"):
        FolderScanner(FolderConfig(folder=tmp_path / "none", pattern="*.ply"))
