"""Bands: every row is worked on once, in bands of the wanted height, and a failure in a band is raised."""

import os
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restore.runtime.threads import BANDS_A_THREAD, MAX_THREADS, VARIABLE, in_bands, in_threads, thread_count


@given(rows=st.integers(0, 200), height=st.none() | st.integers(1, 50))
def test_every_row_is_worked_on_exactly_once(rows, height):
    visits = np.zeros(rows, int)

    def work(band: slice) -> None:
        visits[band] += 1

    in_bands(work, rows, height)
    assert (visits == 1).all()


def test_bands_have_the_height_that_is_asked_for_but_the_last():
    bands = []
    in_bands(bands.append, 25, 10)
    assert sorted((band.start, band.stop) for band in bands) == [(0, 10), (10, 20), (20, 25)]


def test_without_a_height_the_bands_are_equal_to_a_row():
    heights = []
    in_bands(lambda band: heights.append(band.stop - band.start), 8 * BANDS_A_THREAD * thread_count() + 3)
    assert len(heights) == BANDS_A_THREAD * thread_count()
    assert max(heights) - min(heights) <= 1


def test_an_error_in_a_band_reaches_the_caller():
    def work(band: slice) -> None:
        if band.start == 10:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        in_bands(work, 30, 10)


@given(parts=st.integers(0, 50), count=st.integers(1, 5))
def test_results_have_the_order_of_their_parts(parts, count):
    assert in_threads(lambda part: part**2, range(parts), count) == [part**2 for part in range(parts)]


@pytest.mark.parametrize("count", [1, 2, 4])
def test_a_thread_that_failed_begins_nothing_more(count):
    begun = []

    def work(part: int) -> None:
        begun.append(part)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        in_threads(work, range(50), count)
    assert len(begun) <= count


@pytest.mark.parametrize("count", [1, 2, 4])
def test_no_more_threads_work_than_asked_for(count):
    at_work = set()
    in_threads(lambda _part: at_work.add(threading.get_ident()), range(200), count)
    assert len(at_work) <= count


@pytest.mark.parametrize(
    ("given", "processors", "expected"), [("3", 8, 3), ("", 2, 2), ("none", 1, 1), ("0", 64, MAX_THREADS)]
)
def test_threads_are_those_given_or_as_many_as_the_processors(monkeypatch, given, processors, expected):
    monkeypatch.setenv(VARIABLE, given)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _process: set(range(processors)))
    thread_count.cache_clear()
    try:
        assert thread_count() == expected
    finally:
        thread_count.cache_clear()


def test_work_in_threads_begins_no_further_threads():
    names: set[str] = set()

    def outer(_part: int) -> None:
        in_threads(lambda _: names.add(threading.current_thread().name), range(8), 3)

    in_threads(outer, range(4), thread_count() + 1)
    assert len(names) <= thread_count() + 1
