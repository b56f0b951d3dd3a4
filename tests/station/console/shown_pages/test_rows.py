"""Rows of the strip: worst first means what it says; a fault becomes an answer with its key."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import pytest

from drivers import ScannerError
from restore import BadInput, NotEnoughSurface
from station.console.faults import STATUS, ConsoleFault, fault_of
from station.console.routes.requests import NewSession, Press
from station.console.shown_pages.rows import finding_of
from station.errors import FolderInUse, UsageError
from station.session import Event, Page, SessionDamaged
from station.session.leaves.views import questions_of, rank_of
from station.verdict.table import MEASURES
from station.verdict.thresholds import Thresholds

SAID = {"text": "", "hint": ""}  # of a check: a record has them


def page(result=None, verdict=None) -> Page:
    runs = {}
    if result is not None:
        runs["restore"] = Event(2, 1, "stage", "restore@1", None, "", "", {"result": result})
    if verdict is not None:
        runs["verdict"] = Event(3, 1, "stage", "verdict@2", None, "", "", {"result": verdict})
    return Page(1, None, MappingProxyType(runs), MappingProxyType({}))


def checked(level: str, value: float, limits=(1.0, 2.0)) -> Page:
    findings = [{"name": "blur_px", "level": level, "value": value, "limits": list(limits), **SAID}]
    return page({}, {"level": level, "checks": findings})


def test_worse_pages_rank_higher():
    worse = [
        checked("green", 0.5),
        checked("green", 0.9),
        page(),
        checked("amber", 1.1),
        checked("amber", 1.9),
        checked("red", 2.1),
        checked("red", 50.0),
        page({"error": "no page"}),
    ]
    ranks = [rank_of(one) for one in worse]
    assert ranks == sorted(ranks)
    assert len(set(ranks[2:])) == len(ranks[2:])
    assert rank_of(checked("amber", 0.92, (0.97, 0.9))) > rank_of(checked("amber", 0.96, (0.97, 0.9)))


def test_a_page_asks_what_a_correction_answers_until_it_is_accepted():
    limits = [0.5, 1.5]
    checks = [
        {"name": "layout", "level": "amber", "value": 1.0, "limits": limits, **SAID},
        {"name": "corrections", "level": "amber", "value": 1.0, "limits": limits, "part": "left", **SAID},
        {"name": "blur_px", "level": "red", "value": 3.0, "limits": limits, **SAID},
    ]
    one = page({}, {"level": "red", "checks": checks})
    assert [{"name": check.name, "part": check.part} for check in questions_of(one)] == [
        {"name": "layout", "part": ""},
        {"name": "corrections", "part": "left"},
    ]
    accept = Event(4, 1, "decision", "accept@1", None, "", "", {"value": True})
    assert questions_of(replace(one, decisions=MappingProxyType({"accept": accept}))) == []
    assert questions_of(page()) == []


def test_a_finding_says_its_unit_and_its_direction():
    assert finding_of({"name": "measured_fraction", "limits": [0.97, 0.9]})["less_is_worse"]
    assert set(MEASURES) == set(Thresholds.model_fields)


@pytest.mark.parametrize(
    ("error", "key", "status"),
    [
        (ConsoleFault("busy", "x"), "busy", 409),
        (FolderInUse("/a", "4711 of anna"), "in_use", 409),
        (SessionDamaged("x"), "damaged", 422),
        (UsageError("x"), "invalid", 422),
        (BadInput("x", "y"), "damaged", 422),
        (NotEnoughSurface("x", "y"), "damaged", 422),
        (ScannerError("x"), "no_scanner", 409),
        (OSError(28, "full"), "disk", 507),
        (ZeroDivisionError("x"), "fault", 500),
    ],
)
def test_every_error_has_a_key_and_a_status(error, key, status):
    found = fault_of(error)
    assert (found.key, found.status) == (key, status)
    assert set(STATUS) >= {key}
    assert found.body["error"]["key"] == key


@pytest.mark.parametrize(
    "values", [{"action": "capture", "page": 0}, {"action": "x"}, {"action": "note", "text": "x" * 2001}]
)
def test_requests_have_limits(values):
    with pytest.raises(ValueError):
        Press.model_validate(values)
    with pytest.raises(ValueError):
        NewSession.model_validate({"name": "x", "title": ""})
