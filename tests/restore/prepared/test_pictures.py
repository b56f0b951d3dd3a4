"""A page that is drawn by rows has the pixels of one that is painted whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivers.simulated import Curl, shoot
from restore import BadInput, PartEdits, RestoredPage, Settings, restore, restore_leaves
from restore.edits.finish import finish_page
from restore.prepared import pictures
from restore.prepared.pictures import seen_at
from restore.scan import SurfaceMesh
from restore.texture.coverage import CoverageClass
from tests.restore.layout.conftest import shot as opening
from tests.restore.texture.test_coverage import folded

DPI = 120.0
SETTINGS = Settings(points=300, dpi=DPI, shading="remove", white_balance="paper")
OF_OVERVIEW = 0.01  # of the page: what a coarser page counts differently along the borders of its parts
SAME_CODE = 1  # the colour of the paper is the mean of other pixels: it rounds to the next code


def folded_with_a_hole() -> SurfaceMesh:
    """A page that lies over itself, which hides a part of it, with a hole of 8 mm."""
    page = folded()
    middle = page.flat[page.faces].mean(axis=1)
    kept = np.linalg.norm(middle - [100.0, 40.0], axis=1) > 8.0
    return SurfaceMesh(page.vertices, page.faces[kept], page.texcoords, page.texture)


SCANS = {
    "curl": lambda: shoot(Curl(), seed=3, mode="fast", page_mm=(120.0, 90.0))[0],
    "hole": folded_with_a_hole,
}


def both(make, monkeypatch) -> tuple[RestoredPage, RestoredPage]:
    """The page painted whole, and by rows from an overview of half its resolution."""
    whole = make()
    monkeypatch.setattr(pictures, "KEPT_PIXELS", 0)
    monkeypatch.setattr(pictures, "OVERVIEW_DPI", DPI / 2)
    return whole, make()


def assert_equal(whole: RestoredPage, large: RestoredPage) -> None:
    assert set(large.pictures) == set(whole.pictures)
    for name, rows in large.pictures.items():
        assert rows.kept is None
        expected, found = getattr(whole, name), getattr(large, name)
        if name == "image":
            assert np.abs(expected.astype(int) - found).max() <= SAME_CODE
        elif name == "coverage":
            # Where a gap ends, a pixel off the page may be taken for one of it.
            differ = expected != found
            assert differ.mean() < OF_OVERVIEW
            assert set(np.unique(np.stack([expected, found])[:, differ])) <= {
                CoverageClass.OUTSIDE,
                CoverageClass.OCCLUDED,
            }
        else:
            np.testing.assert_array_equal(found, expected, err_msg=name)


@pytest.mark.parametrize("name", [pytest.param("curl", marks=pytest.mark.slow), "hole"])
def test_the_pixels_are_those_of_a_page_that_is_painted_whole(name, monkeypatch):
    scan = SCANS[name]()
    whole, large = both(lambda: restore(scan, SETTINGS), monkeypatch)
    assert_equal(whole, large)
    assert {one.code for one in large.findings} == {one.code for one in whole.findings}
    for kind, fraction in whole.report["coverage"].items():
        assert large.report["coverage"][kind] == pytest.approx(fraction, abs=OF_OVERVIEW)
    if name == "hole":
        assert (large.coverage == CoverageClass.OCCLUDED).any()


@pytest.mark.slow
def test_leaves_are_drawn_by_rows_and_stay_undrawn(monkeypatch):
    scan = opening(False)[0]
    settings = SETTINGS.model_copy(update={"shading": "keep", "white_balance": "keep"})
    whole, large = both(lambda: dict(restore_leaves(scan, settings, layout="split").parts()), monkeypatch)
    for part, page in large.items():
        assert finish_page(page, PartEdits()).pictures["image"].kept is None
        assert_equal(whole[part], page)


def test_a_page_that_is_inpainted_is_painted_whole(monkeypatch):
    monkeypatch.setattr(pictures, "KEPT_PIXELS", 0)
    assert seen_at(folded(), Settings(dpi=200.0)) == pictures.OVERVIEW_DPI
    assert seen_at(folded(), Settings(dpi=200.0, inpaint_mm=1.0)) == 200.0
    assert seen_at(folded(), Settings(dpi=100.0)) == 100.0


def test_a_page_in_a_wrong_unit_is_refused():
    page = folded()
    with pytest.raises(BadInput, match="pixels"):
        seen_at(replace(page, flat=page.flat * 10), Settings(dpi=1200))
