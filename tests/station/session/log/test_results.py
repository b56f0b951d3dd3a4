"""Results as records hold them: what is read of them, and that reading changes no record."""

from __future__ import annotations

import pickle

import pytest

from station.session.log.events import Event, decode, encode
from station.session.log.results import Checked, QualityCheck

SAME = {
    "name": "similarity",
    "level": "red",
    "value": 0.97,
    "limits": [0.8, 0.84],
    "text": "same page as page 5/right 0.97 (amber > 0.80, red > 0.84)",
    "hint": "",
}


def run(name: str, result: object) -> Event:
    return Event(2, 1, "stage", f"{name}@1", None, "2026-01-02T03:04:05Z", "", {"result": result})


def test_a_record_keeps_keys_that_are_not_read_and_its_bytes():
    event = run("restore", {"method": "isometric", "page_mm": [210, 297.5], "of a later program": [1, {"a": None}]})
    again = decode(encode(event))
    assert again.restored.page_mm == [210.0, 297.5]
    assert (encode(again), again.sha512) == (encode(event), event.sha512)


def test_a_check_names_the_page_that_is_the_same():
    assert Checked.model_validate(SAME).same_as == "5/right"
    assert Checked.model_validate({**SAME, "level": "green"}).same_as is None
    assert Checked.model_validate({**SAME, "name": "blur_px"}).same_as is None


def test_checks_of_a_part_are_its_own_and_those_of_the_whole():
    quality = QualityCheck.model_validate({"level": "red", "checks": [SAME, {**SAME, "part": "left"}]})
    assert [len(quality.of(part)) for part in ("page", "left")] == [1, 2]
    assert quality.rank == pytest.approx(2 + quality.checks[0].past)


def test_a_decision_has_no_result():
    decision = Event(2, 1, "decision", "mark", None, "", "", {"value": True})
    assert (decision.result, decision.restored, decision.checked, decision.value) == (None, None, None, True)


def test_facts_that_were_read_do_not_travel_with_an_event():
    event = run("restore", {"method": "isometric"})
    before = pickle.dumps(event)
    assert event.restored is not None
    assert pickle.dumps(event) == before
    assert pickle.loads(before) == event
