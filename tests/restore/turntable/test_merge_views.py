"""Merged views against the true surface in the holes of the reference view."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from restore import restore
from restore.errors import BadInput
from restore.scan import RangeScan
from restore.turntable import RotationAxis, merge_views
from restore.turntable.register import register

pytestmark = pytest.mark.slow

SPACING_MM = 0.95  # of the samples of a FAST scan at 900 mm
MIN_FILLED = 0.9  # of the shadow; the rest is ink that no view sees
ERROR_MM = 0.1  # rms along the normal: twice the noise; the crease, a sample wide, counts more than all the rest
REGISTERED_MM = SPACING_MM / 4  # sub-sample
MIN_CORRELATION_GAIN = 0.1  # of a correlation: an open book's outline is much the same either way up
SIZE_MM = 3.0  # a FAST sample on the steep wall beside the gutter covers so much paper
AXIS_ERROR_MM = np.array([0.4, -0.3, 0.3])  # mm: an axis that was calibrated carelessly


@pytest.fixture(scope="session")
def merged(book):
    careless = replace(book.axis, point=book.axis.point + AXIS_ERROR_MM)
    return merge_views(book.scans, book.turns, careless, reference=0)


def missed(book):
    on_page = np.isfinite(book.truths[0].flat[..., 0])
    return on_page & ~book.scans[0].measured


def test_measured_samples_of_the_reference_are_unchanged(book, merged) -> None:
    seen = book.scans[0].measured
    np.testing.assert_array_equal(merged.scan.points[seen], book.scans[0].points[seen])
    assert merged.scan.texture is book.scans[0].texture
    assert merged.reference == 0


def test_the_laser_shadow_is_filled_accurately(book, merged) -> None:
    hole = missed(book)
    assert hole.sum() > 500  # there is a shadow to fill
    filled = hole & merged.scan.measured
    assert filled.sum() > MIN_FILLED * hole.sum()
    truth = book.truths[0].points
    normal = np.cross(np.gradient(truth, axis=0), np.gradient(truth, axis=1))
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    off = np.abs(((merged.scan.points - truth) * normal).sum(axis=2)[filled])
    assert np.sqrt(np.nanmean(np.minimum(off, SPACING_MM) ** 2)) < ERROR_MM


def test_every_view_is_reported(book, merged) -> None:
    reference, other = merged.views
    assert (reference.turn_deg, reference.filled, merged.findings) == (0.0, 0, ())
    assert other.filled >= (missed(book) & merged.scan.measured).sum()
    assert other.residual_mm < 0.1
    assert other.moved_mm == pytest.approx(2 * np.linalg.norm(AXIS_ERROR_MM[:2]), abs=REGISTERED_MM + 0.3)
    assert merged.scan.provenance["view_registrations"][1]["residual_mm"] == other.residual_mm


def test_a_page_divided_by_a_shadow_is_connected_after_merging(book, merged) -> None:
    _, height = restore(book.scans[0]).report["page_mm"]
    assert height < 170 - 5 * SIZE_MM
    assert restore(merged.scan).report["page_mm"] == pytest.approx((140, 170), abs=SIZE_MM)


def test_the_view_with_the_most_of_the_page_is_the_reference_and_rotated_upright(book, merged) -> None:
    chosen = merge_views(book.scans, book.turns, book.axis)
    assert chosen.reference == 1
    assert chosen.scan.measured.sum() > book.scans[1].measured.sum()
    first, rolled = (cv2.resize(scan.texture, (64, 48)).astype(float) for scan in (merged.scan, chosen.scan))
    upright, upside_down = (np.corrcoef(first.ravel(), r.ravel())[0, 1] for r in (rolled, rolled[::-1, ::-1]))
    assert upright > upside_down + MIN_CORRELATION_GAIN


def test_registration_is_accurate_to_less_than_a_sample(book) -> None:
    careless = replace(book.axis, point=book.axis.point + AXIS_ERROR_MM)
    found = register(book.scans[1], book.scans[0], careless.turn(-180.0), SPACING_MM)
    true = book.axis.turn(-180.0)
    points = book.scans[1].points[book.scans[1].measured]
    off = points @ (found - true)[:3, :3].T + (found - true)[:3, 3]
    assert np.sqrt((off**2).sum(axis=1).mean()) < REGISTERED_MM


def test_views_without_colour_are_registered_by_their_surface(book) -> None:
    grey = [replace(scan, texture=None) for scan in book.scans]
    merged = merge_views(grey, book.turns, book.axis, reference=0)
    assert merged.findings == ()
    assert (missed(book) & merged.scan.measured).sum() > MIN_FILLED * missed(book).sum()


def test_a_page_that_moved_is_left_out(book) -> None:
    bent = bend(book.scans[1])
    merged = merge_views([book.scans[0], bent], book.turns, book.axis)
    assert "moved" in merged.findings[0].text
    np.testing.assert_array_equal(merged.scan.points, book.scans[0].points)


def test_a_wrong_axis_is_reported_and_the_view_nearest_to_0_deg_is_the_reference(book) -> None:
    far = RotationAxis(book.axis.point + [0.0, 30.0, 0.0], book.axis.direction)
    merged = merge_views(book.scans[::-1], [180.0, 360.0], far)
    assert len(merged.findings) == 1
    assert merged.reference == 1
    np.testing.assert_array_equal(merged.scan.points, book.scans[0].points)


def test_a_single_view_is_returned_unchanged(book) -> None:
    merged = merge_views(book.scans[:1], [0.0], book.axis)
    np.testing.assert_array_equal(merged.scan.points, book.scans[0].points)


def test_angles_and_views_must_match(book) -> None:
    with pytest.raises(BadInput, match="2 views and 1 angles"):
        merge_views(book.scans, [0.0], book.axis)
    with pytest.raises(BadInput, match="0 views"):
        merge_views([], [], book.axis)


def bend(scan: RangeScan) -> RangeScan:
    """The view after somebody pressed on one side of the page: every sample moved along its ray."""
    share = 1.0 + 0.02 * (np.arange(scan.points.shape[1]) / scan.points.shape[1])[None, :, None] ** 2
    return replace(scan, points=scan.points * share)
