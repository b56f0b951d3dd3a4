"""Labels by runs: each style, its inverse, and runs as they are written."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.errors import UsageError
from station.session.terms.labels import STYLES, Run, parse_run, run_of_preset
from station.session.terms.presets import Preset

FIRST_FOUR = {
    "arabic": ["3", "4", "5", "6"],
    "roman": ["iii", "iv", "v", "vi"],
    "ROMAN": ["III", "IV", "V", "VI"],
    "letters": ["c", "d", "e", "f"],
    "LETTERS": ["C", "D", "E", "F"],
    "folio": ["3r", "3v", "4r", "4v"],
    "folio-ab": ["3a", "3b", "4a", "4b"],
    "leaf": ["3", "", "4", ""],
    "column": ["3–4", "5–6", "7–8", "9–10"],
    "none": ["", "", "", ""],
}


@pytest.mark.parametrize("style", FIRST_FOUR)
def test_styles(style):
    run = Run(style=style, first=3)
    assert [run.label(place) for place in range(4)] == FIRST_FOUR[style]


@given(
    style=st.sampled_from([*STYLES]),
    first=st.integers(1, 3000),
    place=st.integers(0, 400),
    bracket=st.booleans(),
    verso=st.booleans(),
    ends=st.sampled_from([("", ""), ("A ", ""), ("", " bis")]),
)
def test_a_label_says_its_place(style, first, place, bracket, verso, ends):
    side = "verso" if verso else "recto"
    run = Run(style=style, first=first, bracket=bracket, side=side, prefix=ends[0], suffix=ends[1])
    label = run.label(place)
    assert run.place(label) == (place if label else None)


@pytest.mark.parametrize(
    ("foliation", "labels"), [("pages", ["5", "6", "7"]), ("folios", ["5r", "5v", "6r"]), ("none", ["", "", ""])]
)
def test_the_foliation_of_a_preset_is_a_run(foliation, labels):
    run = run_of_preset(Preset(foliation=foliation, first=5))
    assert [run.label(place) for place in range(3)] == labels


@pytest.mark.parametrize("text", ["from=3/middle", "style=greek", "first=one", "style", "first=-1", "colour=red"])
def test_runs_that_cannot_be_are_refused(text):
    with pytest.raises(UsageError, match="--run"):
        parse_run(text)


def test_a_run_is_read_as_it_is_written():
    run = parse_run("from=3/right style=folio first=7 side=verso bracket=yes counted=true")
    assert (run.label(0), parse_run(run.as_text())) == ("[7v]", run)
