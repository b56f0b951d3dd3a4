"""Pages of sessions: restored once by workers, recorded by the one writer, set aside with the reason."""

from __future__ import annotations

import pytest

from station.archive.from_session import volume_of
from station.archive.volume import Role
from station.batch.executors import local_workers
from station.batch.process import Limits
from station.batch.whole import REPORT, run_batch
from station.session import Volume, add_files, create_session, open_session, read_session
from station.session.adding import add_original
from station.session.presets import Preset
from station.session.stages import RESTORE
from tests.station.batch.conftest import QUICK, small_scan


@pytest.fixture
def session(tmp_path):
    """A session of three small scans and one that is damaged."""
    preset = Preset(settings={"points": 100, "dpi": 40}).model_dump(mode="json", exclude_none=True)
    create_session(tmp_path / "book", Volume(title="A book", settings=preset))
    with open_session(tmp_path / "book") as writer:
        for seed in range(3):
            add_original(writer, small_scan(tmp_path / f"scans/{seed}.ply", seed))
        broken = tmp_path / "scans/broken.ply"
        broken.write_bytes(b"ply\nformat ascii 1.0\nend_header\n")
        add_files(writer, {broken.name: broken}, broken.name, facts={})
    return tmp_path / "book"


def batch(session, out, events, options=QUICK):
    return run_batch([session], out, options, local_workers(2, Limits()), events.append)


def restored(session) -> list[int]:
    runs = {page.number: page.runs.get(RESTORE) for page in read_session(session).history.pages()}
    return [number for number, run in runs.items() if run is not None and "error" not in run.facts["result"]]


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
