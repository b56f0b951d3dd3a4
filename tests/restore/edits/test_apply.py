"""Corrections change what they name, and nothing else; those that do not fit are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from restore import (
    BadInput,
    CoverageClass,
    NotEnoughSurface,
    PageEdits,
    PartEdits,
    Settings,
    SurfaceMesh,
    restore,
    restore_leaves,
)
from restore.edits.finish import finish_page
from restore.layout.split import OVERLAP_MM
from restore.mesh.triangulate import triangulate
from tests.restore.layout.conftest import PAGE_MM, SPINE_MM, shot

COARSE = Settings(points=300, dpi=60)
ERROR_MM = 0.7  # two thirds of a sample of the fast mode

CORNER = ((1.0, 1.0), (20.0, 1.0), (20.0, 20.0))
ALL = {"what": "remove", "polygon": ((0.0, 0.0), (639.0, 0.0), (639.0, 479.0), (0.0, 479.0))}


def px(x_mm, y_mm):
    """Pixels of the colour image where a place of the printed page is seen."""
    scan, truth = shot(False)
    apart = np.hypot(truth.flat[..., 0] - x_mm, truth.flat[..., 1] - y_mm)
    return [float(value) for value in scan.texture_xy[np.unravel_index(np.nanargmin(apart), apart.shape)]]


def corrected(**fields):
    edits = PageEdits.model_validate_json(PageEdits(**fields).canonical())
    return dict(restore_leaves(shot(False)[0], COARSE, edits=edits).parts())


def box_px(left, bottom, right, top):
    return [px(left, top), px(right, top), px(right, bottom), px(left, bottom)]


def test_a_moved_spine_moves_both_leaves():
    spine = [px(SPINE_MM + 20, y) for y in (128, 65, 2)]
    parts = corrected(layout="split", spine=tuple(map(tuple, spine)))
    for part, width in (("left", SPINE_MM + 20), ("right", PAGE_MM[0] - SPINE_MM - 20)):
        assert parts[part].report["page_mm"][0] == pytest.approx(width + OVERLAP_MM, abs=ERROR_MM)


def test_what_a_hand_removes_is_blank_and_reported():
    mask = {"what": "remove", "polygon": tuple(map(tuple, box_px(20.0, 20.0, 60.0, 60.0)))}
    (page,) = corrected(layout="whole", parts={"page": {"masks": (mask,)}}).values()
    erased = page.report["coverage"]["erased"]
    assert erased == pytest.approx(40 * 40 / (PAGE_MM[0] * PAGE_MM[1]), rel=0.1)
    assert (page.image[page.coverage == CoverageClass.ERASED] == 255).all()
    assert "removed_by_hand" in [found.code for found in page.findings]
    (whole,) = corrected(layout="whole").values()
    removed = page.coverage == CoverageClass.ERASED
    off = [np.abs(one[removed].astype(float) - whole.master[removed]).mean() for one in (page.uncropped, page.image)]
    assert off[0] < 0.2 * off[1]  # the master has the text that the page is without
    rest = ~removed & page.mask
    np.testing.assert_array_equal(page.uncropped[rest], page.master[rest])
    assert page.report["page_mm"] == pytest.approx(PAGE_MM, abs=ERROR_MM)


def test_points_in_space_do_what_they_do_in_the_picture():
    scan, _ = shot(False)
    box = box_px(20.0, 20.0, 60.0, 60.0)
    head, tail = px(SPINE_MM + 20, 128), px(SPINE_MM + 20, 2)

    def in_space(point):
        apart = np.hypot(*(scan.texture_xy - point).transpose(2, 0, 1))
        return tuple(map(float, scan.points[np.unravel_index(np.argmin(apart), apart.shape)]))

    def restored(frame, change):
        mask = {"what": "remove", "polygon": tuple(change(point) for point in box)}
        fields = {"frame": frame, "layout": "split", "spine": (change(head), change(tail))}
        return corrected(**fields, parts={"left": {"masks": (mask,)}})["left"].report

    one, two = restored("picture", tuple), restored("space", in_space)
    assert two["page_mm"] == pytest.approx(one["page_mm"], abs=0.1)
    assert two["coverage"]["erased"] == pytest.approx(one["coverage"]["erased"], rel=0.02)


@pytest.mark.parametrize("beyond", [12.0, -12.0])
def test_a_side_that_the_picture_cuts_off_is_placed_by_the_size(beyond):
    """The opposite side holds it, the picture stays as it is, and a size that is too small places nothing."""
    scan, _ = shot(False)
    last = round(px(150.0, 65.0)[0])
    cols = int(np.searchsorted(scan.texture_xy[120, :, 0], last))
    cut = replace(
        scan, points=scan.points[:, :cols], texture=scan.texture[:, :last], texture_xy=scan.texture_xy[:, :cols]
    )
    found = restore(cut, COARSE)
    size = (found.report["page_mm"][0] + beyond, found.report["page_mm"][1])
    page = finish_page(found, PartEdits(size_mm=size))
    more = max(beyond, 0.0)
    assert page.report.get("given", []) == (["right"] if more else [])
    assert page.report["page_mm"] == pytest.approx((found.report["page_mm"][0] + more, size[1]))
    width = found.image.shape[1]
    np.testing.assert_array_equal(page.image[:, :width], found.image)
    assert (page.coverage[:, width:] == CoverageClass.OUTSIDE).all()
    assert page.image.shape[1] - width == round(more * COARSE.dpi / 25.4)
    assert ("size_wrong" in [one.code for one in page.findings]) == (beyond < 0)


def test_an_outline_is_where_the_page_ends():
    outline = tuple(map(tuple, box_px(10.0, 10.0, 95.0, 120.0)))
    (page,) = corrected(layout="whole", parts={"page": {"outline": outline}}).values()
    assert page.report["page_mm"] == pytest.approx((85.0, 110.0), abs=2 * ERROR_MM)


def test_a_page_is_turned_and_cropped_after_it_is_painted():
    crop = {"mode": "box", "box": (10.0, 20.0, 60.0, 50.0)}
    (page,) = corrected(layout="whole", parts={"page": {"turn": 1, "crop": crop}}).values()
    assert page.report["page_mm"] == pytest.approx((50.0, 30.0), abs=0.5)
    assert page.image.shape[:2] == page.coverage.shape == page.mask.shape
    (wide,) = corrected(layout="whole", parts={"page": {"crop": {"mode": "margin", "margin_mm": 5.0}}}).values()
    assert wide.report["page_mm"] == pytest.approx(np.array(PAGE_MM) + 10.0, abs=ERROR_MM)
    assert (wide.coverage[0] == CoverageClass.OUTSIDE).all()


def test_a_fine_angle_turns_the_paper():
    (straight,), (turned,) = (
        corrected(layout="whole", parts={"page": {"rotate_deg": angle}}).values() for angle in (0.0, 10.0)
    )
    cos, sin = np.cos(np.radians(10)), np.sin(np.radians(10))
    width, height = straight.report["page_mm"]
    shape = np.array(turned.image.shape[:2]) * 25.4 / turned.dpi
    assert shape == pytest.approx((width * sin + height * cos, width * cos + height * sin), abs=1.0)


def test_corrections_of_a_part_that_the_scan_does_not_give_are_named():
    turned = {"turn": 1}
    scan = shot(False)[0]

    def found(**parts):
        leaves = restore_leaves(scan, COARSE, edits=PageEdits(layout="whole", parts=parts))
        return [one.text for one in leaves.found.findings if one.code == "part_not_found"]

    assert found(left=turned) == [
        "the corrections of the part left are not used: the scan gives page. Check the layout"
    ]
    assert found(left=turned, right=turned, page=turned) == []  # a rule for whatever parts there are
    assert found(left={}) == []


def test_a_plate_is_not_split():
    scan = shot(False)[0]
    assert list(restore_leaves(scan, COARSE, edits=PageEdits(kind="spread")).found.parts) == ["left", "right"]
    assert list(restore_leaves(scan, COARSE, edits=PageEdits(kind="plate")).found.parts) == ["page"]


@pytest.mark.parametrize(
    ("fields", "error", "reason"),
    [
        ({"spine": ((10.0, 200.0), (600.0, 201.0))}, BadInput, "head to tail"),
        ({"spine": ((300.0, 200.0),) * 16}, BadInput, "head to tail"),
        ({"spine": ((300.0, 400.0), (300.0, 40.0))}, BadInput, "head to tail"),
        ({"spine": ((2000.0, 40.0), (2000.0, 400.0))}, BadInput, "outside the image"),
        ({"spine": ((1.0, 40.0), (1.0, 400.0))}, BadInput, "does not lie on the page"),
        ({"layout": "whole", "parts": {"page": {"outline": CORNER}}}, NotEnoughSurface, "leave 0"),
        ({"layout": "whole", "parts": {"page": {"masks": (ALL,)}}}, NotEnoughSurface, "leave 0.0%"),
    ],
)
def test_corrections_that_do_not_fit_are_refused(fields, error, reason):
    with pytest.raises(error, match=reason):
        restore_leaves(shot(False)[0], COARSE, edits=PageEdits(**fields))


def test_a_sheet_that_was_flattened_already_is_rotated_as_one_that_was_not():
    edits = PageEdits(layout="whole", parts={"page": {"rotate_deg": 10.0}})
    sheet = restore_leaves(shot(False)[0], COARSE, edits=edits).found.parts["page"]
    assert sheet.prepared is not None
    kept, fresh = restore(sheet, COARSE), restore(replace(sheet, prepared=None), COARSE)
    np.testing.assert_array_equal(kept.image, fresh.image)
    np.testing.assert_array_equal(kept.fine.flat, fresh.fine.flat)


@pytest.mark.slow
def test_a_mesh_is_rotated_by_hand():
    seen = triangulate(shot(False)[0])
    mesh = SurfaceMesh(seen.vertices, seen.faces, seen.texcoords, seen.texture)
    edits = [PageEdits(layout="whole", parts={"page": {"rotate_deg": degrees}}) for degrees in (0.0, 10.0)]
    straight, turned = (restore_leaves(mesh, COARSE, edits=one).page("page") for one in edits)
    cos, sin = np.cos(np.radians(10.0)), np.sin(np.radians(10.0))
    clockwise = straight.fine.flat @ np.array([[cos, -sin], [sin, cos]])
    np.testing.assert_allclose(turned.fine.flat, clockwise, atol=1e-9)
    assert turned.image.shape != straight.image.shape
