"""The process of pages answers a call with a value, or with a fault as the operator is told of it."""

from __future__ import annotations

from station.workers.child import answer
from tests.station.workers import work


def test_a_call_is_answered_with_its_value() -> None:
    assert answer((work.double, (4, ()))) == ("value", 8)


def test_a_fault_keeps_its_exit_code_and_hints() -> None:
    kind, fault = answer((work.refuse, (None, ())))
    assert kind == "fault"
    assert (fault.exit_code, fault.message) == (3, "the scan is damaged")
    assert fault.hints == ("scan again", "the scan is safe")


def test_a_full_disk_is_not_blamed_on_the_scan() -> None:
    kind, fault = answer((work.fill_disk, (None, ())))
    assert (kind, fault.exit_code) == ("fault", 6)
