"""Creases are detected where two planes meet, under the scanner's noise, and nowhere else."""

import cv2
import numpy as np
import pytest

from restore.range_image.facets.creases import HALF_WIDTH, REACH, _filtered, _kink_kernel, _spectrum, find_creases

FOLD_DEG = 45.0  # at 0.9 m a kink of 29 standard deviations over a window, five times what has to stand out
SLIGHT_DEG = 15.0  # 3.4 standard deviations over 7×7 samples, 9 over the window that is longer along the fold
FAINT_DEG = 4.0  # 2.5 standard deviations over that
MAX_OFFSET = 1.5  # samples: the ridge falls between two samples, and noise may prefer the next
MAX_GAP = 4  # samples along the ridge without a single crease are a gap
MAX_FALSE_SAMPLES = 10  # of 32,000 samples that noise passes for a crease, correlated along the stripe as it is
SINGLE = 1e-5  # sums of white noise of deviation 1, in single precision
CORRELATION = np.array([[0.3, 1.0, 0.0]]) / np.hypot(0.3, 1.0)  # 0.28 with the next sample of the row


def noise(camera, seed, *, correlated=False):
    samples = np.random.default_rng(seed).normal(0.0, camera.noise, camera.shape)
    return cv2.filter2D(samples, -1, CORRELATION) if correlated else samples


def creases(camera, inverse_depth, inside=None, deviation=None):
    inside = np.ones(camera.shape, bool) if inside is None else inside
    level = np.nanmedian(inverse_depth)
    deviation = np.full(camera.shape, camera.noise) if deviation is None else deviation
    return find_creases(np.where(inside, inverse_depth - level, 0.0), deviation, inside)


@pytest.mark.parametrize("correlated", [False, True])
@pytest.mark.parametrize("angle_deg", [0.0, 10.0, 22.5, 30.0, 45.0, 60.0, 75.0, 90.0, 130.0])
def test_a_fold_is_detected_along_its_whole_length_and_one_sample_wide(camera, angle_deg, correlated):
    roof = camera.roof(FOLD_DEG, angle_deg, 100.3)
    across, along = camera.about_ridge(angle_deg, 100.3)
    found = creases(camera, roof + noise(camera, 0, correlated=correlated))
    inner = np.zeros(camera.shape, bool)
    inner[HALF_WIDTH:-HALF_WIDTH, HALF_WIDTH:-HALF_WIDTH] = True
    ridge = along[inner & (np.abs(across) < 1.0)]
    on_ridge = np.sort(along[found & (np.abs(across) < MAX_OFFSET)])
    assert np.diff(on_ridge, prepend=ridge.min(), append=ridge.max()).max() < MAX_GAP
    assert (found & (np.abs(across) >= MAX_OFFSET)).sum() <= MAX_FALSE_SAMPLES + 0.03 * len(
        on_ridge
    )  # it answers beside itself
    steps = np.ceil(np.ptp(ridge) * max(abs(np.cos(np.deg2rad(angle_deg))), abs(np.sin(np.deg2rad(angle_deg)))))
    stairs = 2.0 if angle_deg in (45.0, 130.0) else 1.2  # a diagonal line of samples that touch by their sides
    assert len(on_ridge) <= stairs * steps + 2


def test_a_valley_is_detected_like_a_ridge(camera):
    roof = camera.roof(FOLD_DEG, 0.0, 100.3)
    found = creases(camera, 2 * roof.max() - roof + noise(camera, 1))
    assert set(np.nonzero(found)[1]) <= {99, 100, 101}
    assert found.sum() >= camera.rows - 2 * HALF_WIDTH


@pytest.mark.parametrize("correlated", [False, True])
@pytest.mark.parametrize("hollow", [False, True], ids=["convex", "hollow"])
@pytest.mark.parametrize("radius", [60.0, 100.0, 170.0])
def test_a_curl_has_no_crease(camera, radius, hollow, correlated):
    curl = camera.cylinder(radius, hollow=hollow)
    assert creases(camera, curl + noise(camera, 2, correlated=correlated)).sum() <= MAX_FALSE_SAMPLES


@pytest.mark.parametrize("correlated", [False, True])
def test_noise_has_no_crease(camera, correlated):
    counts = [creases(camera, camera.plane() + noise(camera, seed, correlated=correlated)).sum() for seed in range(5)]
    assert max(counts) <= MAX_FALSE_SAMPLES


