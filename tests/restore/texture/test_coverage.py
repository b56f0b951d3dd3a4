"""The coverage of a page against visibility by ray casting from the camera's centre."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from drivers.simulated.imaging.raycast import RayCaster
from restore.camera.pinhole import centre_of, pinhole_camera
from restore.page import FlatMesh
from restore.texture.coverage import (
    CoverageClass,
    cover,
    cropped_fraction,
    cut_findings,
    filled_findings,
)
from restore.texture.inpaint import blank_hidden
from restore.texture.occlusion import mirror_findings, viewpoint
from restore.texture.page import MM_PER_INCH, page_map, paint_page

DPI = 127.0  # five pixels to the millimetre
FOCAL_PX, CAMERA_CENTRE = 1900.0, np.array([10.0, -20.0, 900.0])
EDGE_PX = 6  # of the page: the limit of what is hidden is known to two pixels of the texture, 0.5 mm each
CENTRE_MM = 1e-3
HIDDEN_FRACTION, FRACTION_ROUNDING = (
    0.285,
    0.02,
)  # 15 mm under the pleat, 19.2 of its turned side


def pinhole(points):
    """(n, 2) texture pixels of points (n, 3) mm, seen from EYE straight down."""
    way = points - CAMERA_CENTRE
    return way[:, :2] / -way[:, 2:] * [FOCAL_PX, -FOCAL_PX] + [319.5, 239.5]


def folded(gap=12.0, count=241):
    """A page of 120 × 80 mm pleated over itself: 15 mm lie under the pleat and 25 mm of it are turned away."""
    s = np.linspace(0.0, 120.0, count)
    corners_s = np.array([0.0, 50.0, 50.0 + np.hypot(15.0, gap), 120.0])
    x = np.interp(s, corners_s, [0.0, 50.0, 35.0, 35.0 + 120.0 - corners_s[2]])
    z = np.interp(s, corners_s, [0.0, 0.0, gap, gap])
    y = np.linspace(0.0, 80.0, 41)
    vertices = np.stack(np.broadcast_arrays(x[None], y[:, None], z[None]), axis=-1).reshape(-1, 3)
    flat = np.stack(np.meshgrid(s, y), axis=-1).reshape(-1, 2)
    k = np.arange(count * 41).reshape(41, count)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[:-1, 1:], k[1:, :-1], k[1:, 1:]))
    faces = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    texture = np.random.default_rng(0).integers(0, 200, (480, 640, 3), dtype=np.uint8)
    return FlatMesh(vertices, faces, pinhole(vertices), texture, {}, flat)


def covered(page):
    painting = paint_page(page, DPI)
    return cover(page, painting, kinds_of(painting.mask), viewpoint(page), DPI), painting


def kinds_of(mask):
    return np.where(mask, CoverageClass.MEASURED, CoverageClass.OUTSIDE).astype(np.uint8)


def seen_by_rays(page):
    """(h, w) bool: what rays from the camera's place reach first, on the printed side."""
    over = page_map(page.flat, page.faces, page.vertices, DPI).astype(float)
    way = over - CAMERA_CENTRE
    length = np.linalg.norm(way, axis=2)
    face, reach = RayCaster(page.vertices, page.faces).first_hit(CAMERA_CENTRE, way / length[..., None])
    a, b, c = (page.vertices[page.faces[face, k]] for k in range(3))
    facing = np.einsum("ijk,ijk->ij", np.cross(b - a, c - a), way) < 0
    return (np.abs(reach - length) < 0.05) & facing


def test_surfaces_under_a_pleat_are_hidden_as_by_ray_casting():
    page = folded()
    found, _ = covered(page)
    rays = seen_by_rays(page)
    assert 0.25 < 1 - rays.mean() < 0.35
    assert "hidden from the camera" in found.findings(DPI)[0].text
    sure = binary_erosion(rays, iterations=EDGE_PX), binary_erosion(~rays, iterations=EDGE_PX)
    assert found.mask[sure[0]].all()
    assert (found.seen[sure[1]] == CoverageClass.OCCLUDED).all()
    assert found.fractions()["occluded"] == pytest.approx(1 - rays.mean(), abs=0.02)


def test_a_curved_page_without_occlusion_is_wholly_visible():
    page = folded()
    steps = np.interp(page.flat[:, 0], [0, 60, 120], [0, 30.0, 0])
    vertices = np.column_stack([page.flat[:, 0] * 0.87, page.flat[:, 1], steps])
    found, _ = covered(replace(page, vertices=vertices, texcoords=pinhole(vertices)))
    assert found.findings(DPI) == []
    assert found.fractions() == {
        "measured": 1.0,
        "interpolated": 0.0,
        "occluded": 0.0,
        "inpainted": 0.0,
        "obstructed": 0.0,
        "facing": 0.0,
        "erased": 0.0,
    }


def test_the_camera_centre_is_fitted_to_texture_coordinates():
    page = folded()
    camera = pinhole_camera(page.vertices, page.texcoords)
    np.testing.assert_allclose(centre_of(camera), CAMERA_CENTRE, atol=CENTRE_MM)


