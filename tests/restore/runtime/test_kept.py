"""What is kept of a page: used for equal arguments only, and no more than its limit."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pytest

from restore.runtime import kept
from restore.runtime.kept import Store, keep_in, keep_result, keeps_results


@dataclass(frozen=True, eq=False)
class Surface:
    points: np.ndarray
    noise: float = 1.0
    facts: dict = field(default_factory=dict)

    @cached_property
    def mean(self):
        return self.points.mean()


CALLS = []


def work(*arguments):
    """Return how often it was called, and its arguments."""
    CALLS.append(arguments)
    return [len(CALLS), *arguments]


def work_later(*arguments):
    """Return a function that cannot be written."""
    return lambda: work(*arguments)


@pytest.fixture(autouse=True)
def _no_calls():
    CALLS.clear()


def surface(**fields):
    return replace(Surface(np.arange(12.0).reshape(3, 4), facts={"lens": "TELE"}), **fields)


def test_without_a_store_nothing_is_kept():
    assert not keeps_results()
    assert [keep_result(work, 1)[0] for _ in range(2)] == [1, 2]


def test_equal_arguments_give_the_same_result():
    store = Store()
    for _ in range(2):
        with keep_in(store, "a"):
            assert keeps_results()
            assert keep_result(work, surface(), "leaf", None)[0] == 1


def test_a_value_that_an_argument_computed_meanwhile_changes_nothing():
    one = surface()
    with keep_in(Store(), "a"):
        keep_result(work, one)
        assert one.mean == 5.5
        assert keep_result(work, one)[0] == 1


@pytest.mark.parametrize(
    "other",
    [
        surface(points=np.arange(12.0).reshape(4, 3)),
        surface(points=np.arange(12.0, dtype=np.float32).reshape(3, 4)),
        surface(points=np.nextafter(np.arange(12.0).reshape(3, 4), 99)),
        surface(points=np.arange(12.0).reshape(3, 4)[:, ::-1]),
        surface(noise=np.nextafter(1.0, 2.0)),
        surface(facts={"lens": "WIDE"}),
        surface(facts={}),
        None,
    ],
)
def test_any_other_argument_is_worked_on_again(other):
    with keep_in(Store(), "a"):
        keep_result(work, surface())
        assert keep_result(work, other)[0] == 2
        assert keep_result(work, surface())[0] == 1


def test_another_function_has_its_own_results():
    with keep_in(Store(), "a"):
        assert keep_result(len, "abc") == 3
        assert keep_result(max, "abc") == "c"


def test_an_array_that_was_changed_in_place_is_another_argument():
    one = surface()
    with keep_in(Store(), "a"):
        keep_result(work, one)
        one.points[0, 0] += 1e-12
        assert keep_result(work, one)[0] == 2


def test_what_a_page_no_longer_uses_goes_and_another_page_begins_again():
    store = Store()
    with keep_in(store, "a"):
        keep_result(work, 1)
        keep_result(work, 2)
    with keep_in(store, "a"):
        keep_result(work, 2)
    assert len(store) == 1
    with keep_in(store, "b"):
        assert len(store) == 0
        assert keep_result(work, 2)[0] == 3


def test_an_error_is_not_kept():
    store = Store()
    with pytest.raises(ZeroDivisionError), keep_in(store, "a"):
        keep_result(divmod, 1, 0)
    assert len(store) == 0
    assert not keeps_results()


def test_what_cannot_be_written_is_computed_each_time():
    store = Store()
    with keep_in(store, "a"):
        for number in (1, 2):
            assert keep_result(work, lambda: None)[0] == 2 * number - 1
            assert keep_result(work_later, 1)() == [2 * number, 1]
        assert len(store) == 0


def test_no_more_is_kept_than_the_limit(monkeypatch):
    monkeypatch.setattr(kept, "MAX_BYTES", 1500)
    store, large = Store(), np.zeros(100)
    with keep_in(store, "a"):
        for number in range(3):
            keep_result(work, large + number)
        assert len(store) == 1
        assert keep_result(work, large)[0] == 1
        assert keep_result(work, large + 1)[0] == 4
