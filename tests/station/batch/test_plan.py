"""What is still to do is told from the records alone, longest first."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from restore import Settings, save_scan
from station.batch.page import restore_task
from station.batch.plan import check_names, plan_folder
from station.errors import UsageError
from station.intake import companions, kept, records
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


def test_folders_of_the_same_name_are_distinguished() -> None:
    assert check_names([Path("/a/x"), Path("/b/y")])
    assert not check_names([Path("/a/x"), Path("/b/x")])


@pytest.fixture
def meshes(tmp_path: Path) -> Path:
    """Meshes with material files and results of their own, one of them set aside."""
    for name in ("a", "b", "one"):
        (tmp_path / f"in/{name}.obj").parent.mkdir(exist_ok=True)
        (tmp_path / f"in/{name}.obj").write_bytes(f"mtllib {name}.mtl\nv 0 0 0\n".encode())
        (tmp_path / f"in/{name}.mtl").write_bytes(b"map_Kd skin.png\n")
    (tmp_path / "in/one.obj").write_bytes(b"#")
    for task in plan_folder(tmp_path / "in", tmp_path / "out", RunOptions()).tasks:
        restore_task(task, restore=restored)
    assert plan_folder(tmp_path / "in", tmp_path / "out", RunOptions()).tasks == ()
    return tmp_path


def test_what_has_not_changed_is_not_looked_at_again(meshes, monkeypatch) -> None:
    def refuse(*_arguments):
        pytest.fail("it was read again")

    monkeypatch.setattr(companions, "_read", refuse)
    monkeypatch.setattr(records, "find_result", refuse)
    plan = plan_folder(meshes / "in", meshes / "out", RunOptions())
    assert plan.tasks == ()
    assert sorted(plan.scans[0].files) == ["a.mtl", "a.obj"]


@pytest.mark.parametrize(
    "damage",
    [
        b"",
        b"{",
        b"[]",
        b'{"contents": 1}',
        b'{"contents": {"a.obj": [1]}, "settled": {"a.obj": null, "b.obj": ""}}',
    ],
)
def test_what_was_kept_may_be_lost_or_damaged(meshes, damage) -> None:
    (meshes / "out" / kept.NAME).write_bytes(damage)
    assert plan_folder(meshes / "in", meshes / "out", RunOptions()).tasks == ()


def test_a_change_of_a_scan_its_companion_or_its_result_is_seen(meshes) -> None:
    (meshes / "in/skin.png").write_bytes(b"x")  # which the material files of all three name
    assert names(plan_folder(meshes / "in", meshes / "out", RunOptions())) == ["a.obj", "b.obj"]
    (meshes / "in/skin.png").unlink()
    (meshes / "out/a/a.json").unlink()
    (meshes / "in/b.obj").write_bytes(b"mtllib other.mtl\n")
    assert sorted(names(plan_folder(meshes / "in", meshes / "out", RunOptions()))) == ["a.obj", "b.obj"]


def test_the_size_of_a_file_is_looked_at_before_the_file(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(companions, "_read", lambda *_: pytest.fail("2.5 GB were read"))
    (tmp_path / "in").mkdir()
    with (tmp_path / "in/large.obj").open("wb") as file:
        file.truncate(2_500_000_000)
    assert len(plan_folder(tmp_path / "in", tmp_path / "out", RunOptions()).tasks) == 1


@pytest.mark.parametrize("before", [0, 10_000, 2_000_000])
def test_the_names_in_a_file_are_found_wherever_they_are(tmp_path, before) -> None:
    lines = b"v 1.25 2.5 3.75\n" * before
    (tmp_path / "page.obj").write_bytes(lines + b"mtllib page.mtl\nf 1 2 3\n" + b"# end\n" * 100)
    assert companions._read(tmp_path / "page.obj", ".obj").names == ("page.mtl",)
