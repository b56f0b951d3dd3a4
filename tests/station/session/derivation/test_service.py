"""The next step of a page, its job, and what is recorded of it."""

from __future__ import annotations

from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool

import numpy as np
import pytest

from restore import BadInput, PageEdits, Settings
from station.run.options import RunOptions
from station.session import add_scan, correct, open_session, undo, undo_run
from station.session.derivation.parameters import parameters_of
from station.session.derivation.restoration import Run
from station.session.derivation.service import Derivation, Done, next_step, restore_job
from station.session.log.steps import record_run
from station.session.terms.parts import RESTORE, VERDICT
from station.verdict.same_page import fingerprint

PICTURE = fingerprint(np.random.default_rng(0).integers(0, 256, (200, 200, 3), np.uint8))
MEASURED = {"measures": {"fingerprint": PICTURE}}
WHOLE, TURNED = PageEdits(layout="whole"), PageEdits(layout="left")


@pytest.fixture
def writer(volume, tiny_scan):
    with open_session(volume) as opened:
        add_scan(opened, tiny_scan, facts={})
        yield opened


def restored(writer, result):
    page = writer.history.page(1)
    return record_run(writer, RESTORE, page.capture, parameters=parameters_of(writer.session, page), result=result)


STATES = {
    "captured": (lambda writer: None, "restore"),
    "restored": (lambda writer: restored(writer, MEASURED), "check"),
    "failed": (lambda writer: restored(writer, {"error": "no surface", "hint": ""}), None),
    "checked": (lambda writer: settled(writer), None),
    "its check undone": (lambda writer: (settled(writer), undo_run(writer, 1, VERDICT)), "check"),
    "its restoration undone": (lambda writer: (settled(writer), undo_run(writer, 1, RESTORE)), "restore"),
    "corrected": (lambda writer: (settled(writer), correct(writer, 1, WHOLE)), "restore"),
    "a correction undone": (lambda writer: (settled(writer), correct(writer, 1, WHOLE), undo(writer)), None),
    "corrected, then restored": (lambda writer: (correct(writer, 1, WHOLE), settled(writer)), None),
}


def settled(writer):
    """Record what a process makes of the page of a session."""
    derivation = Derivation(writer)
    (job,) = map(derivation.job, derivation.due())
    job.folder.mkdir()
    return derivation.settle(job, Run(MEASURED, {"seconds": {}}))


@pytest.mark.parametrize(("change", "step"), STATES.values(), ids=STATES)
def test_the_next_step_of_a_page_follows_from_its_events(writer, change, step) -> None:
    change(writer)
    assert next_step(writer.session, writer.history.page(1)) == step


def test_a_page_without_a_scan_lacks_nothing(volume) -> None:
    with open_session(volume) as opened:
        assert next_step(opened.session, opened.history.page(1)) is None
        assert list(Derivation(opened).due()) == []


def test_what_is_due_is_yielded_but_for_what_is_running_and_checks_are_made(writer, tiny_scan) -> None:
    checked = []
    derivation = Derivation(writer, checked=lambda page, check: checked.append((page, check.level)))
    restored(writer, MEASURED)
    later = add_scan(writer, tiny_scan, facts={})
    assert list(derivation.due(running=[later.number])) == []
    assert checked == [(1, "green")]
    assert list(derivation.due()) == [later]
    assert list(derivation.due(page=1)) == []


def test_the_job_of_a_batch_has_its_options_and_the_job_of_the_console_its_outputs(writer) -> None:
    (capture,) = Derivation(writer).due()
    plain = Derivation(writer).job(capture)
    assert plain.size == sum(path.stat().st_size for path in plain.files) > 0
    batch = Derivation(writer, RunOptions(Settings(dpi=80), frozenset({"mesh"}), unit="cm")).job(capture)
    assert (batch.parameters["settings"]["dpi"], batch.parameters["outputs"]) == (80.0, ["coverage", "mesh"])
    assert batch.parameters["settings"]["points"] == plain.parameters["settings"]["points"]
    console = Derivation(writer, outputs=("model",)).job(capture)
    assert console.parameters == {**plain.parameters, "outputs": ["coverage", "model"]}


def test_two_ended_processes_are_recorded_as_a_failure_with_an_empty_folder(writer) -> None:
    derivation = Derivation(writer, facts={"host": "here"})
    (job,) = map(derivation.job, derivation.due())
    job.folder.mkdir()
    (job.folder / "half.png").write_bytes(b"half")
    settled = derivation.settle(job, restore_job(job, ("a crash", "another")).result)
    assert (settled.quality, dict(settled.run.event.files), settled.run.event.facts["host"]) == (None, {}, "here")
    assert settled.run.result.error == "the program ended 2 times while it restored this scan: another"


@pytest.mark.parametrize(
    ("errors", "text"),
    [
        ([BrokenProcessPool()], None),
        ([BrokenProcessPool(), BrokenProcessPool()], "the program ended while it restored this scan"),
        ([MemoryError()], "memory"),
        ([BadInput("no surface", "")], "no surface"),
    ],
)
def test_in_the_background_any_fault_but_one_of_the_disk_costs_the_page(writer, errors, text) -> None:
    derivation = Derivation(writer)
    for error in errors:
        (job,) = map(derivation.job, derivation.due())
        future: Future[Run] = Future()
        future.set_exception(error)
        made = derivation.settle_done(Done(job, future))
    if text is None:
        assert made is None
    else:
        assert text in made.run.result.error
    assert sum(event.kind == "stage" for event in writer.history.events) == (text is not None)
    future = Future()
    future.set_exception(OSError(28, "full"))
    with pytest.raises(OSError, match="full"):
        derivation.settle_done(Done(job, future))
