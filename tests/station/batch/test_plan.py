"""What is still to do is told from the records alone, longest first."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from restore import Settings, save_scan
from station.batch.page import restore_task
from station.batch.plan import check_names, plan_folder
from station.errors import UsageError
from station.run.one_page import Outcome
from station.run.options import RunOptions
from tests.station.conftest import curl_scan


def restored(source, destination, _options, *, facts, stem=None):
    """Stands in for `restore_file`: a report and nothing else. A file of one byte is refused."""
    if source.is_file() and source.stat().st_size == 1:
        raise ValueError("too short")
    destination.folder.mkdir(parents=True, exist_ok=True)
    stem = source.name.removesuffix(".scan").partition(".")[0]
    (destination.folder / f"{stem}.json").write_text(json.dumps(facts))
    return Outcome(facts, ())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "in"
    for name, size in {"small.glb": 10, "large.glb": 1000, "sub/page.glb": 100, "one.glb": 1, "notes.txt": 5}.items():
        (made / name).parent.mkdir(parents=True, exist_ok=True)
        (made / name).write_bytes(b"x" * size)
    return made


def names(plan) -> list[str]:
    return [task.name for task in plan.tasks]


def test_the_longest_come_first(folder, tmp_path) -> None:
    plan = plan_folder(folder, tmp_path / "out", RunOptions())
    assert names(plan) == ["large.glb", "sub/page.glb", "small.glb", "one.glb"]
    assert len(plan.scans) == 4


def test_what_is_settled_is_not_planned_again(folder, tmp_path) -> None:
    out = tmp_path / "out"
    done = {task.name: restore_task(task, restore=restored) for task in plan_folder(folder, out, RunOptions()).tasks}
    assert {name: one.settled[0].state for name, one in done.items()} == {
        "large.glb": "restored",
        "sub/page.glb": "restored",
        "small.glb": "restored",
        "one.glb": "set aside",
    }
    assert plan_folder(folder, out, RunOptions()).tasks == ()
    (folder / "one.glb").write_bytes(b"complete")
    (folder / "small.glb").write_bytes(b"another")
    assert names(plan_folder(folder, out, RunOptions())) == ["one.glb", "small.glb"]


def test_scans_of_one_name_are_one_task(folder, tmp_path) -> None:
    (folder / "large.stl").write_bytes(b"x" * 500)
    plan = plan_folder(folder, tmp_path / "out", RunOptions())
    assert [str(arrival.source) for arrival in plan.tasks[0].arrivals] == ["large.glb", "large.stl"]
    done = restore_task(plan.tasks[0], restore=restored)
    assert [one.place.name for one in done.settled] == ["large", "large-2"]
    assert "large.glb" not in names(plan_folder(folder, tmp_path / "out", RunOptions()))


def test_a_scan_folder_is_one_scan(tmp_path) -> None:
    save_scan(curl_scan(), tmp_path / "in/leaf.scan")
    plan = plan_folder(tmp_path / "in", tmp_path / "out", RunOptions())
    assert names(plan) == ["leaf.scan"]
    assert plan.scans[0].stem == "leaf"
    done = restore_task(plan.tasks[0], restore=restored)
    assert done.settled[0].state == "restored"
    assert (tmp_path / "out/leaf/leaf.json").exists()
    assert plan_folder(tmp_path / "in", tmp_path / "out", RunOptions()).tasks == ()


def test_results_of_several_sheets_are_found_again(folder, tmp_path) -> None:
    def two_sheets(source, destination, _options, *, facts, stem=None):
        destination.folder.mkdir(parents=True)
        for number in (1, 2):
            (destination.folder / f"{source.stem}-{number}.json").write_text(json.dumps(facts))

    for task in plan_folder(folder, tmp_path / "out", RunOptions()).tasks:
        restore_task(task, restore=two_sheets)
    assert plan_folder(folder, tmp_path / "out", RunOptions()).tasks == ()


def test_a_sub_folder_has_its_own_options(folder, tmp_path) -> None:
    (folder / "sub/planish.toml").write_text("dpi = 300\n")
    plan = plan_folder(folder, tmp_path / "out", RunOptions(Settings(dpi=100)))
    assert {task.name: task.options.settings.dpi for task in plan.tasks}["sub/page.glb"] == 300
    (folder / "sub/planish.toml").write_text("dpi = 1\n")
    with pytest.raises(UsageError, match="dpi"):
        plan_folder(folder, tmp_path / "out", RunOptions())


def test_folders_of_the_same_name_are_told_apart() -> None:
    assert check_names([Path("/a/x"), Path("/b/y")])
    assert not check_names([Path("/a/x"), Path("/b/x")])
