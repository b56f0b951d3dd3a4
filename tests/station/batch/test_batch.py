"""`planish batch` over real scans: each is restored once or set aside once, and the next batch finds it done."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from station.batch.executors import local_workers
from station.batch.folders import FolderBatch
from station.batch.process import Limits
from station.batch.whole import run_batch
from station.cli import main
from station.errors import FolderInUse, UsageError
from station.export.atomic import claim_folder
from tests.station.batch.conftest import QUICK, small_scan

PAGES = ["a/a.png", "b/b.png", "sub/a/a.png", "sub/c/c.png"]
OPTIONS = ["--points", "100", "--dpi", "40"]


def pages(out: Path) -> list[str]:
    return sorted(str(path.relative_to(out)) for path in out.rglob("*.png"))


def folders(scans: Path, out: Path, events: list, workers: int = 2) -> Path:
    return run_batch([scans], out, QUICK, local_workers(workers, Limits()), events.append)


def test_every_scan_is_restored_or_set_aside_once(scans, tmp_path) -> None:
    out, events = tmp_path / "out", []
    before = {path: path.read_bytes() for path in scans.rglob("*") if path.is_file()}
    report = folders(scans, out, events)
    assert pages(out) == PAGES
    assert sorted((event.state, event.name) for event in events) == [
        ("restored", "a.ply"),
        ("restored", "b.ply"),
        ("restored", "sub/a.ply"),
        ("restored", "sub/c.ply"),
        ("set aside", "broken.ply"),
    ]
    assert events[-1].progress.startswith("5 of 5")
    assert {path: path.read_bytes() for path in scans.rglob("*") if path.is_file()} == before
    html = report.read_text()
    assert html.index("broken.ply") < html.index("sub/c.ply")
    assert html.count("<img") == 4
    assert [path.name for path in out.iterdir() if path.name.startswith(".")] == []
    again: list = []
    folders(scans, out, again)
    assert again == []


def test_options_are_checked_before_anything_else(scans, tmp_path, capsys) -> None:
    out = str(tmp_path / "out")
    assert main(["batch", str(scans), "-o", out, "--dpi", "1"]) == 2
    assert main(["batch", str(tmp_path / "nothing"), "-o", out]) == 2
    assert main(["batch", str(scans), "-o", out, "--workers", "2", "--scheduler", "tcp://127.0.0.1:1"]) == 2
    assert not (tmp_path / "out").exists()


def test_two_batches_do_not_write_to_one_folder(scans, tmp_path) -> None:
    with claim_folder(tmp_path / "out"), pytest.raises(FolderInUse):
        folders(scans, tmp_path / "out", [])


def test_two_folders_of_one_name_are_refused(scans, tmp_path) -> None:
    with pytest.raises(UsageError, match="same name"):
        FolderBatch([scans, tmp_path / "x/scans"], tmp_path / "out", QUICK)


@pytest.mark.parametrize("number", [signal.SIGKILL])
def test_a_batch_that_is_stopped_goes_on_where_it_was(scans, tmp_path, number) -> None:
    out = tmp_path / "out"
    for seed in range(6):
        small_scan(scans / f"more{seed}.ply", 10 + seed)
    words = [sys.executable, "-m", "station", "batch", str(scans), "-o", str(out), "-w", "2", *OPTIONS]
    batch = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while len(reports(out)) < 3 and batch.poll() is None:
        time.sleep(0.02)
    os.kill(batch.pid, number)
    assert batch.wait() == (-number if number == signal.SIGKILL else 128 + number)
    first = reports(out)
    assert 3 <= len(first) < 10
    assert main(["batch", str(scans), "-o", str(out), "-w", "2", *OPTIONS]) == 0
    second = reports(out)
    assert len(second) == 10
    assert {path: second[path] for path in first} == first  # none of them was restored again
    assert sum("2" in path.parent.name for path in second) == sum("2" in path.name for path in second)
    assert not list(out.rglob("*.attempt"))


def reports(out: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in out.rglob("*.json") if ".planish-run" not in str(path)}
