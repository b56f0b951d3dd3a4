"""Find creases in a noisy surface: where a kink stands out of the noise."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.ndimage import binary_erosion, label

from restore.quadratics import POWERS
from restore.scan import Floats, Mask

RADIUS = 3  # samples: a fold of 30° shows over 7×7 samples of a Vivid at 0.9 m, and finer ones hardly bend a facet
DIRECTIONS = 8  # every 22.5°: half of that off the crease, a kink still gives 90 % of its response
# Hysteresis (Canny 1986): a crease starts where nothing but a kink can be, since noise that is correlated along the
# stripe reaches five, and goes on while it still stands out.
KINK_SIGMAS = 5.5
FOLLOW_SIGMAS = 4.0
APART = 4  # samples: a strong crease answers again on either side, no true crease is told apart so near to it


def find_creases(data: Floats, deviation: Floats, inside: Mask) -> Mask:
    """The samples (rows, cols) that lie on a crease of the surface `inside`, one sample wide.

    data has no gaps and no outliers; deviation is the standard deviation of each sample, 0 where it was filled in.
    """
    inner = binary_erosion(inside, np.ones((2 * RADIUS + 1, 2 * RADIUS + 1)))  # the whole window is on the surface
    angles = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
    kinks = np.stack([_response(data, deviation, angle) for angle in angles])
    strongest = np.where(inner, kinks.max(axis=0), 0.0)
    across = kinks.argmax(axis=0)
    crest = np.zeros_like(inside)
    for k, angle in enumerate(angles):
        crest |= (across == k) & (strongest >= cv2.dilate(strongest, _line(angle)))
    pieces, _ = label(crest & (strongest > FOLLOW_SIGMAS), np.ones((3, 3)))
    creases: Mask = np.isin(pieces, np.setdiff1d(pieces[crest & (strongest > KINK_SIGMAS)], [0]))
    return creases


def _response(data: Floats, deviation: Floats, angle: float) -> Floats:
    kernel = _kink(angle)
    response = cv2.filter2D(data, cv2.CV_64F, kernel, borderType=cv2.BORDER_REPLICATE)
    variance = cv2.filter2D(deviation**2, cv2.CV_64F, kernel**2, borderType=cv2.BORDER_REPLICATE)
    return np.abs(response) / np.sqrt(np.maximum(variance, np.finfo(float).tiny)) * (variance > 0)


def _kink(angle: float) -> Floats:
    """Matched filter of |x| across a line through the centre, x running at `angle`; any quadratic gives nothing."""
    y, x = np.mgrid[-RADIUS : RADIUS + 1, -RADIUS : RADIUS + 1].astype(float)
    kink = np.abs(x * np.cos(angle) + y * np.sin(angle)).ravel()
    quadratic = np.stack([(x**p * y**q).ravel() for p, q in POWERS], axis=1)
    rest = kink - quadratic @ np.linalg.lstsq(quadratic, kink, rcond=None)[0]
    return (rest / (rest @ rest)).reshape(x.shape)


def _line(angle: float) -> np.ndarray:
    line = np.zeros((2 * APART + 1, 2 * APART + 1), np.uint8)
    for step in np.arange(-APART, APART + 0.5, 0.5):
        line[APART + round(step * np.sin(angle)), APART + round(step * np.cos(angle))] = 1
    return line
