"""Attempts that are cut off: what each kind counts, and which faults do not count."""

from __future__ import annotations

import pytest

from station.run.attempts import Failure, FromCauses, InMemory, OnDisk, attempted


class Disk:
    """A record of attempts, as a file is one."""

    def __init__(self, cut_off: int) -> None:
        self.cut_off, self.removed = cut_off, 0

    def attempts(self, *causes: str) -> OnDisk:
        return OnDisk(lambda: self.cut_off, self.remove, causes)

    def remove(self) -> None:
        self.removed += 1


CAUSES = ("its process ended by SIGSEGV", "it took longer than 60 s")
TWICE = "the program has ended 2 times while it restored this scan"


@pytest.mark.parametrize(
    ("attempts", "text"),
    [
        (FromCauses(()), None),
        (FromCauses(CAUSES[:1]), None),
        (FromCauses(CAUSES), f"the program ended 2 times while it restored this scan: {CAUSES[1]}"),
        (FromCauses((*CAUSES, "x")), "the program ended 3 times while it restored this scan: x"),
        (Disk(1).attempts(), None),
        (Disk(2).attempts(), TWICE),
        (Disk(1).attempts(CAUSES[0]), None),
        (Disk(0).attempts(*CAUSES), f"{TWICE}: {'; '.join(CAUSES)}"),
        (Disk(5).attempts(CAUSES[0], CAUSES[0]), f"{TWICE}: {CAUSES[0]}"),
        (InMemory(crashes=7), None),
    ],
)
def test_work_is_not_begun_a_third_time(attempts, text) -> None:
    made = attempted(lambda: "page", attempts, fatal=())
    assert made == ("page" if text is None else Failure(text))


def test_the_second_crash_of_a_process_is_a_failure() -> None:
    attempts = InMemory()
    assert attempts.crash() is None
    assert attempts.crash() == Failure("the program ended while it restored this scan", ("capture the page again",))
    assert attempts.begin() is None  # a page that is corrected then is tried once more
    assert attempts.crash() is not None


@pytest.mark.parametrize(
    ("error", "removed"), [(OSError(28, "full"), 1), (KeyboardInterrupt(), 1), (ValueError("damaged"), 0)]
)
def test_a_fault_that_is_not_the_scans_is_raised_and_does_not_count(error, removed) -> None:
    disk = Disk(0)

    def fail() -> str:
        raise error

    if isinstance(error, ValueError):
        made = attempted(fail, disk.attempts(), fatal=(OSError,))
        assert isinstance(made, Failure)
        assert "ValueError: damaged" in made.text
    else:
        with pytest.raises(type(error)):
            attempted(fail, disk.attempts(), fatal=(OSError,))
    assert disk.removed == removed  # the caller ends a failure, when it is recorded


def test_work_that_succeeds_is_ended() -> None:
    disk = Disk(1)
    assert attempted(lambda: 3, disk.attempts(), fatal=()) == 3
    assert disk.removed == 1
