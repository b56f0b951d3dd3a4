"""Whatever a page does to its process costs that page and no other."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from concurrent.futures import wait

import pytest

from station.batch.run_tasks import run
from station.workers.executors import local_workers
from station.workers.process import Interrupted, Isolation, Limits, MemoryFull, PageProcess, ProcessEnded, WorkFault
from tests.station.workers import work

LIMIT_MIB = 1024  # the interpreter and numpy have some hundred megabytes of data and stacks
LONG_S, SHORT_S = 3600.0, 0.5


@pytest.fixture
def process():
    made = PageProcess(Limits())
    yield made
    made.close()


@pytest.fixture
def isolation():
    made = Isolation(Limits())
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


def test_a_crash_is_named_and_the_next_call_has_another_process(process) -> None:
    with pytest.raises(ProcessEnded, match="SIGSEGV"):
        process.call(work.read_nothing, None, ())
    assert process.call(work.double, 4, ()) == 8


@pytest.mark.parametrize(("memory_mib", "fault"), [(LIMIT_MIB, MemoryFull), (None, None)])
def test_a_crash_under_a_limit_is_left_to_a_computer_with_more_memory(memory_mib, fault) -> None:
    """A native library aborts where it is given no memory: that is no fault of the page."""
    isolation = Isolation(Limits(memory_mib=memory_mib))
    try:
        if fault is None:
            assert len(isolation.run(work.crash_twice, None, is_last=False)) == 2
        else:
            with pytest.raises(fault, match="SIGSEGV"):
                isolation.run(work.crash_twice, None, is_last=False)
    finally:
        isolation.close()


def test_a_page_that_crashes_is_tried_twice_and_then_set_aside(isolation) -> None:
    assert isolation.run(work.crash_twice, None) == ("its process ended by SIGSEGV",) * 2


def test_a_process_that_cannot_start_is_not_restarted_endlessly(isolation) -> None:
    with pytest.raises(ProcessEnded, match="SIGSEGV"):
        isolation.run(work.read_nothing, None)


def test_of_many_pages_only_those_that_crash_are_lost() -> None:
    with local_workers(2, Limits()) as workers:
        results = dict(run(range(4), workers, work.crash_on_odd))
    assert results == {0: "restored", 1: "set aside", 2: "restored", 3: "set aside"}


def test_a_page_that_needs_too_much_memory_is_refused_and_the_process_goes_on() -> None:
    process = PageProcess(Limits(memory_mib=LIMIT_MIB))
    try:
        with pytest.raises(WorkFault, match="the memory is full"):
            process.call(work.take_memory, LIMIT_MIB, ())
        assert process.call(work.take_memory, LIMIT_MIB // 8, ()) == LIMIT_MIB // 8 * 2**20
    finally:
        process.close()


def test_a_page_without_end_is_given_up(isolation, monkeypatch) -> None:
    assert isolation.run(work.double, 1) == 2  # a process begins in a second, on a busy machine in many
    patience = iter((SHORT_S, SHORT_S, LONG_S))  # the limit of the call, in its message, of the next process
    monkeypatch.setattr(Limits, "call_s", property(lambda _: next(patience)))
    assert isolation.run(work.sleep, LONG_S) is False


@pytest.mark.parametrize(("fault", "code", "text"), [(work.refuse, 3, "damaged"), (work.fill_disk, 6, "No space left")])
def test_an_error_keeps_its_exit_code_and_hints(process, fault, code, text) -> None:
    with pytest.raises(WorkFault, match=text) as raised:
        process.call(fault, None, ())
    assert raised.value.exit_code == code
    if fault is work.refuse:
        assert raised.value.hint == "scan again"
        assert raised.value.__notes__ == ["the scan is safe"]


def test_work_that_is_interrupted_ends_in_order(isolation, tmp_path) -> None:
    raised = []

    def call() -> None:
        try:
            isolation.run(work.say_when_interrupted, str(tmp_path))
        except Interrupted as error:
            raised.append(error)

    thread = threading.Thread(target=call)
    thread.start()
    wait_for(tmp_path / "begun")
    isolation.interrupt()
    thread.join()
    assert raised
    assert (tmp_path / "ended in order").exists()


PARENT = """
import sys
from station.workers.process import Isolation, Limits
from tests.station.workers import work
Isolation(Limits()).run(work.say_when_interrupted, sys.argv[1])
"""


def test_the_process_of_a_page_does_not_outlive_a_parent_that_is_killed(tmp_path) -> None:
    parent = subprocess.Popen([sys.executable, "-c", PARENT, str(tmp_path)])
    wait_for(tmp_path / "begun")
    parent.kill()
    parent.wait()
    wait_for(tmp_path / "ended in order")


def test_a_block_that_is_left_early_ends_what_is_under_way() -> None:
    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt), local_workers(1, Limits()) as workers:
        futures = [workers.submit(work.sleep, LONG_S) for _ in range(2)]
        wait(futures, timeout=SHORT_S)
        raise KeyboardInterrupt
    assert time.monotonic() - started < LONG_S / 10
    assert all(future.done() for future in futures)


def wait_for(path) -> None:
    while not path.exists():
        time.sleep(0.02)
