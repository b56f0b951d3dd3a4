"""A viewer shows the labels of the volume, however they are stored in the PDF."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.archive.page_labels import label_ranges
from station.session.terms.labels import Run

LABELS = st.lists(
    st.one_of(st.sampled_from(["i", "ii", "C", "D", "0", "007", "12v–13r", "[4]", ""]), st.text(max_size=4))
)


def shown(labels):
    """The labels that a viewer makes of the ranges: each goes on to the next one."""
    ranges = label_ranges(labels)
    ends = ([one.first for one in ranges] + [len(labels)])[1:]
    return [one.label(place) for one, end in zip(ranges, ends, strict=True) for place in range(end - one.first)]


@given(LABELS)
def test_every_label_is_shown_as_it_is(labels):
    assert shown(labels) == labels


@pytest.mark.parametrize("style", ["arabic", "roman", "ROMAN", "letters", "LETTERS"])
def test_a_run_is_one_range(style):
    run = Run(style=style, prefix="A-")
    labels = [run.label(place) for place in range(26)]
    assert len(label_ranges(labels)) == 1
    assert shown(labels) == labels


def test_folios_and_letters_beyond_z_are_an_entry_a_page():
    labels = [Run(style="folio").label(place) for place in range(4)]
    assert [(one.style, one.prefix) for one in label_ranges(labels)] == [("", label) for label in labels]
    letters = [Run(style="letters").label(place) for place in range(60)]
    assert shown(letters) == letters
