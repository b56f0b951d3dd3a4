"""Sessions after a power cut: nothing acknowledged is lost, every checksum holds, and the order of flushes is kept."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from oracles.power_cut import Disk, watched
from station.session import Writer, add_scan, open_session, read_session, undo
from station.session.fixity.verify import verify
from station.session.log import bag
from station.session.log.steps import decide, record_run
from station.storage.folder_lock import WORK

DRAWS = 2  # random states of the disk at each point, beside the one with nothing but what was flushed


def stage(writer: Writer) -> None:
    folder = writer.staging("run")
    folder.mkdir()
    (folder / "page.txt").write_bytes(b"a page" * 100)
    record_run(writer, "restore", writer.history.event(2), parameters={}, result={}, files=folder)


STEPS: dict[str, Callable[[Writer], object]] = {
    "stage": stage,
    "decide": lambda writer: decide(writer, "label", "1r", page=1),
    "undo": undo,
}


def check(state: Path, acknowledged: tuple[bytes, ...]) -> None:
    """What must hold in a session that is opened after a power cut."""
    assert [event.line for event in read_session(state).history.events[: len(acknowledged)]] == list(acknowledged)
    with open_session(state) as writer:
        events = writer.history.events
    assert [event.line for event in events[: len(acknowledged)]] == list(acknowledged)
    assert len(events) <= len(acknowledged) + 1
    assert verify(state).problems == ()
    assert not (state / WORK).exists()


@pytest.mark.parametrize("name", STEPS)
def test_nothing_acknowledged_is_lost_at_any_point(volume, tiny_scan, tmp_path, name):
    random, states = np.random.default_rng(3), list[str]()
    with open_session(volume) as writer:
        add_scan(writer, tiny_scan, facts={})
        acknowledged = tuple(event.line for event in writer.history.events)

        def look(disk: Disk, event: str, _arguments: object) -> None:
            for draw in [None, *[random] * DRAWS]:
                state = tmp_path / f"state-{len(states)}"
                disk.write(state, draw)
                states.append(event)

        with watched(volume, look):
            STEPS[name](writer)
    for number in range(len(states)):
        check(tmp_path / f"state-{number}", acknowledged)
        shutil.rmtree(tmp_path / f"state-{number}")
    assert {"open", "os.rename", "fsync"} <= set(states)


@pytest.mark.parametrize("name", STEPS)
def test_files_are_flushed_then_renamed_then_their_folder_is_flushed(volume, tiny_scan, name):
    renamed = []

    def look(disk: Disk, event: str, arguments: tuple) -> None:
        if event == "os.rename" and WORK not in os.fspath(arguments[1]):
            source = Path(arguments[0])
            assert disk.is_durable(source), f"{source} is renamed before it was flushed"
            renamed.append(Path(arguments[1]))

    with open_session(volume) as writer:
        add_scan(writer, tiny_scan, facts={})
        with watched(volume, look) as disk:
            STEPS[name](writer)
            assert disk.is_durable(volume, without=frozenset({WORK})), "acknowledged before it was flushed"
    assert [path.parent.name for path in renamed] == [bag.PAYLOAD, volume.name]


def test_the_model_finds_a_missing_flush(volume, tiny_scan, monkeypatch):
    monkeypatch.setattr("station.session.log.store.sync_folder", lambda folder: None)
    with open_session(volume) as writer, watched(volume, lambda *_: None) as disk:
        add_scan(writer, tiny_scan, facts={})
        assert not disk.is_durable(volume, without=frozenset({WORK}))
