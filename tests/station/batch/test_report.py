"""The report: what needs a look comes first; nothing in it leaves the file or runs."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import UTC, datetime
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from station.batch import report
from station.batch.outcomes import FIGURES, PageOutcome, ci95_of, figures_of, worst_first
from station.batch.report import encode_report
from station.batch.runner import REPORT, run_batch
from station.verdict.thresholds import Thresholds
from station.workers.executors import local_workers
from station.workers.process import Limits
from tests.station.batch.conftest import QUICK

NOW = datetime(2026, 3, 4, 5, 6, tzinfo=UTC)
ROWS = (("a", 30.0, "amber", 7.0), ("b", 20.0, "green", 8.0), ("c", 25.0, "red", 6.0))
GOOD = {"strain rms": 0.001, "strain max": 0.01, "inverted triangles": 0, "source ppi": 60.0, "warnings": 0}


def outcome(name: str, **figures: float) -> PageOutcome:
    return PageOutcome(name, "restored", figures={**GOOD, **{k.replace("_", " "): v for k, v in figures.items()}})


class Parsed(HTMLParser):
    """Tags and attributes of a document, and its text."""

    def __init__(self, data: bytes) -> None:
        super().__init__()
        self.tags, self.attributes, self.text = [], [], []
        self.feed(data.decode())

    def handle_starttag(self, tag, attrs) -> None:
        self.tags.append(tag)
        self.attributes += attrs

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def order(pages) -> list[tuple[str, str]]:
    return [(one.page.name, one.by) for one in worst_first(pages)]


def test_the_worst_by_any_figure_come_first() -> None:
    pages = [
        outcome("good"),
        outcome("also good"),
        outcome("strained", strain_rms=0.02),
        outcome("coarse", source_ppi=20.0),
        PageOutcome("lost", "set aside", notes=("damaged",)),
        outcome("fair", strain_rms=0.002),
    ]
    assert order(pages) == [
        ("lost", ""),
        ("coarse", "source ppi"),
        ("strained", "strain rms"),
        ("fair", "strain rms"),
        ("also good", ""),
        ("good", ""),
    ]


def test_the_verdict_comes_before_the_figures() -> None:
    pages = [
        outcome("strained", strain_rms=0.02),
        replace(outcome("amber"), level="amber"),
        replace(outcome("red"), level="red", notes=("red: strain 3 % rms",)),
        replace(outcome("green"), level="green"),
    ]
    assert [one.page.name for one in worst_first(pages)] == ["red", "amber", "strained", "green"]
    html = encode_report(pages, title="Batch", now=NOW).decode()
    assert "not done, 1 red, 1 amber, 1 green" in html
    assert "<b class='red'>red</b>" in html


@pytest.mark.usefixtures("in_process")
def test_a_page_of_a_folder_is_checked_by_the_measures_in_its_report(scans, tmp_path) -> None:
    limits = Thresholds(smooth_strain_rms=(0.5, 0.9), sampling_ppi=(1000.0, 1.0), measured_fraction=(1.1, 0.1))
    run_batch([scans], tmp_path / "out", QUICK, local_workers(1, Limits()), lambda _: None, limits=limits)
    html = (tmp_path / "out" / REPORT).read_text()
    assert html.count("<b class='amber'>amber</b>") == html.count("amber: resolution") == 4
    assert html.count("amber: covered") == 4
    assert "strain 0" not in html


@given(st.lists(st.floats(0, 1), min_size=1, max_size=30))
def test_a_page_is_never_behind_one_that_is_better_in_everything(values) -> None:
    pages = [outcome(f"{index:03}", strain_rms=value) for index, value in enumerate(values)]
    strains = [one.page.figures["strain rms"] for one in worst_first(pages)]
    assert strains == sorted(values, reverse=True)


def test_a_page_without_a_figure_is_compared_by_the_others() -> None:
    bare = PageOutcome("bare", "restored", figures={"strain rms": 0.5})
    assert order([outcome("good"), bare])[0] == ("bare", "strain rms")


def test_the_file_stands_alone(tmp_path) -> None:
    Image.fromarray(np.full((900, 600, 3), 200, np.uint8)).save(tmp_path / "page.png")
    one = PageOutcome("a.ply", "restored", tmp_path / "page.png", GOOD, size_mm=(210.0, 297.0), seconds=5.0)
    parsed = Parsed(encode_report([one], title="Batch", now=NOW))
    sources = [value for name, value in parsed.attributes if name in ("src", "href", "action")]
    assert len(sources) == 1
    assert re.match(r"data:image/jpeg;base64,[A-Za-z0-9+/=]+$", sources[0])
    assert not {"script", "link", "iframe", "form"} & set(parsed.tags)
    assert "210.0 × 297.0" in parsed.text


@pytest.mark.parametrize("name", ["<script>alert(1)</script>.ply", "a&b\"'.ply", "odd\udcff.ply"])
def test_names_are_text_and_nothing_else(name) -> None:
    one = PageOutcome(name, "set aside", notes=(f"{name} is damaged",))
    parsed = Parsed(encode_report([one], title=name, now=NOW))
    assert "script" not in parsed.tags
    assert parsed.tags.count("tr") == 2
    shown = name.encode("utf-8", "backslashreplace").decode()
    assert shown in parsed.text


def test_of_very_many_pages_the_best_are_left_out(monkeypatch) -> None:
    monkeypatch.setattr(report, "MAX_ROWS", 3)
    parsed = Parsed(encode_report([outcome(str(n), strain_rms=n / 9) for n in range(9)], title="x", now=NOW))
    assert parsed.tags.count("tr") == 1 + 3
    assert "6 better pages are not listed." in parsed.text


def test_a_picture_that_is_gone_or_damaged_leaves_its_place_empty(tmp_path) -> None:
    (tmp_path / "bad.png").write_bytes(b"no picture")
    pages = [PageOutcome("bad", "restored", tmp_path / "bad.png"), PageOutcome("gone", "restored", tmp_path / "x.png")]
    assert "img" not in Parsed(encode_report(pages, title="x", now=NOW)).tags


def test_the_report_says_how_well_sizes_and_places_are_known() -> None:
    stated = {"uncertainty_mm": {"total": 0.0124}, "size_mm_ci95": [2.74, 1.96]}
    figures, known = figures_of(stated), ci95_of(stated)
    page = PageOutcome("a", "restored", figures=figures, size_mm=(280.0, 200.0), ci95_mm=known)
    parsed = Parsed(encode_report([page], title="x", now=NOW))
    assert {"0.012 mm", "280.0 × 200.0", "± 2.7"} <= set(parsed.text)
    for unknown in ({}, {"size_mm_ci95": None}, {"uncertainty_mm": {"reason": "a mesh"}}):
        assert (ci95_of(unknown), "uncertainty" in figures_of(unknown)) == (None, False)


def test_it_sorts_and_filters_without_a_script() -> None:
    pages = [
        replace(outcome(name, source_ppi=ppi), level=level, size_mm=(width, 9.0)) for name, ppi, level, width in ROWS
    ]
    html = encode_report([*pages, PageOutcome("lost", "set aside")], title="x", now=NOW).decode()
    rows = re.findall(r"<tr class='(\w+)' style='([^']*)'>.*?<td>(\w+)<", html)
    assert [(kind, name) for kind, _, name in rows] == [("aside", "lost"), ("red", "c"), ("amber", "a"), ("green", "b")]
    for at, order in enumerate(("abc", "cab", None, None, None, "bca")):  # by scan, width, …, resolution
        placed = {int(re.search(rf"--by-{at}:(\d+)", style)[1]): name for _, style, name in rows}
        assert order is None or "".join(placed[place] for place in range(3)) == order
        assert f"body:has(#by-{at}:checked) tbody tr {{ order: var(--by-{at}); }}" in html
    assert "body:has(#show-amber:checked) tbody tr:not(.amber) { display: none; }" in html
    assert not {"strain max", "hours", "seconds"} & set(Parsed(html.encode()).text)


def test_figures_are_read_from_a_report_of_the_library(page) -> None:
    values = [figure.read(page.report) for figure in FIGURES]
    assert values == [0.001, 0, None, 20.3, None, 0]


def test_a_preview_is_shown_without_reading_the_page_again(tmp_path) -> None:
    page = PageOutcome("a", "restored", tmp_path / "gone.png", preview="<img alt='' src='data:,'>")
    assert ("src", "data:,") in Parsed(encode_report([page], title="x", now=NOW)).attributes
