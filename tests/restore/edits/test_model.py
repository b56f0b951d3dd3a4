"""The format of corrections: what is read, refused, and written again byte for byte."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from restore import BadInput, PageEdits, Settings, parse_edits
from restore.edits.model import MAX_BYTES, PartEdits

SQUARE = [[10.0, 10.0], [60.0, 10.0], [60.0, 60.0]]


def parsed(**fields):
    return parse_edits(json.dumps(fields).encode(), "x.edits.json")


def test_a_file_without_fields_changes_nothing():
    assert parsed() == PageEdits()


POINTS = st.tuples(st.floats(-10, 900).map(lambda x: round(x, 2)), st.floats(-10, 900).map(lambda x: round(x, 2)))


@given(st.lists(POINTS, min_size=3, max_size=9), st.sampled_from(["split", "whole", "left"]), st.floats(0, 10))
def test_canonical_bytes_are_read_as_they_were_written(points, layout, overlap):
    masks = [{"what": "remove", "polygon": points}]
    edits = parsed(layout=layout, overlap_mm=round(overlap, 2), parts={"left": {"masks": masks, "rotate_deg": 0.35}})
    assert parse_edits(edits.canonical(), "again") == edits
    assert parse_edits(edits.canonical(), "again").canonical() == edits.canonical()


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b'{"layout": "spl', "is not JSON"),
        (b"[" * 30_000, "nested"),
        (b'{"overlap_mm": NaN}', "NaN is not a number"),
        (b'{"overlap_mm": "1"}', "overlap_mm"),
        (b'{"version": 99}', "newer Planish"),
        (b'{"colour": 1}', "colour"),
        (b"[]", "object"),
        (b"\xff\xfe", "is not JSON"),
        (b" " * (MAX_BYTES + 1), "more than"),
        (b'{"parts": {"middle": {}}}', "middle"),
        (b'{"parts": {"left": {"turn": 4}}}', "parts.left.turn"),
        (b'{"parts": {"left": {"settings": {"dpi": 1}}}}', "parts.left.settings"),
        (b'{"parts": {"left": {"crop": {"mode": "box", "box": [5, 5, 1, 9]}}}}', "parts.left.crop"),
        (b'{"spine": [[1, 2]]}', "spine"),
        (b'{"spine": [[1, 2], [3, 4, 5]]}', "points in picture have 2 coordinates"),
        (b'{"frame": "space", "spine": [[1, 2], [3, 4]]}', "points in space have 3 coordinates"),
        (b'{"scan": "md5:1"}', "scan"),
        (json.dumps({"parts": {"page": {"outline": [[0.0, float(i)] for i in range(201)]}}}).encode(), "outline"),
        (json.dumps({"parts": {"page": {"outline": [[1e9, 0], [0, 1], [1, 1]]}}}).encode(), "outline"),
    ],
)
def test_hostile_files_are_refused_with_their_reason(data, reason):
    with pytest.raises(BadInput, match=reason):
        parse_edits(data, "x.edits.json")


@given(st.binary(max_size=200))
def test_any_bytes_are_corrections_or_bad_input(data):
    try:
        parse_edits(data, "x")
    except BadInput as error:
        assert error.hint


def test_settings_of_a_part_take_the_place_of_others():
    part = PartEdits(settings={"shading": "remove"})
    assert part.settings_of(Settings(dpi=60)) == Settings(dpi=60, shading="remove")
