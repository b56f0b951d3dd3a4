"""Leaf sides: their order, labels and sides; what is not counted shifts no label."""

from __future__ import annotations

import pytest

from restore import PageEdits
from station.session import Volume, add_scan, correct, create_session, open_session
from station.session.leaves.leaf import labels_of, leaves_of, missing_labels
from station.session.log.steps import decide, record_run
from station.session.terms.parts import RESTORE
from station.session.terms.presets import Preset

SPLIT = {"parts": {"left": {}, "right": {}}}
PLATE = {"findings": [{"code": "print_over_spine", "severity": "note", "text": "", "share": 0.3}]}
ONE: dict = {}


@pytest.fixture
def writer(tmp_path):
    values = Preset(foliation="folios", sides="right", layout="auto").model_dump(mode="json", exclude_none=True)
    create_session(tmp_path / "book", Volume(title="A book", preset_values=values))
    with open_session(tmp_path / "book") as opened:
        yield opened


def add(writer, tiny_scan, *results):
    for result in results:
        capture = add_scan(writer, tiny_scan, facts={})
        record_run(writer, RESTORE, capture, parameters={}, result=result)


def shown(writer):
    return [(leaf.name, leaf.label, leaf.side) for leaf in leaves_of(writer.session)]


def test_two_leaves_of_a_scan_have_a_label_each(writer, tiny_scan):
    add(writer, tiny_scan, ONE, SPLIT, {"part": "left"})
    assert shown(writer) == [
        ("1", "1r", "right"),
        ("2/left", "1v", "left"),
        ("2/right", "2r", "right"),
        ("3/left", "2v", "left"),
    ]
    assert labels_of(writer.session) == {1: "1r", 2: "1v–2r", 3: "2v"}


def test_a_cover_shifts_no_label(writer, tiny_scan):
    add(writer, tiny_scan, ONE, SPLIT)
    correct(writer, 1, PageEdits(kind="cover"))
    assert shown(writer) == [("1", "", ""), ("2/left", "1r", "left"), ("2/right", "1v", "right")]


def test_a_plate_is_two_leaf_sides(writer, tiny_scan):
    add(writer, tiny_scan, ONE, PLATE, ONE)
    assert labels_of(writer.session) == {1: "1r", 2: "1v–2r", 3: "2v"}
    correct(writer, 2, PageEdits(kind="leaf"))
    assert labels_of(writer.session) == {1: "1r", 2: "1v", 3: "2r"}
    correct(writer, 2, PageEdits(kind="spread", layout="whole"))
    assert labels_of(writer.session)[3] == "2v"


def test_a_leaf_has_decisions_of_its_own(writer, tiny_scan):
    add(writer, tiny_scan, SPLIT, ONE)
    decide(writer, "label_right", "iv", page=1)
    decide(writer, "label", "spine", page=1)  # of the page, which has two leaves now
    decide(writer, "label", "9r", page=2)
    assert labels_of(writer.session) == {1: "1r–iv", 2: "9r"}
    assert missing_labels(writer.session) == ["between 1r and 9r"]
