"""Paper without range at the border is found in the picture, whatever the table gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivers.simulated import Flat, shoot
from oracles.openings import draw_opening, shoot_drawn
from restore.outline.unmeasured import unmeasured_border
from restore.prepared.prepare import prepare

PAPER, TABLE = 220, 40
ROWS, COLS = slice(35, 125), slice(40, 160)
LOST = 5  # columns of paper at the left
BORDER = 2 * (90 + 120) - 4  # samples
CORNERS = 6 / BORDER  # the normal of the last samples before a corner points past it


@pytest.fixture
def seen(camera):
    """Return the fraction of a page's border that is seen to go on.

    Of the paper some columns at the left give no range, of the table around nothing does; print, a band of another
    light.
    """

    def border(lost: int, *, band: slice = slice(0), table: int = TABLE, measured: bool = False) -> float:
        inside = np.zeros(camera.shape, bool)
        inside[ROWS, COLS.start + lost : COLS.stop] = True
        sheet = camera.sheet(camera.facets(camera.plane()), inside)
        texture = np.full((*camera.shape, 3), table, np.uint8)
        texture[ROWS, COLS] = PAPER
        texture[ROWS, band] = TABLE
        points = np.where((inside | measured)[..., None], sheet.scan.points, np.nan)
        scan = replace(sheet.scan, points=points, texture=texture, texture_xy=sheet.pixels.astype(float))
        return unmeasured_border(replace(sheet, scan=scan))

    return border


def test_a_border_where_the_paper_ends_is_complete(seen):
    assert seen(0) == 0.0


@pytest.mark.parametrize("table", [TABLE, 120, 250])
def test_a_strip_without_range_is_found(seen, table):
    assert seen(LOST, table=table) == pytest.approx(90 / BORDER, abs=CORNERS)


def test_measured_samples_beyond_the_outline_are_not_paper(seen):
    assert seen(LOST, measured=True) == 0.0


def test_print_at_the_border_is_not_the_end_of_the_paper(seen):
    assert seen(0, band=slice(COLS.start + 3, COLS.start + 6)) == 0.0


def test_a_table_as_white_as_paper_shows_nothing(seen):
    assert seen(LOST, table=PAPER - 5) == 0.0


def test_a_scan_without_picture_shows_nothing(camera):
    assert unmeasured_border(camera.sheet(camera.facets(camera.plane()))) == 0.0


@pytest.mark.slow
def test_a_page_on_a_table_has_no_such_finding_and_a_wall_out_of_range_has():
    scan, _ = shoot(Flat(), mode="fast")
    assert "lost_border" not in {one.code for one in prepare(scan).findings}
    shot = shoot_drawn(draw_opening(1187), 1187, "fast")  # its left wall rises out of the range: 3.8 mm are lost
    assert shot is not None
    assert "lost_border" in {one.code for one in prepare(shot[0]).findings}
