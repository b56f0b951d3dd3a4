"""The steps of a session that `bench.kill.sessions` interrupts."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from oracles.tiny_scan import tiny_scan
from restore import save_scan
from station.archive.check import check_export
from station.archive.deliver import deliver
from station.archive.formats import Format
from station.archive.from_session import volume_of
from station.batch.runner import REPORT, run_batch
from station.run.options import RunOptions
from station.session import (
    Volume,
    Writer,
    add_rule,
    add_scan,
    correct,
    create_session,
    open_session,
    read_session,
    redo,
    undo,
)
from station.session.captures.originals import add_original
from station.session.derivation.restoration import PAGE, Run
from station.session.derivation.service import Job, Made
from station.session.fixity.verify import verify
from station.session.leaves.index import IndexUnusable, entries_of, reindex, sessions, update
from station.session.log.steps import decide
from station.session.log.steps import record_run as record
from station.session.terms.parts import RESTORE
from station.session.terms.rules import Scope, edits_of
from station.verdict.same_page import fingerprint
from station.workers.executors import Workers

VOLUME, INDEX, SCAN = "volume", "index", "other.scan"
ANOTHER, RESULTS, EXPORTED = "another", "results", "exported"
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)

Acknowledge = Callable[[], None]


@dataclass(frozen=True)
class Step:
    """A step that is interrupted.

    work          does it in a folder, and acknowledges each of its events when it has returned.
    check         what is wrong with what it left beside the session, after it was done again where it must be;
                  empty for nothing.
    events        that one acknowledgement stands for: a verdict that was missing, a restoration and its verdict.
    outside       whether it leaves the session as it is.
    """

    name: str
    work: Callable[[Path, Acknowledge], None]
    check: Callable[[Path, int], str] = lambda _folder, _acknowledged: ""
    events: int = 1
    outside: bool = False


def prepare(folder: Path) -> None:
    """A session with a restored page, a label and a scan that is not restored; its index; a scan folder of others."""
    folder.mkdir()
    create_session(folder / VOLUME, Volume(title="A volume"))
    with open_session(folder / VOLUME) as writer:
        add_scan(writer, tiny_scan(1), facts={})
        _stage(writer, lambda: None)
        decide(writer, "label", "1r", page=1)
        add_scan(writer, tiny_scan(4), facts={})
    update(folder / INDEX, read_session(folder / VOLUME))
    save_scan(tiny_scan(9), folder / SCAN)


def _in_session(steps: Callable[[Writer, Acknowledge], None]) -> Callable[[Path, Acknowledge], None]:
    def work(folder: Path, acknowledge: Acknowledge) -> None:
        with open_session(folder / VOLUME) as writer:
            steps(writer, acknowledge)

    return work


def _new(folder: Path, acknowledge: Acknowledge) -> None:
    create_session(folder / ANOTHER, Volume(title="Another"))
    acknowledge()


def _check_new(folder: Path, acknowledged: int) -> str:
    made = folder / ANOTHER
    if acknowledged and not made.is_dir():
        return "the session is lost"
    if not made.exists():
        _new(folder, lambda: None)
    return _problems(made)


def _capture(writer: Writer, acknowledge: Acknowledge) -> None:
    add_scan(writer, tiny_scan(2), facts={})
    acknowledge()


def _again(writer: Writer, acknowledge: Acknowledge) -> None:
    add_scan(writer, tiny_scan(3), page=1, facts={})
    acknowledge()


def _stage(writer: Writer, acknowledge: Acknowledge) -> None:
    folder = writer.staging("run")
    run = _restored(folder)
    record(writer, RESTORE, writer.history.event(2), parameters={}, result=run.result, files=folder)
    acknowledge()


def _restored(folder: Path) -> Run:
    """A page of its own in a new folder, as a restoration leaves it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    image = np.full((8, 6, 3), 200, np.uint8)
    (folder / PAGE).write_bytes(cv2.imencode(".png", image)[1].tobytes())
    return Run({"measures": {"fingerprint": fingerprint(image), "smooth_strain_rms": 0.001}})


