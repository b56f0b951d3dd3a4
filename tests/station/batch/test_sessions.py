"""Pages of sessions: restored once by workers, recorded by the one writer, set aside with the reason."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest

from restore import Settings
from station.archive.from_session import volume_of
from station.archive.volume import Role
from station.batch.runner import REPORT, run_batch
from station.batch.sessions import SessionBatch
from station.cli import main
from station.errors import FolderInUse, UsageError
from station.session import Volume, add_files, create_session, open_session, read_session, undo_run
from station.session.captures.originals import add_original
from station.session.derivation.service import Derivation, Job, restore_job
from station.session.terms.parts import RESTORE, VERDICT
from station.session.terms.presets import Preset
from station.storage.session_folder import is_session
from station.verdict.checks import LEVELS
from station.workers.executors import Workers, local_workers
from station.workers.process import Limits
from tests.station.batch.conftest import QUICK, small_scan
from tests.station.conftest import fault


@pytest.fixture
def session(tmp_path):
    """A session of three small scans and one that is damaged."""
    preset = Preset(settings={"points": 100, "dpi": 40}).model_dump(mode="json", exclude_none=True)
    create_session(tmp_path / "book", Volume(title="A book", preset_values=preset))
    with open_session(tmp_path / "book") as writer:
        for seed in range(3):
            add_original(writer, small_scan(tmp_path / f"scans/{seed}.ply", seed))
        broken = tmp_path / "scans/broken.ply"
        broken.write_bytes(b"ply\nformat ascii 1.0\nend_header\n")
        add_files(writer, {broken.name: broken}, broken.name, facts={})
    return tmp_path / "book"


def batch(session, out, events, options=QUICK):
    return run_batch([session], out, options, local_workers(2, Limits()), events.append).report


def restored(session) -> list[int]:
    runs = {page.number: page.runs.get(RESTORE) for page in read_session(session).history.pages()}
    return [number for number, run in runs.items() if run is not None and "error" not in run.facts["result"]]


@pytest.mark.usefixtures("in_process")
def test_pages_are_restored_and_recorded_once(session, tmp_path) -> None:
    events: list = []
    report = batch(session, tmp_path / "out", events)
    assert restored(session) == [1, 2, 3]
    assert sorted((event.state, event.name) for event in events) == [
        *(("restored", f"A book, page {number}") for number in (1, 2, 3)),
        ("set aside", "A book, page 4"),
    ]
    volume = volume_of(read_session(session))
    assert [page.find(Role.PAGE) is not None for page in volume.pages] == [True, True, True, False]
    html = report.read_text()
    assert html.index("A book, page 4") < html.index("A book, page 1")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [REPORT]
    again: list = []
    batch(session, tmp_path / "out", again)
    assert again == []


@pytest.mark.usefixtures("in_process")
def test_every_page_has_a_verdict_also_those_of_a_batch_that_was_interrupted(session, tmp_path) -> None:
    batch(session, tmp_path / "out", [])
    with open_session(session) as writer:
        undo_run(writer, 2, VERDICT)
    assert checked(session) == {1: True, 2: False, 3: True, 4: False}
    html = batch(session, tmp_path / "out", []).read_text()
    assert checked(session) == {1: True, 2: True, 3: True, 4: False}
    assert sum(html.count(f"<b class='{level}'>") for level in LEVELS) == 3


def checked(session) -> dict[int, bool]:
    """Whether a page has a verdict."""
    return {page.number: VERDICT in page.runs for page in read_session(session).history.pages()}


def test_the_settings_of_the_preset_hold_where_none_is_given(session) -> None:
    tasks: list[Job] = []

    def keep(work, task, above_mib=0):
        tasks.append(task)
        future: Future = Future()
        future.set_result(restore_job(task, ("a crash", "another")))
        return future

    with open_session(session) as writer:
        SessionBatch({"book": writer}, type(QUICK)(Settings(dpi=80), frozenset({"mesh"}))).run(
            Workers(keep, lambda: 1, lambda: 1), lambda _: None
        )
    assert {task.parameters["settings"]["dpi"] for task in tasks} == {80.0}
    assert {task.parameters["settings"]["points"] for task in tasks} == {100}
    assert tasks[0].parameters["outputs"] == ["coverage", "mesh"]
    assert [task.size for task in tasks] == sorted((task.size for task in tasks), reverse=True)
    assert restored(session) == []  # two processes had ended over each of them


def test_the_session_is_the_batchs_alone(session, tmp_path) -> None:
    with open_session(session), pytest.raises(FolderInUse):
        batch(session, tmp_path / "out", [])
    with pytest.raises(UsageError, match="lies in the session"):
        batch(session, session / "out", [])


def test_a_profile_is_not_an_option_of_a_session(session, tmp_path) -> None:
    with pytest.raises(UsageError, match="take no profile"):
        batch(session, tmp_path / "out", [], replace(QUICK, colours=b"icc"))
    assert not (tmp_path / "out").exists()


def test_the_unit_is_that_of_scans_that_have_none(session, tmp_path) -> None:
    original = small_scan(tmp_path / "more/m.ply")
    with open_session(session) as writer:
        add_original(writer, original, unit="in")
        derivation = Derivation(writer, replace(QUICK, unit="cm"))
        tasks = [derivation.job(capture) for capture in derivation.due()]
    assert [task.parameters["unit"] for task in tasks] == ["cm"] * 4 + ["in"]


@pytest.mark.usefixtures("in_process")
def test_the_command_takes_sessions_and_folders(session, tmp_path, capsys) -> None:
    small_scan(tmp_path / "more/x.ply", 9)
    words = ["batch", str(session), str(tmp_path / "more"), "-o", str(tmp_path / "out"), "-j", "1"]
    assert main([*words, "--points", "100", "--dpi", "40"]) == 7
    assert capsys.readouterr().out.splitlines()[-2] == "4 restored, 1 set aside"
    assert (tmp_path / "out/x/x.png").exists()
    assert np.array_equal(restored(session), [1, 2, 3])


def test_a_session_in_a_folder_of_scans_is_left_out_and_named(session, tmp_path, capsys) -> None:
    (tmp_path / "all").mkdir()
    session.rename(tmp_path / "all/a book")
    out = ["-o", str(tmp_path / "out")]
    assert main(["batch", str(tmp_path / "all"), *out, "-j", "1"]) == 0
    reported, summary, _ = capsys.readouterr().out.splitlines()
    assert reported.startswith("left out ")
    assert reported.endswith(f"planish batch '{tmp_path}/all/a book' -o OUT")
    assert summary == "0 restored, 0 set aside"
    assert restored(tmp_path / "all/a book") == []
    assert main(["batch", str(tmp_path / "all/a book/data"), *out]) == 2
    message, hint = fault(capsys.readouterr().err)
    assert "is not a folder of scans" in message
    assert f"planish batch '{tmp_path}/all/a book' -o OUT" in hint


def test_a_session_is_distinguished_from_a_folder_of_scans(session, tmp_path) -> None:
    assert is_session(session)
    assert not is_session(tmp_path / "scans")
