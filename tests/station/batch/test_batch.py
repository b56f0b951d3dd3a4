"""`planish batch` over real scans: interrupted, killed and started again, it restores every page once."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from station.batch.folders import FolderBatch
from station.batch.runner import NO_LIMITS, REPORT, run_batch
from station.cli import main
from station.errors import FolderInUse, UsageError
from station.storage.atomic import lock_output_folder
from station.workers.executors import local_workers
from station.workers.process import Limits
from tests.station.batch.conftest import QUICK, small_scan

PAGES = ["a/a.png", "b/b.png", "sub/a/a.png", "sub/c/c.png"]
OPTIONS = ["--points", "100", "--dpi", "40"]


def pages(out: Path) -> list[str]:
    return sorted(str(path.relative_to(out)) for path in out.rglob("*.png"))


def folders(scans: Path, out: Path, events: list, workers: int = 2) -> Path:
    return run_batch([scans], out, QUICK, local_workers(workers, Limits()), events.append).report


@pytest.mark.usefixtures("in_process")
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
    assert events[-1].done.fraction == 1.0
    assert {path: path.read_bytes() for path in scans.rglob("*") if path.is_file()} == before
    html = report.read_text()
    assert html.index("broken.ply") < html.index("sub/c.ply")
    assert html.count("<img") == 2 * 4  # the scan and its page
    assert [path.name for path in out.iterdir() if path.name.startswith(".")] == [".planish-plan"]
    again: list = []
    folders(scans, out, again)
    assert again == []


def test_the_command_prints_what_became_of_each_page(scans, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    assert main(["batch", str(scans), "-o", str(out), "-j", "1", *OPTIONS]) == 7
    lines = capsys.readouterr().out.splitlines()
    assert lines[-2:] == ["4 restored, 1 set aside", f"report     {out / REPORT}"]
    assert f"restored   a.ply: {out / 'a'}" in "\n".join(lines)


@pytest.mark.usefixtures("in_process")
def test_a_batch_with_pages_set_aside_ends_with_a_code_of_its_own(scans, tmp_path, capsys) -> None:
    words = ["batch", str(scans), "-o", str(tmp_path / "out"), "-j", "1", "--json", *OPTIONS]
    for restored in (4, 0):  # and again when nothing was left to do
        assert main(words) == 7
        reported = json.loads(capsys.readouterr().out.splitlines()[-1])
        assert (reported["counts"].get("restored", 0), reported["pages"]) == (restored, 5)
        assert [page["name"] for page in reported["set_aside"]] == ["broken.ply"]
        assert reported["set_aside"][0]["reasons"]
    (scans / "broken.ply").unlink()
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)["set_aside"] == []


@pytest.mark.usefixtures("in_process")
def test_a_source_that_is_called_like_the_report_loses_neither(scans, tmp_path) -> None:
    small_scan(tmp_path / "report.html/a.ply", 9)
    sources = [scans, tmp_path / "report.html"]
    finished = run_batch(sources, tmp_path / "out", QUICK, local_workers(1, Limits()), lambda _: None)
    assert finished.report.name == "report-2.html"
    assert finished.report.is_file()
    assert (tmp_path / "out/report.html/a/a.png").is_file()


def test_options_are_checked_before_anything_else(scans, tmp_path, capsys) -> None:
    out = str(tmp_path / "out")
    assert main(["batch", str(scans), "-o", out, "--dpi", "1"]) == 2
    assert main(["batch", str(tmp_path / "nothing"), "-o", out]) == 2
    assert main(["batch", str(scans), "-o", out, "--jobs", "2", "--scheduler", "tcp://127.0.0.1:1"]) == 2
    for option in (
        ("--page-timeout", "inf"),
        ("--page-timeout", "nan"),
        ("--memory-limit", "1"),
        ("--memory-limit", "9" * 20),
    ):
        assert main(["batch", str(scans), "-o", out, *option]) == 2
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("in_process")
def test_a_source_that_is_named_twice_is_taken_once(scans, tmp_path, capsys) -> None:
    words = ["batch", str(scans), f"{scans}/.", "-o", str(tmp_path / "out"), "-j", "1000000", *OPTIONS]
    assert main(words) == 7
    assert capsys.readouterr().out.splitlines()[-2] == "4 restored, 1 set aside"


@pytest.mark.usefixtures("in_process")
def test_several_folders_have_results_of_their_own(scans, tmp_path) -> None:
    small_scan(tmp_path / "more/a.ply", 9)
    run_batch([scans, tmp_path / "more"], tmp_path / "out", QUICK, local_workers(1, Limits()), lambda _: None)
    assert pages(tmp_path / "out") == sorted(["more/a/a.png", *(f"scans/{page}" for page in PAGES)])
    with pytest.raises(UsageError, match="same name"):
        FolderBatch([scans, tmp_path / "x/scans"], tmp_path / "o", QUICK, NO_LIMITS)


def test_two_batches_do_not_write_to_one_folder(scans, tmp_path) -> None:
    with lock_output_folder(tmp_path / "out"), pytest.raises(FolderInUse):
        folders(scans, tmp_path / "out", [])


@pytest.mark.parametrize("number", [pytest.param(signal.SIGKILL, marks=pytest.mark.slow), signal.SIGINT])
def test_a_batch_that_is_stopped_goes_on_where_it_was(scans, tmp_path, number, request) -> None:
    out = tmp_path / "out"
    for seed in range(6):
        small_scan(scans / f"more{seed}.ply", 10 + seed)
    words = [sys.executable, "-m", "station", "batch", str(scans), "-o", str(out), "-j", "2", *OPTIONS]
    batch = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while len(reports(out)) < 3 and batch.poll() is None:
        time.sleep(0.02)
    os.kill(batch.pid, number)
    assert batch.wait() == (-number if number == signal.SIGKILL else 128 + number)
    first = reports(out)
    assert 3 <= len(first) < 10
    request.getfixturevalue("in_process")
    assert main(["batch", str(scans), "-o", str(out), "-j", "2", *OPTIONS]) == 7  # broken.ply
    second = reports(out)
    assert len(second) == 10
    assert {path: second[path] for path in first} == first  # none of them was restored again
    assert sum("2" in path.parent.name for path in second) == sum("2" in path.name for path in second)
    assert not list(out.rglob("*.attempt"))


def reports(out: Path) -> dict[Path, bytes]:
    """The reports of the pages; folders come and go while the batch, or a worker of one that was killed, runs."""
    found = (path for pattern in ("*/*.json", "sub/*/*.json") for path in out.glob(pattern))
    try:
        return {path: path.read_bytes() for path in found if ".planish-run" not in path.parts}
    except FileNotFoundError:
        return reports(out)


@pytest.mark.usefixtures("in_process")
def test_a_report_names_its_scan(scans, tmp_path) -> None:
    folders(scans, tmp_path / "out", [])
    report = json.loads((tmp_path / "out/sub/c/c.json").read_text())
    assert report["arrival"]["scan"] == "sub/c.ply"
