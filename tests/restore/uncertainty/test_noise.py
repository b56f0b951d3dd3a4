"""Noise that is drawn has the statistics of its model, and those are found again from what facets leave of it."""

import numpy as np
import pytest

from restore.range_image.facets.facet_model import fit_facets
from restore.uncertainty.noise import Noise, draw_noise, estimate_noise

ALONG_ROW, SIGMA = 0.3, 1e-8  # 1/mm: a hundredth of a millimetre at a metre
# Of 160 × 200 samples a standard deviation is known to 0.4 %, a correlation to 0.006; facets leave fewer of both.
STANDARD_DEVIATION, CORRELATION = 0.05, 0.05


@pytest.fixture(scope="module")
def drawn(camera):
    noise = Noise(np.full(camera.indices[0].shape, SIGMA), ALONG_ROW, 0.0)
    return draw_noise(noise, np.random.default_rng(3))


def correlation(one, other):
    return float((one * other).mean() / one.std() / other.std())


def test_drawn_noise_has_the_deviation_and_the_correlations_of_its_model(drawn):
    assert drawn.std() == pytest.approx(SIGMA, rel=STANDARD_DEVIATION)
    assert correlation(drawn[:, 1:], drawn[:, :-1]) == pytest.approx(ALONG_ROW, abs=CORRELATION)
    assert correlation(drawn[1:], drawn[:-1]) == pytest.approx(0.0, abs=CORRELATION)


def test_the_model_is_found_again_from_one_scan(camera, drawn):
    samples, inside = camera.plane() + drawn, np.ones(drawn.shape, bool)
    facets = fit_facets(samples, inside, inside, camera.rays.dx, precision=1e-9)
    sheet = camera.sheet(np.dstack([facets.value, facets.slope]), inside)
    found = estimate_noise(sheet, samples, None)
    assert found.sigma.mean() == pytest.approx(SIGMA, rel=STANDARD_DEVIATION)
    assert found.along_row == pytest.approx(ALONG_ROW, abs=CORRELATION)
    assert found.along_column == pytest.approx(0.0, abs=CORRELATION)
