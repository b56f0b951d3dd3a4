"""From the patches of a chart to a colour profile: a tone curve and a matrix."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from scipy.optimize import minimize_scalar

from restore import BadInput, Floats
from station.colour.chart import Chart
from station.colour.lab import difference, lab_of_linear
from station.export.icc import SRGB_CURVE, Curve, MatrixProfile, srgb_matrix

EXPONENTS = (1.4, 3.4)  # of the tone curve, sRGB's being 2.4: from flat to harsh, beyond what cameras are set to
TOLERANCE = 1e-3  # of the exponent: less than 0.01 of any colour difference
FULL = 255.0
# Of the difference of the same patches in wrong orders. Patches of no chart fit in their own order as badly as in any;
# half of that is what cameras stay far below, as their colours differ by some ΔE where those of the chart differ by 40.
MAX_FIT = 0.5
WRONG_ORDERS = (5, 7, 11, 13, 17)  # patches by which the order is shifted: no row of six comes to lie on another
ALL_CODES = (-1.0, 2.0)  # range of light that OpenCV takes: from 0 to 0.98 it would leave out black and white patches


@dataclass(frozen=True, eq=False)
class ColourFit:
    """Codes through the curve of an exponent, then the matrix (3, 3) to linear sRGB.

    reference    (24, 3) L*a*b* of the chart's patches.
    uncorrected  (24, 3) measured L*a*b* if the codes are taken for sRGB.
    corrected    (24, 3) measured L*a*b* by the fit.
    noise        (24,) standard deviation of L* within the patches by the fit.
    """

    exponent: float
    matrix: Floats
    reference: Floats
    uncorrected: Floats
    corrected: Floats
    noise: Floats

    def profile(self, name: str) -> MatrixProfile:
        """The fit as an ICC profile of the camera."""
        curve = tone_curve(self.exponent)
        return MatrixProfile(name, srgb_matrix() @ self.matrix, (curve, curve, curve), kind="scnr")


def fit_colours(chart: Chart) -> ColourFit:
    """Find the exponent and the matrix that bring the patches nearest to the chart's colours, by CIEDE2000.

    Raises BadInput when the patches are none of a chart.
    """
    optimum = minimize_scalar(
        lambda exponent: _mean_difference(chart.codes, exponent),
        bounds=EXPONENTS,
        method="bounded",
        options={"xatol": TOLERANCE},
    )
    exponent = float(optimum.x)
    _refuse_noise(chart.codes, exponent)
    matrix, reference = _matrix(chart.codes, exponent)
    corrected = lab_of_linear(linear_light(chart.codes, exponent) @ matrix.T)
    with_noise = lab_of_linear(linear_light(chart.codes + chart.noise, exponent) @ matrix.T)
    uncorrected = lab_of_linear(linear_light(chart.codes, SRGB_CURVE[0]))
    return ColourFit(exponent, matrix, reference, uncorrected, corrected, np.abs(with_noise - corrected)[:, 0])


def _refuse_noise(codes: Floats, exponent: float) -> None:
    """Raise BadInput when patches (24, 3) fit the chart little better than in wrong orders, as those of no chart do."""
    fitted = _mean_difference(codes, exponent)
    wrong_orders = (np.roll(codes, shift, axis=0) for shift in WRONG_ORDERS)
    disordered = float(np.median([_mean_difference(order, exponent) for order in wrong_orders]))
    if fitted > MAX_FIT * disordered:
        raise BadInput(
            f"what was found is no colour chart: its patches differ from the chart by {fitted:.0f} ΔE2000 on average, "
            f"in wrong orders by {disordered:.0f}",
            "show a whole ColorChecker Classic, squarely, without glare, and nothing like it beside it",
        )


def tone_curve(exponent: float) -> Curve:
    """The curve of sRGB with another exponent, its straight part as steep as to meet the rest."""
    _, a, b, _, d = SRGB_CURVE
    return exponent, a, b, (a * d + b) ** exponent / d, d


def linear_light(codes: Floats, exponent: float) -> Floats:
    """(…, 3) light, 0 to 1, of codes (…, 3), 0 to 255, through the curve of an exponent."""
    g, a, b, c, d = tone_curve(exponent)
    share = np.asarray(codes) / FULL
    return np.asarray(np.where(share >= d, (a * np.maximum(share, d) + b) ** g, c * share))


def _mean_difference(codes: Floats, exponent: float) -> float:
    matrix, reference = _matrix(codes, exponent)
    return float(difference(lab_of_linear(linear_light(codes, exponent) @ matrix.T), reference).mean())


def _matrix(codes: Floats, exponent: float) -> tuple[Floats, Floats]:
    """The matrix (3, 3) from light to linear sRGB, and the L*a*b* (24, 3) of the chart's own patches."""
    light = linear_light(codes, exponent).reshape(-1, 1, 3)
    cv: Any = cv2.ccm  # its names changed from OpenCV 4 to 5, and the type stubs know one of them
    if hasattr(cv.ColorCorrectionModel, "compute"):
        model = cv.ColorCorrectionModel(light, cv.COLORCHECKER_MACBETH)
        model.setLinearization(cv.LINEARIZATION_IDENTITY)
        model.setCcmType(cv.CCM_LINEAR)
        model.setSaturatedThreshold(*ALL_CODES)
        matrix, reference = model.compute(), model.getRefLinearRGB()
    else:
        model = cv.ColorCorrectionModel(light, cv.COLORCHECKER_Macbeth)
        model.setLinear(cv.LINEARIZATION_IDENTITY)
        model.setCCM_TYPE(cv.CCM_3x3)
        model.setSaturatedThreshold(*ALL_CODES)
        model.run()
        matrix, reference = model.getCCM(), model.get_dst_rgbl()
    return np.asarray(matrix, np.float64).T, lab_of_linear(reference.reshape(-1, 3))  # OpenCV's rows are colours
