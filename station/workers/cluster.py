"""The workers of a Dask cluster.

Which of them can restore a page, and what each has of memory for it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any
from weakref import WeakKeyDictionary

from drivers import ScannerError
from station.errors import StationError
from station.workers.process import Isolation, Limits, MemoryFull, Result, Work

MIN_MIB = 512  # in less a process cannot even load its libraries
REFRESH_S = 10.0
WAIT_S = 1.0  # between two looks while no worker can be used
SAY_S = 30.0  # without one that can be used, until the reasons are said
PACKAGE = "station.workers.process"
GONE = "the cluster's scheduler does not answer any more"
RESUME = "run the same command again: it goes on where it was"


class ClusterGone(StationError):
    """Raised when a cluster's scheduler cannot be reached."""

    exit_code = ScannerError.exit_code


class ShortOfMemory(Exception):
    """The memory of a worker of a cluster is too small for a page.

    mib: what the page had there.
    """

    def __init__(self, mib: int) -> None:
        super().__init__(mib)
        self.mib = mib


@dataclass(frozen=True)
class Place:
    """Worker of a cluster.

    Its threads, the memory of each in MiB (0: no limit), and why it cannot be used, empty when it can.
    """

    threads: int
    mib: int
    problem: str = ""

    def has_more_than(self, mib: int) -> bool:
        """Whether a page has more memory there."""
        return not self.problem and (not mib or not self.mib or self.mib > mib)


class Cluster:
    """The workers of a cluster, which come and go; the scheduler is asked now and then.

    client: of distributed. limits: of the processes of pages. say: called with the reasons when none can be used.
    """

    def __init__(self, client: Any, limits: Limits, say: Callable[[str], None]) -> None:
        self._client, self._limits, self._say = client, limits, say
        self._executor: Any = client.get_executor(pure=False)
        self._places: dict[str, Place] = {}
        self._given = WeakKeyDictionary[Future[Any], frozenset[str]]()  # to some workers only
        self._asked, self._without_since, self._is_said = -REFRESH_S, time.monotonic(), False

    def submit(self, work: Work[Any], task: Any, above_mib: int = 0) -> Future[Any]:
        """Hand out a task to the workers that can restore it.

        They have more memory than was too little before.
        """
        larger = [address for address, place in self._places.items() if place.has_more_than(above_mib)]
        usable = larger or [address for address, place in self._places.items() if not place.problem]
        keywords: dict[str, Any] = {"limits": self._limits, "is_last": not larger or self._is_largest(larger)}
        if len(usable) < len(self._places):
            keywords["workers"] = usable
        future: Future[Any] = self._executor.submit(run_on_worker, work, task, **keywords)
        if "workers" in keywords:
            self._given[future] = frozenset(usable)
        return future

    def threads(self) -> int:
        """How many pages are restored at a time, at least 1. Raises ClusterGone."""
        self._look()
        return max(self._threads(), 1)

    def wait_for_threads(self) -> int:
        """The same, as soon as there is a worker that can be used. Raises ClusterGone."""
        self._look()
        while not self._threads():
            time.sleep(WAIT_S)
            self._asked = -REFRESH_S
            self._look()
        return self._threads()

    def stranded(self, futures: Iterable[Future[Any]]) -> list[Future[Any]]:
        """Return the futures of workers which have all gone.

        A worker that is started again has another address.
        """
        self._look()
        here = {address for address, place in self._places.items() if not place.problem}
        return [one for one in futures if (given := self._given.get(one)) is not None and not given & here]

    def _threads(self) -> int:
        return sum(place.threads for place in self._places.values() if not place.problem)

    def _is_largest(self, addresses: Iterable[str]) -> bool:
        """Return whether none of the workers has more memory than another.

        A page then needs not be tried elsewhere.
        """
        return len({self._places[address].mib for address in addresses}) == 1

    def _look(self) -> None:
        if time.monotonic() - self._asked < REFRESH_S:
            return
        try:
            found = self._client.scheduler_info()["workers"]
            new = [address for address in found if address not in self._places]
            # Whether the package is there is asked in words of the standard library: nothing else would be understood.
            specs = self._client.run(find_spec, PACKAGE, workers=new, on_error="return") if new else {}
        except (OSError, TimeoutError) as error:
            raise ClusterGone(GONE, RESUME) from error
        known = {address: place for address, place in self._places.items() if address in found}
        self._places = known | {address: self._place(found[address], specs.get(address)) for address in new}
        self._asked = time.monotonic()
        self._report_missing()

    def _place(self, worker: Any, spec: object) -> Place:
        threads = int(worker["nthreads"])
        given = int(worker.get("memory_limit") or 0) // max(threads, 1) // 2**20
        mib = given if self._limits.memory_mib is None else self._limits.memory_mib
        problem = ""
        if spec is None or isinstance(spec, BaseException):
            problem = "planish is not installed there"
        elif 0 < mib < MIN_MIB:
            problem = f"it has {mib} MiB for each of its threads, and a page needs {MIN_MIB}"
        return Place(threads, mib, problem)

    def _report_missing(self) -> None:
        """Say, once, why no worker can be used."""
        now = time.monotonic()
        if self._threads():
            self._without_since, self._is_said = now, False
        elif now - self._without_since >= SAY_S and not self._is_said:
            reasons = [f"{address}: {place.problem}" for address, place in self._places.items()]
            self._say("; ".join(["no worker of the cluster can be used", *(reasons or ["it has none"])]))
            self._is_said = True


def run_on_worker(work: Work[Result], task: Any, limits: Limits, is_last: bool) -> Result:
    """Return the value of work(task, causes) in a separate process of a cluster's worker.

    Without a limit of memory each of the worker's threads has an equal part of the memory that the worker was given.
    is_last: whether no other worker has more memory.
    Raises ShortOfMemory otherwise.
    """
    import distributed

    if limits.memory_mib is None:
        worker = distributed.get_worker()
        given = worker.memory_manager.memory_limit or 0
        limits = replace(limits, memory_mib=int(given / worker.state.nthreads) // 2**20)
    try:
        return _isolations.setdefault(limits, Isolation(limits)).run(work, task, is_last=is_last)
    except MemoryFull as full:
        if is_last:
            raise
        raise ShortOfMemory(limits.memory_mib or 0) from full


_isolations: dict[Limits, Isolation] = {}  # of this worker of a cluster, which lives longer than a batch
