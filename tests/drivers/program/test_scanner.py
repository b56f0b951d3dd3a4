"""A scanner that is a program: its shots, and every way in which it can fail."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest

from drivers import ScanFile, SettingsError, Turner, settings_of
from drivers.scanner import DeviceError
from tests.drivers.program.conftest import MESH, WRITES

SAYS = (
    """
import os, pathlib, sys
names = ("OUTPUT", "OPENING", "ATTEMPT", "GAIN", "DEADLINE_S")
pathlib.Path("said").write_text(" ".join([*sys.argv[2:], *(os.environ["PLANISH_" + name] for name in names)]))
"""
    + WRITES
)
GAIN = {"settings": {"gain": {"default": 2}}}
LOGS = "import pathlib, sys; pathlib.Path(sys.argv[1]).open('a').write(sys.argv[2] + ' ')"


def shoot(scanner, config, **values) -> ScanFile:
    return scanner.capture(settings_of(config).of(values))


def test_a_shot_is_the_file_in_a_folder_of_its_own(opened, table):
    with opened(unit="mm") as scanner:
        first, second = shoot(scanner, table()), shoot(scanner, table())
    assert first.path.read_text() == MESH
    assert first.folder == first.path.parent != second.folder
    assert (first.reading["unit"], first.provenance["device"]) == ("mm", "grab")
    first.discard()
    assert (first.folder.exists(), second.folder.exists()) == (False, True)


def test_settings_and_place_are_arguments_and_environment(opened, table):
    words = ("{opening}.{attempt}", "g={gain}")
    with opened(SAYS, *words, **GAIN) as scanner:
        assert isinstance(scanner, Turner)
        scanner.turn_to(3, 1)
        shot = shoot(scanner, table(SAYS, *words, **GAIN), gain=5, deadline_s=30)
    assert (shot.folder / "said").read_text().split() == ["3.1", "g=5", str(shot.path), "3", "1", "5", "30"]
    assert shot.provenance["settings"] == {"gain": 5, "average": 1, "deadline_s": 30}


def test_a_program_that_does_not_turn_is_not_a_turner(opened):
    with opened() as scanner:
        assert not isinstance(scanner, Turner)


def test_a_check_names_the_scanner_or_refuses_it(opened):
    with opened(check=["{python}", "-c", "print('PhoXi M, 2019-04\\nready')"]) as scanner:
        assert scanner.identity == "PhoXi M, 2019-04"
    with pytest.raises(DeviceError, match="no camera is connected"):
        opened(check=["{python}", "-c", "raise SystemExit('no camera is connected')"])


def test_it_is_parked_at_the_end_and_after_a_failed_shot(opened, table, tmp_path):
    log = tmp_path / "log"
    with opened("raise SystemExit(1)", park=["{python}", "-c", LOGS, str(log), "parked"]) as scanner:
        with pytest.raises(DeviceError):
            shoot(scanner, table("raise SystemExit(1)"))
        assert log.read_text() == "parked "
    scanner.close()
    assert log.read_text() == "parked parked "


FAULTS = {
    "no file": ("pass", "wrote no shot.obj"),
    "an empty file": ("import sys; open(sys.argv[1], 'w')", "wrote no shot.obj"),
    "a sentence": ("import sys; sys.exit('the lamp is cold')", "ended with code 1: the lamp is cold"),
    "a full disk": ("raise OSError(28, 'No space left on device')", "No space left on device"),
    "killed": ("import os; os.kill(os.getpid(), 9)", "ended by signal 9"),
}


@pytest.mark.parametrize(("script", "said"), FAULTS.values(), ids=FAULTS)
def test_a_fault_is_said_and_the_next_shot_is_taken(opened, table, script, said):
    with opened(script) as scanner:
        with pytest.raises(DeviceError, match=said) as caught:
            shoot(scanner, table(script))
        assert caught.value.hint
        assert shoot(scanner, table()).path.read_text() == MESH


def test_a_file_that_still_grows_is_not_a_scan(opened, table):
    with opened() as scanner:
        scanner._sleep = lambda _seconds: grow(Path(tempfile.gettempdir()))
        with pytest.raises(DeviceError, match="still being written") as caught:
            shoot(scanner, table())
    kept = Path(caught.value.__notes__[-1].removeprefix("what the program wrote is kept: "))
    assert (kept / "shot.obj").read_text() == MESH + "v"


def grow(folder: Path) -> None:
    for path in folder.rglob("shot.obj"):
        path.write_text(path.read_text() + "v")


def test_settings_are_checked_before_anything_runs(opened, table):
    with opened(**GAIN) as scanner, pytest.raises(SettingsError):
        shoot(scanner, table(**GAIN), gain=1.5)
