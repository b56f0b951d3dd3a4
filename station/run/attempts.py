"""How often work is tried that ends its process, and what becomes of it then."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from station.errors import explain
from station.workers.process import MAX_ATTEMPTS

R = TypeVar("R")


@dataclass(frozen=True)
class Failure:
    """Why a scan could not be restored, and what to do."""

    text: str
    hints: tuple[str, ...] = ()

    @classmethod
    def of(cls, error: BaseException) -> Failure:
        """Return the failure of a scan by an exception, a fault of the program among them."""
        fault = explain(error)
        return cls(fault.message, fault.hints)


class Attempts:
    """The attempts to restore a scan that were cut off: by a crash, an operator, a power cut."""

    def begin(self) -> Failure | None:
        """Note that one begins; a failure where as many were cut off as are allowed."""
        return None

    def end(self) -> None:
        """Note that it has ended by itself, well or not."""


@dataclass
class InMemory(Attempts):
    """Attempts in processes that this one sees end.

    Each that is asked for begins: a page that was corrected since is tried once more.
    """

    crashes: int = 0

    def crash(self) -> Failure | None:
        """Note that one has crashed; None where it is to be tried again."""
        self.crashes += 1
        return _given_up(self.crashes, "the program ended while it restored this scan", "capture the page again")


@dataclass(frozen=True)
class FromCauses(Attempts):
    """Attempts of processes that another one starts: how they ended."""

    causes: Sequence[str]

    def begin(self) -> Failure | None:
        times, last = len(self.causes), "".join(self.causes[-1:])
        return _given_up(times, f"the program ended {times} times while it restored this scan: {last}")


@dataclass(frozen=True)
class OnDisk(Attempts):
    """Attempts that are recorded in files, which outlive the program.

    record  records that one begins, and returns how many earlier ones were cut off. remove: removes the record.
    causes  how earlier processes ended, where that is known.
    """

    record: Callable[[], int]
    remove: Callable[[], None]
    causes: Sequence[str] = ()

    def begin(self) -> Failure | None:
        how = f": {'; '.join(dict.fromkeys(self.causes))}" if self.causes else ""
        reason = f"the program has ended {MAX_ATTEMPTS} times while it restored this scan{how}"
        return _given_up(max(self.record(), len(self.causes)), reason)

    def end(self) -> None:
        self.remove()


def _given_up(times: int, text: str, *hints: str) -> Failure | None:
    return Failure(text, hints) if times >= MAX_ATTEMPTS else None


def attempted(work: Callable[[], R], attempts: Attempts, *, fatal: tuple[type[BaseException], ...]) -> R | Failure:
    """Return the result of work, or its failure.

    fatal: what is not a fault of the scan; it is raised, and the attempt does not count. A failure is to be recorded by
    the caller, and ended then.
    """
    failure = attempts.begin()
    if failure is not None:
        return failure
    try:
        result = work()
    except Exception as error:
        if isinstance(error, fatal):
            attempts.end()
            raise
        return Failure.of(error)
    except BaseException:  # Ctrl-C: it is not the scan that ends the program
        attempts.end()
        raise
    attempts.end()
    return result
