"""The report of a page as users of the library read it: a dictionary of JSON values."""

import json
from typing import get_type_hints

import pytest

from restore import PartEdits, RestoredPage, Settings, mirror_page, restore, rotate_page
from restore.edits.finish import finish_page
from restore.report import CoverageReport
from restore.texture.coverage import CoverageClass
from station.run.small_page import small_page

SETTINGS = Settings(points=300, dpi=60)


@pytest.fixture(scope="module")
def page() -> RestoredPage:
    return restore(small_page(), SETTINGS)


def test_a_report_is_read_as_a_dictionary(page):
    report = page.report
    assert len(report["page_mm"]) == 2
    assert report["strain"]["rms"] > 0.0
    assert "seconds" in report
    assert report.get("rotation_deg", 0) == 0
    assert json.loads(json.dumps(report)) == dict(report) == {key: report[key] for key in report}


def test_the_kinds_of_coverage_have_a_key_each():
    kinds = {kind.name.lower() for kind in CoverageClass if kind is not CoverageClass.OUTSIDE}
    assert {*kinds, "cropped_fraction"} == set(get_type_hints(CoverageReport))


def test_keys_keep_the_order_in_which_they_came(page):
    turned = rotate_page(finish_page(page, PartEdits(turn=1)), 180)
    assert list(turned.report)[-2:] == ["edits", "rotation_deg"]


def test_a_change_leaves_the_report_of_the_page_as_it_was(page):
    before = json.dumps(page.report)
    mirror_page(rotate_page(page, 90))
    finish_page(page, PartEdits(turn=1))
    assert json.dumps(page.report) == before
