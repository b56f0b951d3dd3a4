"""A Dask cluster of a scheduler and two workers, each a process: workers and scheduler may be killed at any time."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest

from station.batch.run_tasks import run
from station.cli import main
from station.workers.executors import ClusterGone, cluster_workers
from station.workers.process import Limits
from tests.station.batch.conftest import small_scan
from tests.station.workers import work

pytest.importorskip("distributed", reason="needs the extra cluster: dask.distributed")

OPTIONS = ["--points", "100", "--dpi", "40"]
PAGES = 12
# Of dask's configuration: a lost connection is given up after seconds, not after half a minute.
QUICK = {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "10s"}


class Cluster:
    """A scheduler and workers; everything that they start is ended with them."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.processes = folder, list[subprocess.Popen]()
        self.file = folder / "scheduler.json"

    def start(self, *words: str) -> subprocess.Popen:
        log = (self.folder / f"{len(self.processes)}.log").open("wb")
        with log:
            process = subprocess.Popen(
                [sys.executable, "-m", "dask", *words], stdout=log, stderr=log, env=os.environ | QUICK, cwd=Path.cwd()
            )
        self.processes.append(process)
        return process

    def start_scheduler(self) -> subprocess.Popen:
        self.file.unlink(missing_ok=True)
        scheduler = self.start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(self.file)
        )
        while not (self.file.exists() and self.file.read_text().rstrip().endswith("}")):  # it is written in pieces
            assert scheduler.poll() is None
            time.sleep(0.05)
        return scheduler

    def start_worker(self) -> subprocess.Popen:
        return self.start(
            "worker", "--scheduler-file", str(self.file), "--nthreads", "1", "--no-nanny", "--no-dashboard",
            "--local-directory", str(self.folder),
        )  # fmt: skip

    @property
    def address(self) -> str:
        import json

        return str(json.loads(self.file.read_text())["address"])

    def stop(self) -> None:
        for process in self.processes:
            kill_tree(process)


def kill_tree(process: subprocess.Popen) -> None:
    with_children = [process]
    if psutil.pid_exists(process.pid):
        with_children += psutil.Process(process.pid).children(recursive=True)
    for one in with_children:
        if psutil.pid_exists(one.pid):
            one.kill()
    process.wait()


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[Cluster]:
    made = Cluster(folder)
    try:
        made.start_scheduler()
        for _ in range(workers):
            made.start_worker()
        yield made
    finally:
        made.stop()


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "cluster").mkdir()
    return tmp_path / "cluster"


@pytest.fixture
def many(tmp_path: Path) -> Path:
    for seed in range(PAGES):
        small_scan(tmp_path / f"scans/page{seed:02}.ply", seed)
    return tmp_path / "scans"


def reports(out: Path) -> dict[Path, bytes]:
    """The reports of the pages; hidden folders come and go while the batch runs."""
    return {path: path.read_bytes() for path in out.glob("page*/*.json")}


def batch(scans: Path, out: Path, address: str) -> subprocess.Popen:
    words = [sys.executable, "-m", "station", "batch", str(scans), "-o", str(out), "--scheduler", address, *OPTIONS]
    log = (out.parent / "batch.log").open("ab")
    with log:
        return subprocess.Popen(words, stdout=log, stderr=log, env=os.environ | QUICK)


def wait_for_reports(out: Path, count: int, process: subprocess.Popen) -> None:
    while len(reports(out)) < count:
        assert process.poll() is None, (out.parent / "batch.log").read_text()
        time.sleep(0.02)


def test_a_crash_on_a_worker_costs_one_page_and_no_worker(place) -> None:
    with cluster(place, 1) as made, cluster_workers(made.address, Limits()) as workers:
        results = dict(run(range(3), workers, work.crash_on_odd))
        assert all(process.poll() is None for process in made.processes)
    assert results == {0: "restored", 1: "set aside", 2: "restored"}


@pytest.mark.slow
def test_a_worker_that_is_killed_loses_no_page_and_none_is_restored_twice(place, many, tmp_path) -> None:
    out = tmp_path / "out"
    with cluster(place, 2) as made:
        process = batch(many, out, made.address)
        wait_for_reports(out, 3, process)
        made.processes[1].kill()  # not its children: they end by themselves
        before = reports(out)
        assert process.wait() == 0, (tmp_path / "batch.log").read_text()
    after = reports(out)
    assert sorted(path.parent.name for path in after) == [f"page{seed:02}" for seed in range(PAGES)]
    assert {path: after[path] for path in before} == before
    printed = [line.split()[1] for line in (tmp_path / "batch.log").read_text().splitlines() if ".ply: " in line]
    assert sorted(printed) == [f"page{seed:02}.ply:" for seed in range(PAGES)]
    assert not list(out.rglob("*.attempt"))


@pytest.mark.slow
def test_a_scheduler_that_is_killed_ends_the_batch_and_the_next_one_goes_on(place, many, tmp_path, capfd) -> None:
    out = tmp_path / "out"
    with cluster(place, 2) as made:
        process = batch(many, out, made.address)
        wait_for_reports(out, 3, process)
        made.processes[0].kill()
        assert process.wait() == 4
        assert "goes on where it was" in (tmp_path / "batch.log").read_text()
        for worker in made.processes[1:]:
            kill_tree(worker)
        before = reports(out)
        assert len(before) < PAGES
        made.start_scheduler()
        made.start_worker()
        assert main(["batch", str(many), "-o", str(out), "--scheduler", made.address, *OPTIONS]) == 0
    after = reports(out)
    assert sorted(path.parent.name for path in after) == [f"page{seed:02}" for seed in range(PAGES)]
    assert {path: after[path] for path in before} == before


def test_an_address_where_nothing_answers_is_reported(tmp_path) -> None:
    """In a process of its own, which dask's thread of a client that never connected does not outlive."""
    small_scan(tmp_path / "scans/page.ply", 1)
    words = ["batch", str(tmp_path / "scans"), "-o", str(tmp_path / "out"), "--scheduler", "tcp://127.0.0.1:9"]
    program = (
        "import sys, station.workers.executors as executors; from station.cli import main; executors.CONNECT_S = 1.0; "
        f"sys.exit(main({words!r}))"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert ended.returncode == ClusterGone.exit_code
    assert "no scheduler answers" in ended.stderr
