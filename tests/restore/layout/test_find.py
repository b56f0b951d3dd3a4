"""The spine of a simulated book is found within a part of a sample; its leaves are sheets of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from restore import (
    BadInput,
    CoverageClass,
    NotEnoughSurface,
    Settings,
    find_layout,
    restore,
    restore_leaves,
)
from restore.layout.find import inspect
from restore.layout.flattened import FlattenedSheet
from restore.layout.split import OVERLAP_MM, split_at_crease
from tests.restore.layout.conftest import PAGE_MM, SPINE_MM

SPINE_ERROR_MM = 0.3  # a third of a sample of the fast mode
WIDTH_ERROR_MM = 0.6  # half a sample on a steep wall
COARSE = Settings(points=300, dpi=60)


def spine_mm(finding, scan, truth):
    """(k,) mm: places on the printed page that lie under the spine found."""
    at = np.linalg.lstsq(np.column_stack([_grid(scan), np.ones(scan.measured.size)]), scan.texture_xy.reshape(-1, 2))
    nodes = (finding.spine - at[0][2]) @ np.linalg.inv(at[0][:2])
    rows = np.rint(nodes[:, 0]).astype(int)
    flat = truth.flat[rows, :, 0]
    return [
        np.interp(col, np.flatnonzero(np.isfinite(row)), row[np.isfinite(row)])
        for col, row in zip(nodes[:, 1], flat, strict=True)
    ]


def _grid(scan):
    return np.stack(np.indices(scan.measured.shape), axis=-1).reshape(-1, 2)


def test_the_spine_of_a_book_is_found(opened):
    scan, truth = opened
    finding = find_layout(scan)
    assert (finding.advice, finding.is_spine, finding.frame) == ("split", "sure", "picture")
    assert spine_mm(finding, scan, truth)[1] == pytest.approx(SPINE_MM, abs=SPINE_ERROR_MM)
    assert finding.widths_mm == pytest.approx((SPINE_MM, PAGE_MM[0] - SPINE_MM), abs=WIDTH_ERROR_MM)
    assert finding.crossing == 0.0
    assert finding.sigma_mm < SPINE_ERROR_MM


@pytest.mark.slow
def test_a_picture_across_the_spine_is_not_cut(plate):
    finding = find_layout(plate[0])
    assert (finding.advice, finding.is_spine) == ("whole", "sure")
    leaves = restore_leaves(plate[0], COARSE).found
    assert (list(leaves.parts), [found.code for found in leaves.findings]) == (["page"], ["print_over_spine"])


def test_a_forced_cut_through_print_keeps_the_whole_as_well(plate):
    leaves = restore_leaves(plate[0], COARSE, layout="split").found
    assert list(leaves.parts) == ["left", "right", "page"]
    assert [found.code for found in leaves.findings] == ["print_cut"]


def test_leaves_are_restored_each_as_a_sheet(opened):
    pages = dict(restore_leaves(opened[0], COARSE).parts())
    assert list(pages) == ["left", "right"]
    for part, width in (("left", SPINE_MM), ("right", PAGE_MM[0] - SPINE_MM)):
        page = pages[part]
        assert page.report["leaf_mm"] == pytest.approx((width, PAGE_MM[1]), abs=WIDTH_ERROR_MM)
        assert page.report["page_mm"][0] == pytest.approx(width + OVERLAP_MM, abs=WIDTH_ERROR_MM)
        assert (page.report["part"], page.report["layout"]["advice"]) == (part, "split")
        facing = (page.coverage == CoverageClass.FACING).mean(axis=0) > 0.5
        assert facing[-1 if part == "left" else 0] and not facing[0 if part == "left" else -1]


def test_the_whole_is_not_flattened_twice_and_is_the_same(opened):
    (whole,) = restore_leaves(opened[0], COARSE, layout="whole").found.parts.values()
    assert isinstance(whole.prepared, FlattenedSheet)
    assert whole.prepared.with_noise() is whole.prepared.sheet
    page = restore(whole, COARSE)
    np.testing.assert_array_equal(page.image, restore(opened[0], COARSE).image)
    assert page.report["seconds"]["flatten"] == 0.0


def test_a_hidden_gutter_is_split_without_flattening(opened):
    scan, truth = opened
    hidden = np.abs(truth.flat[..., 0] - SPINE_MM) < 12.0
    finding = find_layout(replace(scan, points=np.where(hidden[..., None], np.nan, scan.points)))
    assert (finding.advice, finding.is_spine) == ("split", "sure")
    assert 12.0 < finding.gutter_hidden_mm < 24.0


def test_what_is_left_of_the_spine_is_on_the_left_leaf(opened):
    scan, truth = opened
    parts = split_at_crease(inspect(scan, COARSE))
    x = truth.flat[..., 0]
    assert np.nanmax(x[parts["left"].segmented.samples]) < SPINE_MM + OVERLAP_MM + SPINE_ERROR_MM
    assert np.nanmin(x[parts["right"].segmented.samples]) > SPINE_MM - OVERLAP_MM - SPINE_ERROR_MM
    both = parts["left"].segmented.samples | parts["right"].segmented.samples
    np.testing.assert_array_equal(both, inspect(scan, COARSE).largest.segmented.samples)


def test_a_flat_sheet_cannot_be_split(opened):
    scan, _ = opened
    rows, cols = np.indices(scan.measured.shape)
    flat = np.stack([cols - 160.0, 120.0 - rows, np.full(rows.shape, -900.0)], axis=-1) * 0.9
    flat[:40], flat[200:], flat[:, :40], flat[:, 280:] = (np.nan,) * 4
    sheet = replace(scan, points=flat, texture=None)
    assert find_layout(sheet).advice == "whole"
    with pytest.raises(BadInput, match="no valley"):
        restore_leaves(sheet, COARSE, layout="split")
    with pytest.raises(NotEnoughSurface):
        find_layout(replace(sheet, points=np.full_like(flat, np.nan)))
