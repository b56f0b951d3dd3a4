"""Records are written by many processes at once, into folders that others remove when they are empty."""

from __future__ import annotations

import threading
from datetime import UTC, datetime
from pathlib import Path

from restore import PageEdits
from station.intake import records
from station.intake.arrival import Arrival
from station.intake.listing import list_files
from station.intake.once import restore_once
from station.run.options import RunOptions

ROUNDS, THREADS = 50, 8


def arrival_of(folder: Path, name: str) -> Arrival:
    (folder / name).write_bytes(name.encode())
    return Arrival.of(folder, Path(name), {}, list_files(folder, without=folder))


def test_attempts_of_many_scans_do_not_disturb_each_other(tmp_path) -> None:
    (tmp_path / "in").mkdir()
    arrivals = [arrival_of(tmp_path / "in", f"{number}.glb") for number in range(THREADS)]
    faults = []

    def work(arrival: Arrival) -> None:
        try:
            for _ in range(ROUNDS):
                assert records.begin_attempt(tmp_path / "out", arrival, "0" * 64) == 0
                records.end_attempt(tmp_path / "out", arrival)
        except BaseException as error:
            faults.append(error)

    threads = [threading.Thread(target=work, args=(arrival,)) for arrival in arrivals]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert faults == []
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").rglob("*"))


def test_the_reason_names_how_earlier_processes_ended(tmp_path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "staged").mkdir()
    arrival = arrival_of(tmp_path / "in", "a.glb")
    digest = arrival.copy(tmp_path / "staged")
    (tmp_path / "staged/a.glb").unlink()
    for _ in range(2):
        records.begin_attempt(tmp_path / "out", arrival, digest)

    def restore(*_, **__):
        raise AssertionError("it is not tried a third time")

    settled = restore_once(
        arrival,
        tmp_path / "out",
        RunOptions(),
        tmp_path / "staged",
        restore,
        now=lambda: datetime(2026, 3, 4, tzinfo=UTC),
        causes=("SIGSEGV", "SIGSEGV"),
    )
    assert settled.state == "set aside"
    assert settled.reason == "the program has ended 2 times while it restored this scan: SIGSEGV"
    assert records.failed_digest(tmp_path / "out", arrival) == digest


def test_corrections_are_used_and_a_change_of_them_restores_again(tmp_path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in/a.glb").write_bytes(b"a")
    seen = []

    def restore(source, destination, options, **_):
        seen.append(options.edits)
        raise ValueError("there is no page in it")

    for number, layout in enumerate(("split", "split", "whole")):
        (tmp_path / "in/a.edits.json").write_text(f'{{"layout": "{layout}"}}')
        listing = list_files(tmp_path / "in", without=tmp_path / "in")
        edits = {"a.edits.json": Path("a.edits.json")}
        arrival = Arrival.of(tmp_path / "in", Path("a.glb"), edits, listing)
        (tmp_path / str(number)).mkdir()
        restore_once(arrival, tmp_path / "out", RunOptions(), tmp_path / str(number), restore)
    assert seen == [PageEdits(layout="split"), PageEdits(layout="whole")]
    (tmp_path / "in/a.edits.json").write_text("[]")
    arrival = Arrival.of(tmp_path / "in", Path("a.glb"), edits, list_files(tmp_path / "in", without=tmp_path / "in"))
    (tmp_path / "last").mkdir()
    settled = restore_once(arrival, tmp_path / "out", RunOptions(), tmp_path / "last", restore)
    assert (settled.state, len(seen)) == ("set aside", 2)
    assert "a.edits.json" in settled.reason
