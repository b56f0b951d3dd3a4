"""The plane of a table and its noise, from samples that are many or few, on one plane or two."""

import numpy as np
import pytest

from restore.numerics.robust import OUTLYING, SIGNIFICANT
from restore.range_image.segmentation.plane import fit_table_plane, lies_on
from restore.range_image.segmentation.surface import BLOCK, UNEVEN_MM
from restore.scan import RangeScan

DISTANCE_MM = 921.5
TILTED = (0.2, -0.1, 1.0)
NOISES = 3.0  # the table's noise in that of paper


def band_of(camera):
    band = np.ones(camera.shape, bool)
    band[12:-12, 12:-12] = False
    return band


def plane_of(camera, inverse_depth, band, apart=1):
    return fitted(camera, inverse_depth, band, apart)[0]


def fitted(camera, inverse_depth, band, apart=1):
    scan = RangeScan(camera.rays.points(*camera.indices, inverse_depth), None, np.zeros((*camera.shape, 2)))
    return fit_table_plane(scan, inverse_depth, band, apart)


@pytest.mark.parametrize("share", [0.05, 0.3, 1.0])
def test_all_samples_lie_on_it_and_its_noise_is_theirs(camera, share):
    """To a sixth: a twentieth of the band are 400 samples."""
    random = np.random.default_rng(3)
    noise = NOISES * camera.noise
    inverse_depth = camera.plane(TILTED) + random.normal(0.0, noise, camera.shape)
    inverse_depth[random.random(camera.shape) > share] = np.nan
    plane = plane_of(camera, inverse_depth, band_of(camera) & np.isfinite(inverse_depth))
    assert plane.tolerance == pytest.approx(OUTLYING * noise * DISTANCE_MM**2, rel=1 / 6)
    assert plane.samples[plane.measured].mean() > 0.995
    assert abs(np.nanmean(plane.height)) < 0.1 * plane.tolerance
    assert plane.pitch == pytest.approx(camera.pitch_mm, rel=0.02)


def test_height_is_in_millimetres_towards_the_scanner(camera):
    raised = np.zeros(camera.shape, bool)
    raised[40:120, 50:150] = True
    plane = plane_of(
        camera, np.where(raised, camera.plane(distance=DISTANCE_MM - 4.0), camera.plane()), band_of(camera)
    )
    assert plane.height[raised].mean() == pytest.approx(4.0, rel=0.02)
    assert lies_on(plane, ~raised)
    assert not lies_on(plane, raised)
    assert not lies_on(plane, np.zeros_like(raised))


def test_the_plane_of_most_samples_is_taken(camera):
    """A page 9 mm above the table covers a third of the band."""
    page = camera.indices[1] < 60
    plane = plane_of(camera, np.where(page, camera.plane(distance=DISTANCE_MM - 9.0), camera.plane()), band_of(camera))
    assert plane.samples[~page].all()
    assert not plane.samples[page].any()


def test_a_page_just_above_the_table_does_not_tilt_its_plane(camera):
    """It covers more than a third of the band, twelve times the noise of a sample above the table."""
    page = camera.indices[1] < 60
    raised = camera.plane(distance=DISTANCE_MM - 12.0 * camera.noise * DISTANCE_MM**2)
    noise = np.random.default_rng(5).normal(0.0, camera.noise, camera.shape)
    band = band_of(camera)
    plane, own = fitted(camera, np.where(page, raised, camera.plane()) + noise, band)
    assert plane.samples[~page].mean() > 0.995
    assert not plane.samples[page].any()
    assert own[band & ~page].mean() > 0.9
    assert not own[(camera.indices[1] < 60 - BLOCK) | ~band].any()


def test_samples_of_a_single_row_have_no_plane(camera):
    band = np.zeros(camera.shape, bool)
    band[3] = True
    plane, own = fitted(camera, np.where(band, camera.plane(), np.nan), band)
    assert not own.any()
    assert not plane.samples.any()
    np.testing.assert_array_equal(plane.measured, band)


def test_every_second_row_alone_gives_the_noise(camera):
    inverse_depth = camera.plane() + np.random.default_rng(5).normal(0.0, camera.noise, camera.shape)
    inverse_depth[1::2] = np.nan
    plane = plane_of(camera, inverse_depth, band_of(camera) & np.isfinite(inverse_depth))
    assert plane.tolerance == pytest.approx(OUTLYING * camera.noise * DISTANCE_MM**2, rel=0.1)


def test_noise_that_is_smooth_over_some_samples_is_measured_farther_apart(camera):
    """As within the faces of a mesh: four samples of the view lie between two vertices."""
    rows, cols = camera.shape
    vertices = np.random.default_rng(6).normal(0.0, camera.noise, (rows // 4 + 2, cols))
    at = np.arange(rows) / 4.0
    low = at.astype(int)
    between = (at - low)[:, None]
    smooth = (1.0 - between) * vertices[low] + between * vertices[low + 1]
    near, apart = (plane_of(camera, camera.plane() + smooth, band_of(camera), apart).tolerance for apart in (1, 4))
    assert apart == pytest.approx(OUTLYING * camera.noise * DISTANCE_MM**2, rel=1 / 6)
    uneven = OUTLYING * UNEVEN_MM[0] / SIGNIFICANT
    assert near**2 - uneven**2 < (0.5 * apart) ** 2
