"""What is kept of a page: used for equal arguments only, and no more than its limit."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pytest

from restore.runtime import results
from restore.runtime.results import Kept


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


def test_equal_arguments_give_the_same_result():
    kept = Kept()
    for _ in range(2):
        with kept.of_page("a"):
            assert kept.result(work, surface(), "leaf", None)[0] == 1


def test_a_value_that_an_argument_computed_meanwhile_changes_nothing():
    one = surface()
    kept = Kept()
    with kept.of_page("a"):
        kept.result(work, one)
        assert one.mean == 5.5
        assert kept.result(work, one)[0] == 1


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
    kept = Kept()
    with kept.of_page("a"):
        kept.result(work, surface())
        assert kept.result(work, other)[0] == 2
        assert kept.result(work, surface())[0] == 1


def test_another_function_has_its_own_results():
    kept = Kept()
    with kept.of_page("a"):
        assert kept.result(len, "abc") == 3
        assert kept.result(max, "abc") == "c"


def test_an_array_that_was_changed_in_place_is_another_argument():
    one = surface()
    kept = Kept()
    with kept.of_page("a"):
        kept.result(work, one)
        one.points[0, 0] += 1e-12
        assert kept.result(work, one)[0] == 2


def test_what_a_page_no_longer_uses_goes_and_another_page_begins_again():
    kept = Kept()
    with kept.of_page("a"):
        kept.result(work, 1)
        kept.result(work, 2)
    with kept.of_page("a"):
        kept.result(work, 2)
    assert len(kept) == 1
    with kept.of_page("b"):
        assert len(kept) == 0
        assert kept.result(work, 2)[0] == 3


def test_an_error_is_not_kept():
    kept = Kept()
    with pytest.raises(ZeroDivisionError), kept.of_page("a"):
        kept.result(divmod, 1, 0)
    assert len(kept) == 0


def test_what_cannot_be_written_is_computed_each_time():
    kept = Kept()
    with kept.of_page("a"):
        for number in (1, 2):
            assert kept.result(work, lambda: None)[0] == 2 * number - 1
            assert kept.result(work_later, 1)() == [2 * number, 1]
        assert len(kept) == 0


def test_no_more_is_kept_than_the_limit(monkeypatch):
    monkeypatch.setattr(results, "MAX_BYTES", 1500)
    kept, large = Kept(), np.zeros(100)
    with kept.of_page("a"):
        for number in range(3):
            kept.result(work, large + number)
        assert len(kept) == 1
        assert kept.result(work, large)[0] == 1
        assert kept.result(work, large + 1)[0] == 4