def test_texture_coordinates_of_no_pinhole_give_no_camera_centre():
    page = folded()
    rng = np.random.default_rng(1)
    assert pinhole_camera(page.vertices, rng.uniform(0, 600, page.texcoords.shape)) is None  # an atlas
    level = np.column_stack([page.flat, np.zeros(len(page.flat))])
    assert pinhole_camera(level, pinhole(level)) is None  # a plane may have been seen from anywhere
    assert pinhole_camera(page.vertices[:5], page.texcoords[:5]) is None


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("noise_px", [0.0, 0.05])
def test_a_camera_at_infinity_is_on_the_side_that_the_page_is_turned_to(seed, noise_px):
    page = folded()
    noise = np.random.default_rng(seed).normal(0, noise_px, (len(page.flat), 2))
    parallel = page.vertices[:, :2] * [4.0, -4.0] + [320.0, 400.0] + noise
    found, _ = covered(replace(page, texcoords=parallel))
    from_behind, _ = covered(replace(page, texcoords=parallel, faces=page.faces[:, ::-1]))
    for one in (found, from_behind):
        assert one.fractions()["occluded"] == pytest.approx(HIDDEN_FRACTION, abs=FRACTION_ROUNDING)


def test_hidden_pixels_are_white_and_a_hole_in_the_surface_is_hidden():
    page = folded()
    middle = page.flat[page.faces].mean(axis=1)
    hole = np.linalg.norm(middle - [100.0, 40.0], axis=1) < 6.0
    found, painting = covered(replace(page, faces=page.faces[~hole]))
    y, x = round(40.0 * DPI / MM_PER_INCH), round(100.0 * DPI / MM_PER_INCH)
    assert found.seen[y, x] == CoverageClass.OCCLUDED
    image = blank_hidden(painting.image, found)
    assert (image[found.seen == CoverageClass.OCCLUDED] == 255).all()
    np.testing.assert_array_equal(image[found.mask], painting.image[found.mask])


@pytest.mark.parametrize(("radius", "codes"), [(6.0, []), (30.0, ["gap"])])
def test_a_broad_hole_in_the_surface_is_reported_and_hidden_by_nothing(radius, codes):
    page = replace(folded(), texcoords=folded().flat)  # no camera
    middle = page.flat[page.faces].mean(axis=1)
    found, _ = covered(replace(page, faces=page.faces[np.linalg.norm(middle - [60.0, 40.0], axis=1) > radius]))
    assert [one.code for one in found.findings(DPI)] == codes
    if codes:
        across = float(found.findings(DPI)[0].text.split(" mm across")[0].split()[-1])
        assert across == pytest.approx(2 * radius, abs=4.0)  # a face of 2 mm on either side


def test_a_chart_may_fill_its_picture():
    page = folded()
    filled = replace(page, texcoords=page.flat / page.flat.max(axis=0) * [639.0, 479.0])
    painting = paint_page(filled, DPI)
    kinds = kinds_of(painting.mask)
    assert cover(filled, painting, kinds, None, DPI).cut > 0.9
    assert cover(filled, painting, kinds, None, DPI, may_be_cut=False).cut is None


def test_the_fraction_of_the_outline_at_the_edge_of_the_picture():
    rows, cols = np.indices((20, 40)).astype(np.float32)
    inside = np.dstack([cols + 100, rows + 100]).astype(np.float32)
    page = np.ones((20, 40), bool)
    assert cropped_fraction(page, inside.__getitem__, (480, 640)) == 0.0
    cut = np.dstack([cols, rows + 100]).astype(np.float32)  # its left side, 20 of 116 pixels, and the next columns
    assert cropped_fraction(page, cut.__getitem__, (480, 640)) == pytest.approx((20 + 2 * 3) / 116)
    assert cut_findings(0.0) == []
    (found,) = cut_findings(cropped_fraction(page, cut.__getitem__, (480, 640)))
    assert found.text.startswith("22% of the page's outline is at the edge of the image")


def test_a_picture_that_mirrors_its_surface_is_reported_and_hides_as_much():
    page = folded()
    mirrored = replace(page, vertices=page.vertices * [-1.0, 1.0, 1.0])
    (reported,) = mirror_findings(mirrored)
    assert "mirror images of each other" in reported.text
    assert mirror_findings(page) == []
    np.testing.assert_array_equal(covered(mirrored)[0].seen, covered(page)[0].seen)


@pytest.mark.parametrize("finer", [1, 4])
@pytest.mark.parametrize(("across_mm", "reported"), [(16.0, False), (26.0, True)])
def test_a_broad_area_without_range_is_reported(across_mm, reported, finer):
    """And its width, at any resolution; dots and lines of any length are no area."""
    dpi = DPI * finer
    seen = np.full((400 * finer, 500 * finer), CoverageClass.MEASURED, np.uint8)
    seen[:: 3 if finer > 1 else 7] = CoverageClass.INTERPOLATED
    radius = 0.5 * across_mm * dpi / MM_PER_INCH
    rows, cols = np.indices(seen.shape)
    seen[np.hypot(rows - 200 * finer, cols - 250 * finer) < radius] = CoverageClass.INTERPOLATED
    findings = filled_findings(seen, dpi)
    assert len(findings) == reported
    if reported:
        across = float(findings[0].text.split(" mm across")[0].split()[-1])
        assert across == pytest.approx(across_mm, abs=1.0)
