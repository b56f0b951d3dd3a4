"""Faults have kinds, by which the page says them in the reader's language."""

from __future__ import annotations

import errno
import json
from collections.abc import Iterator

import pytest

from drivers.scanner import ScannerError
from drivers.vivid900.errors import BarrierClosed, DeadlineExceeded, PanelError
from drivers.vivid900.faults import PANELS, panel_error
from restore import RestoreError
from station.console.faults import kinds_of, problem_of
from station.console.state.scanner import Ending
from station.console.vendored import PAGE
from station.errors import StationError
from station.session import SessionDamaged

TABLE = json.loads((PAGE / "strings.json").read_text("utf-8"))
ANY = "exception"  # what is said of an error that nobody expected


def shown(error: BaseException) -> str:
    """The kind that the page shows: the narrowest that its table of strings has."""
    return next(kind for kind in kinds_of(error) if f"fault.{kind}" in TABLE)


def tree(kind: type[BaseException]) -> Iterator[type[BaseException]]:
    yield kind
    for narrower in kind.__subclasses__():
        yield from tree(narrower)


@pytest.mark.parametrize("base", [ScannerError, RestoreError, StationError, OSError, MemoryError])
def test_every_error_that_is_reported_has_words_in_the_table(base):
    kinds = {one for one in tree(base) if one is not PanelError}
    assert kinds
    assert {one.__name__ for one in kinds if shown(one.__new__(one)) == ANY} == set()


def test_every_message_of_the_panel_has_words_in_the_table():
    found = {text: shown(panel_error(text)) for text in PANELS}
    assert ANY not in found.values()
    assert found["LIGHT IMPROPER"] == "panel_light_improper"
    assert found["ERROR OUT OF DISTANCE RANGE (0.5-2.5 m)"] == "panel_error_out_of_distance_range_0_5_2_5_m"


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (OSError(errno.ENOSPC, "full"), "enospc"),
        (FileNotFoundError(errno.ENOENT, "gone"), "os_error"),
        (OSError(), "os_error"),
        (BarrierClosed("closed"), "barrier_closed"),
        (DeadlineExceeded("late"), "deadline_exceeded"),
        (Ending("ending"), "ending"),
        (SessionDamaged.__new__(SessionDamaged), "session_damaged"),
        (ValueError("a fault of the program"), ANY),
    ],
)
def test_the_narrowest_kind_is_shown(error, kind):
    assert shown(error) == kind


def test_the_server_s_own_sentence_stays_next_to_the_kinds():
    problem = problem_of(DeadlineExceeded("no answer within 120 s", "look at its panel"))
    assert (problem["text"], problem["hint"]) == ("no answer within 120 s", "look at its panel")
    assert problem["kinds"][:2] == ["deadline_exceeded", "transport_error"]
