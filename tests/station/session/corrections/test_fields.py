"""Corrections as an operator writes them."""

from __future__ import annotations

import pytest

from restore import BadInput, PageEdits
from station.errors import UsageError
from station.session.corrections.fields import changed

BOTH = ("left", "right")


def test_fields_are_set_on_parts_and_on_the_page():
    edits = changed(PageEdits(), ["layout=split", "turn=1", "crop=margin:3", "settings.dpi=300", "size=120x170"], BOTH)
    part = {
        "turn": 1,
        "crop": {"mode": "margin", "margin_mm": 3.0},
        "settings": {"dpi": 300.0},
        "size_mm": [120.0, 170.0],
    }
    assert edits.given() == {"layout": "split", "parts": {"left": part, "right": part}}
    assert edits.names[:2] == ("layout", "left.turn")


def test_masks_add_up_and_everything_can_be_taken_away():
    one = changed(PageEdits(), ["remove=0,0:9,0:9,9"], ["page"])
    two = changed(one, ["keep=1,1:9,1:9,9", "spine=3,0:3,90", "settings.dpi=300"], ["page"])
    assert [mask.what for mask in two.part("page").masks] == ["remove", "keep"]
    assert changed(two, ["remove=", "spine=", "settings.dpi="], ["page"]).given() == {}
    assert len(one.part("page").masks) == 1  # unchanged


@pytest.mark.parametrize(
    ("word", "error"),
    [
        ("colour=red", UsageError),
        ("turn", UsageError),
        ("turn=left", BadInput),
        ("turn=9", BadInput),
        ("spine=1,2", BadInput),
        ("spine=1,2:nan,4", BadInput),
        ("outline=1,2,3:4,5,6:7,8,9", BadInput),
        ("layout=sideways", BadInput),
        ("settings.points=-5", BadInput),
        ("settings.colour=red", BadInput),
        ("crop=box:9,0,1,4", BadInput),
        ("size=120", BadInput),
    ],
)
def test_what_cannot_be_is_refused(word, error):
    with pytest.raises(error):
        changed(PageEdits(), [word], ["page"])
