"""Paper lost at the border is told from the shadow that a raised border casts, and from a table that gives no range."""

import numpy as np
import pytest

from restore.range_image.border import lost_border
from restore.range_image.segmentation.segment import MAX_LOST, segment

LASER = 0.27  # of the distance: as far as the VIVID 910's laser is above its lens
FRAME = 8  # samples of dark print


@pytest.fixture
def sheet(camera):
    area = np.zeros(camera.shape, bool)
    area[35:125, 40:160] = True
    return area


def fraction_lost(camera, sheet, *, raised_mm=0.0, lost=None):
    """Of a sheet above its table, with its shadow, and what else was lost."""
    depths = np.where(sheet, camera.plane(distance=921.5 - raised_mm), camera.plane())
    shadow = np.zeros_like(sheet)
    for down in range(round(LASER * raised_mm / camera.pitch_mm)):
        shadow |= np.roll(sheet, down + 1, axis=0)
    depths[(shadow & ~sheet) | (False if lost is None else lost)] = np.nan
    depths += np.random.default_rng(0).normal(0, camera.noise, camera.shape)
    scan = camera.shot(depths)
    return lost_border(segment(scan, camera.rays, sheet & scan.measured))


def eroded(sheet, by):
    inner = sheet.copy()
    for axis in (0, 1):
        inner &= np.roll(sheet, by, axis) & np.roll(sheet, -by, axis)
    return inner


@pytest.mark.parametrize("raised_mm", [0.0, 1.0, 5.0, 20.0])
def test_no_paper_is_lost_next_to_a_shadow(camera, sheet, raised_mm):
    assert fraction_lost(camera, sheet, raised_mm=raised_mm) == 0.0


def test_a_dark_frame_is_lost_on_all_sides(camera, sheet):
    assert fraction_lost(camera, sheet, lost=sheet & ~eroded(sheet, FRAME)) > 0.95


def test_a_dark_strip_is_lost_on_the_side_that_it_is_on(camera, sheet):
    left = sheet & (camera.indices[1] < 40 + FRAME)
    assert fraction_lost(camera, sheet, raised_mm=2.0, lost=left) == pytest.approx(90 / 404, abs=0.02)


def test_single_samples_are_not_a_lost_border(camera, sheet):
    few = np.random.default_rng(1).random(sheet.shape) < 0.2
    assert fraction_lost(camera, sheet, lost=few) < 0.01
    narrow = sheet & ~eroded(sheet, MAX_LOST - 1)
    assert fraction_lost(camera, sheet, lost=narrow) == 0.0


def test_a_table_that_gives_no_range_says_nothing(camera, sheet):
    specks = np.random.default_rng(1).random(sheet.shape) < 0.2
    assert fraction_lost(camera, sheet, lost=~sheet & ~specks) == 0.0
