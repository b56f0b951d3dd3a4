"""One task: restored or set aside once, whoever else is at it."""

from __future__ import annotations

import json

import pytest

from restore.formats import load_scan, read_image
from station.batch.page import BEFORE_PX, restore_task
from station.batch.plan import plan_folder
from station.batch.preview import preview
from station.errors import FolderInUse
from station.intake import records
from tests.station.batch.conftest import QUICK


@pytest.fixture
def task(scans, tmp_path):
    tasks = plan_folder(scans, tmp_path / "out", QUICK).tasks
    return next(task for task in tasks if task.name == "sub/c.ply")


def test_a_page_is_restored_and_then_known(task, scans) -> None:
    done = restore_task(task)
    assert done.settled[0].state == "restored"
    report = json.loads((task.out / "sub/c/c.json").read_text())
    assert report["scan"] == str(scans / "sub/c.ply")
    assert (task.out / "sub/c/c.png").exists()
    assert done.seconds > 0
    before = preview(load_scan(scans / "sub/c.ply").texture, BEFORE_PX)
    assert done.previews == {task.out / "sub/c/c.png": before + preview(read_image(task.out / "sub/c/c.png"))}
    again = restore_task(task)
    assert (again.settled[0].state, again.previews) == ("done", {})


def test_a_damaged_scan_is_set_aside_with_its_reason(scans, tmp_path) -> None:
    (task,) = (task for task in plan_folder(scans, tmp_path / "out", QUICK).tasks if task.name == "broken.ply")
    (settled,) = restore_task(task).settled
    assert settled.state == "set aside"
    assert str(scans / "broken.ply") in settled.reason
    assert settled.place.read_text().startswith(settled.reason)


def test_a_page_whose_processes_ended_twice_is_set_aside_with_how_they_ended(task, monkeypatch) -> None:
    def crash(*_, **__):
        raise SystemExit

    for _ in range(2):
        with monkeypatch.context() as cut_off, pytest.raises(SystemExit):
            cut_off.setattr(records, "end_attempt", lambda out, arrival: None)  # nothing is done after a crash
            restore_task(task, restore=crash)
    (settled,) = restore_task(task, ("its process ended by SIGSEGV",) * 2).settled
    assert settled.state == "set aside"
    assert settled.reason.endswith("ended 2 times while it restored this scan: its process ended by SIGSEGV")
    assert not list(task.out.rglob("*.attempt"))


def test_a_page_that_another_process_has_is_waited_for(task) -> None:
    waited = []

    def restore(source, destination, _options, *, facts, stem=None):
        raise FolderInUse(destination.folder, "7")

    def sleep(seconds: float) -> None:
        waited.append(seconds)
        if len(waited) == 3:
            restore_task(task)  # the other one ends

    assert restore_task(task, restore=restore, sleep=sleep).settled[0].state == "done"
    assert len(waited) == 3


def test_a_scan_that_goes_away_is_named_and_left_for_the_next_batch(task, scans) -> None:
    (scans / "sub/c.ply").unlink()
    (settled,) = restore_task(task).settled
    assert settled.state == "set aside"
    assert "went away" in settled.reason
    assert not list(task.out.rglob("*.txt"))
