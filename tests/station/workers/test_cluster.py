"""Which workers of a cluster restore a page: a client that tells what a scheduler would, and no network."""

from __future__ import annotations

from concurrent.futures import Future
from importlib.util import find_spec
from typing import Any

import pytest

from station.workers import cluster as module
from station.workers.cluster import PACKAGE, Cluster, ClusterGone, ShortOfMemory
from station.workers.executors import Workers
from station.workers.process import Limits

GIB = 2**30


class Client:
    """A scheduler with workers: address → threads, bytes of memory, whether the package is there."""

    def __init__(self, **workers: tuple[int, int, bool]) -> None:
        self.workers, self.submitted = workers, list[dict[str, Any]]()

    def scheduler_info(self) -> dict[str, Any]:
        if not self.workers:
            return {"workers": {}}
        return {"workers": {name: {"nthreads": n, "memory_limit": b} for name, (n, b, _) in self.workers.items()}}

    def run(self, function, package, *, workers, on_error):
        assert (function, package, on_error) == (find_spec, PACKAGE, "return")
        whole = find_spec("json")
        return {name: whole if self.workers[name][2] else ModuleNotFoundError(package) for name in workers}

    def get_executor(self, **_options: object) -> Client:
        return self

    def submit(self, _function, _work, _task, **keywords: Any) -> Future[Any]:
        self.submitted.append(keywords)
        return Future()


def cluster(client: Client, said: list[str] | None = None, limits: Limits = Limits()) -> Cluster:  # noqa: B008
    return Cluster(client, limits, [].append if said is None else said.append)


@pytest.fixture
def clock(monkeypatch) -> list[float]:
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(module.time, "sleep", lambda seconds: now.__setitem__(0, now[0] + seconds))
    return now


def test_pages_go_to_the_workers_that_have_memory_and_the_package():
    client = Client(good=(2, 4 * GIB, True), small=(4, GIB, True), bare=(2, 4 * GIB, False))
    made = cluster(client)
    assert made.wait_for_threads() == made.threads() == 2
    made.submit(print, "page")
    assert client.submitted[-1]["workers"] == ["good"]
    assert client.submitted[-1]["is_last"]


def test_a_page_that_was_short_of_memory_is_tried_where_there_is_more():
    client = Client(a=(1, GIB, True), b=(1, 4 * GIB, True), c=(1, 0, True))
    made = cluster(client)
    made.wait_for_threads()
    made.submit(print, "page")
    assert "workers" not in client.submitted[-1]
    assert not client.submitted[-1]["is_last"]
    made.submit(print, "page", above_mib=1024)
    assert client.submitted[-1]["workers"] == ["b", "c"]
    made.submit(print, "page", above_mib=4096)
    assert (client.submitted[-1]["workers"], client.submitted[-1]["is_last"]) == (["c"], True)


def test_the_largest_worker_is_the_last():
    client = Client(a=(1, GIB, True), b=(1, 4 * GIB, True))
    made = cluster(client)
    made.wait_for_threads()
    made.submit(print, "page", above_mib=4096)
    assert client.submitted[-1]["is_last"]


def test_without_a_worker_the_reasons_are_said_after_half_a_minute(clock):
    said: list[str] = []
    client = Client(small=(4, GIB, True), bare=(2, 4 * GIB, False))
    made = cluster(client, said)
    made.threads()
    assert said == []
    clock[0] += 31.0
    made.threads()
    made.threads()
    (text,) = said
    assert "small: it has 256 MiB" in text
    assert "bare: planish is not installed there" in text
    client.workers["late"] = (3, 6 * GIB, True)
    assert made.wait_for_threads() == 3


def test_a_worker_that_was_started_again_takes_over_what_the_old_one_had(clock):
    client = Client(good=(1, 4 * GIB, True), bare=(1, 4 * GIB, False))
    made = cluster(client)
    made.wait_for_threads()
    future = made.submit(print, "page")
    assert made.stranded([future, Future()]) == []
    del client.workers["good"]
    client.workers["again"] = (1, 4 * GIB, True)
    clock[0] += 11.0
    assert made.stranded([future, Future()]) == [future]


def test_a_scheduler_that_is_gone_is_named(monkeypatch):
    client = Client()
    monkeypatch.setattr(client, "scheduler_info", lambda: (_ for _ in ()).throw(OSError("gone")))
    with pytest.raises(ClusterGone, match="does not answer"):
        cluster(client).threads()


def test_tasks_that_were_short_of_memory_or_stranded_are_given_again():
    from station.batch.run_tasks import run

    asked: list[int] = []
    first = Future[str]()

    def submit(_work, _task, above_mib=0):
        asked.append(above_mib)
        if len(asked) == 1:
            return first  # never ends: its worker has gone
        future = Future[str]()
        if len(asked) == 2:
            future.set_exception(ShortOfMemory(700))
        else:
            future.set_result("restored")
        return future

    workers = Workers(submit, lambda: 1, lambda: 1, lambda futures: [one for one in futures if one is first])
    from station.batch import run_tasks

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run_tasks, "POLL_S", 0.01)
        assert list(run(["page"], workers, print)) == [("page", "restored")]
    assert asked == [0, 0, 700]