def _decide(writer: Writer, acknowledge: Acknowledge) -> None:
    decide(writer, "accept", True, page=1, on=writer.history.event(2))
    acknowledge()


def _undo(writer: Writer, acknowledge: Acknowledge) -> None:
    undo(writer)
    acknowledge()
    redo(writer)
    acknowledge()


def _edit(writer: Writer, acknowledge: Acknowledge) -> None:
    """Correct a page and take it back, then record a rule: its restoration is shown again each time."""
    for step in (
        lambda: correct(writer, 1, edits_of({"parts": {"page": {"turn": 1}}})),
        lambda: correct(writer, 1, None),
        lambda: add_rule(writer, Scope(), edits_of({"parts": {"page": {"rotate_deg": 0.5}}})),
    ):
        step()
        acknowledge()


def _shift(writer: Writer, acknowledge: Acknowledge) -> None:
    for step in (_capture, _stage, _decide, _undo):
        step(writer, acknowledge)


def _add(folder: Path, acknowledge: Acknowledge) -> None:
    with open_session(folder / VOLUME) as writer:
        add_original(writer, folder / SCAN)
        acknowledge()


def _index(folder: Path, acknowledge: Acknowledge) -> None:
    update(folder / INDEX, read_session(folder / VOLUME))
    acknowledge()


def _check_index(folder: Path, _acknowledged: int) -> str:
    """What is wrong with the index, as it is or once it is rebuilt."""
    try:
        sessions(folder / INDEX)
    except IndexUnusable as error:
        return str(error)
    reindex(folder / INDEX, [folder])
    entry, _ = entries_of(read_session(folder / VOLUME))
    return "" if sessions(folder / INDEX) == [entry] else "the index is not that of the session"


def _batch(folder: Path, acknowledge: Acknowledge) -> None:
    """A batch whose page is restored by a stand-in, in this process."""

    def submit(_work: object, task: Job, _above_mib: int = 0) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(Made(_restored(task.folder), 0.0, 0.0))
        return future

    workers = nullcontext(Workers(submit, lambda: 1, lambda: 1))
    run_batch(
        [folder / VOLUME], folder / RESULTS, RunOptions(), workers, lambda _event: acknowledge(), now=lambda: NOON
    )


def _check_batch(folder: Path, _acknowledged: int) -> str:
    _batch(folder, lambda: None)
    left = sorted(path.name for path in (folder / RESULTS).iterdir())
    states = [RESTORE in page.runs for page in read_session(folder / VOLUME).history.pages()]
    if left != [REPORT]:
        return f"left with the results: {left}"
    return "" if all(states) else "a page is not restored"


def _export(folder: Path, acknowledge: Acknowledge) -> None:
    deliver(volume_of(read_session(folder / VOLUME)), Format.BAGIT, folder / EXPORTED, now=NOON)
    acknowledge()


def _check_export(folder: Path, acknowledged: int) -> str:
    if acknowledged and not (folder / EXPORTED).is_dir():
        return "the export is lost"
    if not (folder / EXPORTED).exists():
        _export(folder, lambda: None)
    problems = check_export(folder / EXPORTED)
    return problems[0].text if problems else ""


def _problems(session: Path) -> str:
    """The first problem that `verify` finds, empty for none."""
    problems: Sequence[Any] = verify(session).problems
    return problems[0].text if problems else ""


STEPS = (
    Step("new", _new, _check_new, outside=True),
    Step("capture", _in_session(_capture)),
    Step("again", _in_session(_again)),
    Step("stage", _in_session(_stage)),
    Step("decide", _in_session(_decide)),
    Step("undo", _in_session(_undo)),
    Step("edit", _in_session(_edit)),
    Step("shift", _in_session(_shift)),
    Step("add", _add),
    Step("index", _index, _check_index, outside=True),
    Step("batch", _batch, _check_batch, events=3),
    Step("export", _export, _check_export, outside=True),
)