@pytest.mark.parametrize("angle_deg", [0.0, 20.0, 45.0, 75.0])
def test_a_slight_fold_is_detected_by_its_length(camera, angle_deg):
    across, along = camera.about_ridge(angle_deg, 100.3)
    found = creases(camera, camera.roof(SLIGHT_DEG, angle_deg, 100.3) + noise(camera, 6))
    inner = np.zeros(camera.shape, bool)
    inner[HALF_WIDTH:-HALF_WIDTH, HALF_WIDTH:-HALF_WIDTH] = True
    ridge = along[inner & (np.abs(across) < 1.0)]
    seen = along[found & (np.abs(across) < 2 * MAX_OFFSET)]
    assert len(np.unique(np.floor(seen))) > 0.8 * np.ptp(ridge)
    assert (found & (np.abs(across) >= 2 * MAX_OFFSET)).sum() <= MAX_FALSE_SAMPLES


def test_a_fold_below_the_noise_is_not_detected(camera):
    assert creases(camera, camera.roof(FAINT_DEG, 20.0, 100.3) + noise(camera, 3)).sum() <= MAX_FALSE_SAMPLES


def test_noisier_samples_need_a_sharper_crease(camera):
    """A fold across a dark half of the page: what is a crease on paper is noise in ink."""
    roof = camera.roof(FOLD_DEG, 90.0, 100.0)
    deviation = np.where(np.arange(camera.cols) < 100, camera.noise, 10 * camera.noise) * np.ones(camera.shape)
    found = creases(camera, roof + noise(camera, 4) / camera.noise * deviation, deviation=deviation)
    assert found[:, : 100 - HALF_WIDTH].any(axis=0).mean() > 0.9
    assert found[:, 100 + HALF_WIDTH :].sum() <= MAX_FALSE_SAMPLES


@pytest.mark.parametrize("times", [1e3, 1e4, 1e6])
def test_one_sample_that_is_far_noisier_than_the_others_hides_no_crease(camera, times):
    roof, deviation = camera.roof(FOLD_DEG, 0.0, 100.3) + noise(camera, 8), np.full(camera.shape, camera.noise)
    expected = creases(camera, roof, deviation=deviation)
    deviation[60, 40] *= times
    roof[60, 40] += camera.noise * times
    np.testing.assert_array_equal(creases(camera, roof, deviation=deviation), expected)


def test_filled_holes_have_no_crease(camera):
    filled = creases(camera, camera.roof(FOLD_DEG, 0.0, 100.3), deviation=np.zeros(camera.shape))
    assert not filled.any()


def test_a_gap_is_not_a_crease_and_does_not_hide_one(camera):
    roof = camera.roof(FOLD_DEG, 0.0, 100.3) + noise(camera, 7)
    rows, cols = camera.indices
    gap = np.hypot(rows - 60, cols - 40) < 20
    whole, holed = creases(camera, roof), creases(camera, np.where(gap, np.nan, roof))
    assert set(np.nonzero(holed)[1]) <= {99, 100, 101}
    np.testing.assert_array_equal(holed[:, 99:102], whole[:, 99:102])


def test_the_outline_is_not_a_crease_at_any_angle(camera):
    rows, cols = camera.indices
    turned = np.abs(rows - 80) + np.abs(cols - 100) < 70  # its sides run at 45°, its corners are sharp
    slanted = camera.plane((0.4, 0.3, 1.0)) + noise(camera, 5)
    assert creases(camera, slanted, inside=turned).sum() <= MAX_FALSE_SAMPLES


@pytest.mark.parametrize("angle", np.arange(4) * np.pi / 5)
def test_a_kernel_filters_the_spectrum_as_it_does_the_picture(angle):
    picture, kernel = np.random.default_rng(1).normal(0, 1, (61, 84)), _kink_kernel(angle)
    expected = cv2.filter2D(picture, cv2.CV_64F, kernel, borderType=cv2.BORDER_CONSTANT)[REACH:-REACH, REACH:-REACH]
    filtered = _filtered(_spectrum(picture.astype(np.float32)), kernel, picture.shape)[REACH:-REACH, REACH:-REACH]
    np.testing.assert_allclose(filtered, expected, atol=SINGLE)


def test_samples_that_were_all_filled_in_have_no_crease(camera):
    assert not creases(camera, camera.roof(FOLD_DEG, 0.0, 100.3), deviation=np.zeros(camera.shape)).any()
