"""From the patches of a chart to a colour profile: a tone curve and a matrix."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from scipy.optimize import minimize_scalar

from restore import BadInput
from restore.scan import Floats
from station.colour.chart import Chart
from station.colour.evenness import EVEN, measure_evenness
from station.colour.lab import difference, lab_of_linear, luminance, luminance_of_lab
from station.images.icc import SRGB_CURVE, Curve, MatrixProfile, srgb_matrix

EXPONENTS = (1.4, 3.4)  # of the tone curve, sRGB's being 2.4: from flat to harsh, beyond what cameras are set to
TOLERANCE = 1e-3  # of the exponent: less than 0.01 of any colour difference
FULL = 255.0
ROUNDS = 4  # of lamp and fit in turn: each makes the other's error a fraction of what it was
FOLDS = 8  # of three patches each: left out together, from all over the chart
NEAR = 0.3  # to the exponent of all patches, within which that of a fold lies
# Of the difference of the same patches in wrong orders. Patches of no chart fit in their own order as badly as in any;
# half of that is what cameras stay far below, as their colours differ by some ΔE where those of the chart differ by 40.
MAX_FIT = 0.5
WRONG_ORDERS = (5, 7, 11, 13, 17)  # patches by which the order is shifted: no row of six comes to lie on another
ALL_CODES = (-1.0, 2.0)  # range of light that OpenCV takes: from 0 to 0.98 it would leave out black and white patches


@dataclass(frozen=True, eq=False)
class ColourFit:
    """Codes through the curve of an exponent, then a matrix to linear sRGB.

    matrix: (3, 3).
    reference: (24, 3), L*a*b* of the chart's patches.
    uncorrected: (24, 3), measured L*a*b* with the codes as sRGB.
    corrected: (24, 3), measured L*a*b* by the fit, in even light.
    left_out: (24, 3), the same, each patch by a fit of curve and matrix that it had no part in.
    noise: (24,), standard deviation of L* within the patches by the fit.
    fall_off: fraction of the light that is lost from the brightest patch to the darkest; 0 in even light.
    """

    exponent: float
    matrix: Floats
    reference: Floats
    uncorrected: Floats
    corrected: Floats
    left_out: Floats
    noise: Floats
    fall_off: float = 0.0

    def profile(self, name: str) -> MatrixProfile:
        """The fit as an ICC profile of the camera."""
        curve = tone_curve(self.exponent)
        return MatrixProfile(name, srgb_matrix() @ self.matrix, (curve, curve, curve), kind="scnr")


def fit_colours(chart: Chart) -> ColourFit:
    """Find the exponent and the matrix that bring patches nearest the chart, by CIEDE2000.

    Where light falls unevenly on the chart, it is removed from the patches first. Raises BadInput when the patches are
    not of a chart.
    """
    lamp, reference = EVEN, _matrix(chart.codes, SRGB_CURVE[0])[1]
    exponent = _exponent(chart.codes, lamp.light, reference)
    _refuse_noise(chart.codes, exponent, reference)
    for _ in range(ROUNDS):
        matrix, _ = _matrix(chart.codes, exponent, lamp.light)
        seen = linear_light(chart.codes, exponent) @ matrix.T
        lamp = measure_evenness(luminance(seen), luminance_of_lab(reference))
        if not lamp.fall_off:
            break
        exponent = _exponent(chart.codes, lamp.light, reference)
    matrix, _ = _matrix(chart.codes, exponent, lamp.light)
    corrected = _seen(chart.codes, exponent, lamp.light, matrix)
    with_noise = _seen(chart.codes + chart.noise, exponent, lamp.light, matrix)
    uncorrected = lab_of_linear(linear_light(chart.codes, SRGB_CURVE[0]))
    left_out = _left_out(chart.codes, exponent, lamp.light, reference)
    noise = np.abs(with_noise - corrected)[:, 0]
    return ColourFit(exponent, matrix, reference, uncorrected, corrected, left_out, noise, lamp.fall_off)


def _exponent(
    codes: Floats, light: Floats, reference: Floats, around: float | None = None, weights: Floats | None = None
) -> float:
    """Return the exponent of least mean difference of patches (24, 3) under light (24,)."""
    least, most = EXPONENTS if around is None else (max(around - NEAR, EXPONENTS[0]), min(around + NEAR, EXPONENTS[1]))
    optimum = minimize_scalar(
        lambda exponent: _mean_difference(codes, exponent, light, reference, weights),
        bounds=(least, most),
        method="bounded",
        options={"xatol": TOLERANCE if around is None else 10 * TOLERANCE},
    )
    return float(optimum.x)


def _left_out(codes: Floats, exponent: float, light: Floats, reference: Floats) -> Floats:
    """Return L*a*b* of patches, each by the fit to those of other folds.

    Under light (24,). Returns (24, 3).
    """
    lab = np.empty_like(codes)
    for fold in range(FOLDS):
        out = np.arange(len(codes)) % FOLDS == fold
        weights = np.where(out, 0.0, 1.0)
        own = _exponent(codes, light, reference, exponent, weights)
        lab[out] = _seen(codes, own, light, _matrix(codes, own, light, weights)[0])[out]
    return lab


def _seen(codes: Floats, exponent: float, light: Floats, matrix: Floats) -> Floats:
    """Return L*a*b* (24, 3) of patches in even light."""
    return lab_of_linear(linear_light(codes, exponent) / light[:, None] @ matrix.T)


def _refuse_noise(codes: Floats, exponent: float, reference: Floats) -> None:
    """Raise BadInput when patches (24, 3) do not fit the chart.

    They fit little better than in wrong orders, as patches of no chart do.
    """
    fitted = _mean_difference(codes, exponent, EVEN.light, reference)
    wrong_orders = (np.roll(codes, shift, axis=0) for shift in WRONG_ORDERS)
    disordered = float(np.median([_mean_difference(order, exponent, EVEN.light, reference) for order in wrong_orders]))
    if fitted > MAX_FIT * disordered:
        raise BadInput(
            f"the image shows no colour chart: its patches differ from the chart by {fitted:.0f} ΔE2000 on average, "
            f"in wrong orders by {disordered:.0f}",
            "show a whole ColorChecker Classic, squarely, without glare, and nothing like it next to it",
        )


def tone_curve(exponent: float) -> Curve:
    """Return the curve of sRGB with another exponent.

    Its straight part is as steep as to meet the rest.
    """
    _, a, b, _, d = SRGB_CURVE
    return exponent, a, b, (a * d + b) ** exponent / d, d


def linear_light(codes: Floats, exponent: float) -> Floats:
    """Return light (…, 3), 0 to 1, of codes through an exponent's curve.

    codes: (…, 3), 0 to 255.
    """
    g, a, b, c, d = tone_curve(exponent)
    fraction = np.asarray(codes) / FULL
    return np.asarray(np.where(fraction >= d, (a * np.maximum(fraction, d) + b) ** g, c * fraction))


def _mean_difference(
    codes: Floats, exponent: float, light: Floats, reference: Floats, weights: Floats | None = None
) -> float:
    matrix, _ = _matrix(codes, exponent, light, weights)
    return float(np.average(difference(_seen(codes, exponent, light, matrix), reference), weights=weights))


def _matrix(
    codes: Floats, exponent: float, light: Floats = EVEN.light, weights: Floats | None = None
) -> tuple[Floats, Floats]:
    """Fit the matrix (3, 3) from light to linear sRGB.

    light: (24,), that falls on the patches.
    weights: (24,), of the patches, 0 for those that have no part in the fit.
    Returns also the L*a*b* of the chart's own patches that have a part in it.
    """
    seen = (linear_light(codes, exponent) / light[:, None]).reshape(-1, 1, 3)
    cv: Any = cv2.ccm  # its names changed from OpenCV 4 to 5, and the type stubs know one of them
    listed = None if weights is None else np.asarray(weights, np.float64).reshape(-1, 1)
    if hasattr(cv.ColorCorrectionModel, "compute"):
        model = cv.ColorCorrectionModel(seen, cv.COLORCHECKER_MACBETH)
        model.setLinearization(cv.LINEARIZATION_IDENTITY)
        model.setCcmType(cv.CCM_LINEAR)
        model.setSaturatedThreshold(*ALL_CODES)
        if listed is not None:
            model.setWeightsList(listed)
        matrix, reference = model.compute(), model.getRefLinearRGB()
    else:
        model = cv.ColorCorrectionModel(seen, cv.COLORCHECKER_Macbeth)
        model.setLinear(cv.LINEARIZATION_IDENTITY)
        model.setCCM_TYPE(cv.CCM_3x3)
        model.setSaturatedThreshold(*ALL_CODES)
        if listed is not None:
            model.setWeightsList(listed)
        model.run()
        matrix, reference = model.getCCM(), model.get_dst_rgbl()
    return np.asarray(matrix, np.float64).T, lab_of_linear(reference.reshape(-1, 3))  # OpenCV's rows are colours
