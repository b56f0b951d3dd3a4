"""Tasks are handed out in their order, no more at a time than is wanted, and lost workers are made up for."""

from __future__ import annotations

import sys
from concurrent.futures import CancelledError, Future

import pytest

from station.batch.run_tasks import MAX_LOST, run
from station.errors import UsageError
from station.workers.executors import ClusterGone, Workers, cluster_workers
from station.workers.process import Limits


class KilledWorker(Exception):
    """Named as that of Dask."""


class Hands:
    """Does a task at once, in its order. faults: task → what its tries raise, in turn."""

    def __init__(self, faults=None) -> None:
        self.faults, self.order, self.most = faults or {}, [], 0
        self.open: list[Future] = []

    def submit(self, work, task, above_mib=0) -> Future:
        self.order.append(task)
        future: Future = Future()
        if self.faults.get(task):
            future.set_exception(self.faults[task].pop(0))
        else:
            future.set_result(work(task, ()))
        return future


def workers(hands: Hands, in_flight: int = 2) -> Workers:
    return Workers(hands.submit, lambda: in_flight, lambda: in_flight)


def square(number: int, causes: tuple[str, ...]) -> int:
    return number * number


def test_every_task_has_its_result_in_the_order_given() -> None:
    hands = Hands()
    assert dict(run([3, 1, 2], workers(hands), square)) == {3: 9, 1: 1, 2: 4}
    assert hands.order == [3, 1, 2]


def test_no_more_are_handed_out_than_wanted() -> None:
    hands = Hands()
    results = run(range(10), workers(hands, 2), square)
    next(results)
    assert len(hands.order) == 2


def test_a_lost_worker_costs_no_page() -> None:
    hands = Hands({1: [KilledWorker("w"), KilledWorker("w")]})
    assert dict(run([1, 2], workers(hands), square)) == {1: 1, 2: 4}
    assert hands.order.count(1) == 3


def test_a_page_that_loses_worker_after_worker_ends_the_batch() -> None:
    hands = Hands({1: [KilledWorker("w")] * MAX_LOST})
    with pytest.raises(ClusterGone, match="has lost"):
        list(run([1], workers(hands), square))


def test_a_scheduler_that_is_gone_is_named() -> None:
    with pytest.raises(ClusterGone, match="does not answer") as raised:
        list(run([1], workers(Hands({1: [CancelledError()]})), square))
    assert "goes on where it was" in raised.value.hint


def test_a_client_that_is_closed_is_named() -> None:
    def submit(*_):
        raise RuntimeError("closed")

    with pytest.raises(ClusterGone):
        list(run([1], Workers(submit, lambda: 1, lambda: 1), square))


def test_a_fault_that_is_not_the_pages_ends_the_batch() -> None:
    with pytest.raises(UsageError, match="dpi"):
        list(run([1, 2], workers(Hands({2: [UsageError("dpi")]})), square))


def test_a_cluster_without_the_extra_says_what_to_install(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match="not installed") as raised, cluster_workers("tcp://127.0.0.1:9", Limits()):
        pass
    assert "planish[cluster]" in raised.value.hint
