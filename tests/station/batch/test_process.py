"""A process takes one page after the other, and is replaced after so many."""

from __future__ import annotations

import os

import pytest

from station.batch.process import Limits, PageProcess
from tests.station.batch import work


@pytest.fixture
def process():
    made = PageProcess(Limits())
    yield made
    made.close()


def test_a_process_stays_for_the_next_call(process) -> None:
    numbers = {process.call(work.process_number, None, ()) for _ in range(3)}
    assert len(numbers) == 1
    assert os.getpid() not in numbers


def test_a_process_is_replaced_after_its_calls() -> None:
    process = PageProcess(Limits(calls=2))
    try:
        numbers = [process.call(work.process_number, None, ()) for _ in range(4)]
    finally:
        process.close()
    assert numbers[0] == numbers[1] != numbers[2] == numbers[3]
