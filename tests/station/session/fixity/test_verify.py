"""Every single fault of a session is found, its page named, and mended where it can be."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from oracles.file_faults import KINDS, file_fault
from restore import BadInput
from station.errors import FolderInUse
from station.session import VOLUME, add_scan, open_session
from station.session.derivation.reproduce import reproduce
from station.session.derivation.restoration import Run
from station.session.fixity.reconcile import reconcile
from station.session.fixity.repair import repair
from station.session.fixity.verify import Problem, page_of, verify
from station.session.log import bag
from station.session.log.steps import decide, record_run
from station.session.log.store import read_session
from station.storage.folder_lock import WORK

FAULTS_OF_A_KIND = 12  # bench.bit_faults tries thousands
TEXT = "page.txt"


def uppercase(session, event, folder: Path) -> Run:
    """A stage that a test can follow: the text of its parameters in capitals."""
    text = str(event.facts["parameters"]["text"]).upper()
    (folder / TEXT).write_text(text)
    return Run({"length": len(text)})


DERIVERS = {"restore": uppercase}


@pytest.fixture
def session(volume, tiny_scan) -> Path:
    """Two pages with a run each, a label, an undone note."""
    with open_session(volume) as writer:
        for number, text in enumerate(("first", "second"), 1):
            capture = add_scan(writer, tiny_scan, facts={"number": number})
            folder = writer.staging("run")
            folder.mkdir()
            (folder / TEXT).write_text(text.upper())
            record_run(
                writer, "restore", capture, parameters={"text": text}, result={"length": len(text)}, files=folder
            )
            decide(writer, "label", f"{number}r", page=capture.page)
    return volume


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_sound_session_has_no_problem(session):
    assert verify(session).problems == ()
    assert not (session / WORK).exists()


@pytest.mark.parametrize("kind", KINDS)
def test_every_single_fault_is_found_named_and_repaired(session, tmp_path, kind):
    before, random = contents(session), np.random.default_rng(KINDS.index(kind))
    for _ in range(FAULTS_OF_A_KIND):
        with file_fault(session, kind, random) as fault:
            problems = verify(session).problems
            assert problems, fault
            assert {problem.page for problem in problems} == {page_of(fault.path)}, (fault, problems)
            done = repair(session, derivers=DERIVERS)
            mendable = all(problem.remedy for problem in problems)
            assert all(one.how for one in done) == mendable
            if mendable:
                assert contents(session) == before, fault
                assert verify(session).problems == ()
        for aside in tmp_path.glob("volume.set-aside*"):
            shutil.rmtree(aside)
    assert verify(session).problems == ()


def damage(path: Path) -> None:
    data = path.read_bytes()
    path.unlink()
    path.write_bytes(bytes([data[0] ^ 1]) + data[1:])


def test_a_damaged_scan_is_taken_from_a_copy_and_only_from_there(session, tmp_path, tiny_scan):
    copy = tmp_path / "copy"
    shutil.copytree(session, copy)
    records = [path for path in session.rglob("scan.json") if "0001-" in str(path)]
    # The two scans are equal, so that one file could be had from the other page: all of them are damaged.
    for path in [*records, *(path for path in session.rglob("scan.json") if path not in records)]:
        damage(path)
    problems = verify(session).problems
    assert {(one.page, one.remedy) for one in problems} == {(1, ""), (2, "")}
    assert "copy" in problems[0].text
    assert [one.how for one in repair(session)] == ["", ""]
    damage(next(copy.rglob("scan.json")))  # one file of the copy is no better
    assert [one.how for one in repair(session, copy=copy)].count("taken from the copy") >= 1


def test_equal_files_of_the_session_stand_in_for_each_other(session):
    damage(next(session.rglob("texture.png")))
    assert [one.how for one in repair(session)] == ["copied from an equal file"]
    assert verify(session).problems == ()


def test_a_file_that_cannot_be_derived_again_to_the_byte_is_left_and_reported(session):
    damage(session / "data" / "0001-000003-restore" / TEXT)

    def other(session, event, folder):
        (folder / TEXT).write_text("another text")
        return Run({})

    (done,) = repair(session, derivers={"restore": other})
    assert done.how == ""
    assert "another" in done.why_not


def test_what_is_replaced_is_kept_aside(session, tmp_path):
    damaged = session / "data" / "0001-000003-restore" / TEXT
    damage(damaged)
    bad = damaged.read_bytes()
    repair(session, derivers=DERIVERS)
    kept = tmp_path / "volume.set-aside" / "data" / "0001-000003-restore" / TEXT
    assert kept.read_bytes() == bad


def test_a_moved_pointer_and_a_forged_input_are_found(session):
    inspection = verify(session)
    event = inspection.reconciled.events[3]
    assert [(one.event, one.sha512) for one in event.inputs] == [(2, inspection.reconciled.events[2].sha512)]
    log = session / bag.LOG
    forged = log.read_bytes().replace(event.inputs[0].sha512.encode(), b"0" * 128)
    record = session / "data" / event.folder / "event.json"
    record.chmod(0o644)
    record.write_bytes(forged.splitlines(keepends=True)[2])
    log.write_bytes(forged)
    problems = verify(session).problems
    assert ("contradiction", 1) in {(one.kind, one.page) for one in problems}


def test_an_interrupted_writer_is_distinguished_from_damage(session):
    before = contents(session)
    with open_session(session) as writer:
        decide(writer, "note", "x", page=2)
    after = contents(session)
    for name in (bag.LOG, bag.MANIFEST, bag.TAG_MANIFEST):
        (session / name).write_bytes(before[name])
    (problem,) = verify(session).problems
    assert (problem.kind, problem.page) == ("unfinished", 2)
    assert [one.how for one in repair(session)] == ["completed"]
    assert contents(session) == after


def test_a_session_that_is_written_to_is_left_alone(session):
    with open_session(session), pytest.raises(FolderInUse, match="process"):
        verify(session)


def test_a_folder_that_is_not_a_session(tmp_path):
    with pytest.raises(BadInput):
        verify(tmp_path)


def test_two_records_of_an_event_lost_are_reported_as_such(session):
    (session / "data" / "0001-000003-restore" / "event.json").unlink()
    lines = (session / bag.LOG).read_bytes().splitlines(keepends=True)
    (session / bag.LOG).write_bytes(b"".join(lines[:2] + lines[3:]))
    problems = verify(session).problems
    assert ("contradiction", 1, "") in {(one.kind, one.page, one.remedy) for one in problems}
    assert reconcile(session, list(contents(session))).disputed == ("0001-000003-restore",)


def test_reproduce_compares_files_and_results(session, tmp_path):
    stored = read_session(session)
    done = list(reproduce(stored, tmp_path / "scratch", derivers=DERIVERS))
    assert [one.differing for one in done] == [(), ()]

    def other(session, event, folder):
        run = uppercase(session, event, folder)
        (folder / TEXT).write_text("x")
        (folder / "new").write_text("x")
        return Run({"length": run.result["length"] + 1})

    assert [one.differing for one in reproduce(stored, tmp_path / "scratch", derivers={"restore": other})] == [
        ("new", TEXT, "result.length")
    ] * 2
    with pytest.raises(BadInput, match="no stage"):
        list(reproduce(stored, tmp_path / "scratch", derivers={}))


def test_the_text_of_a_problem():
    problem = Problem("missing", VOLUME, "bagit.txt", "it is written again")
    assert problem.text == "the volume: bagit.txt is missing; it is written again"
