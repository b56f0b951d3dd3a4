"""Detect creases in a noisy surface: lines along which a kink is significant against the noise."""

from __future__ import annotations

from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from restore.bands import in_threads
from restore.numerics import TINY
from restore.range_image.quadratic_fit import POWERS
from restore.robust import robust_sigma
from restore.scan import Bytes, Floats, Mask

HALF_WIDTH = 4  # samples to either side of a crease over which its kink is measured; narrower facets hide it
HALF_LENGTH = 12  # samples along a crease, either way: 11 mm on a Vivid at 0.9 m; most creases are longer
BORDER_MARGIN = 2  # samples: kernels cut by the border of the page respond to it all along
DIRECTIONS = 16  # every 11.25°: at half of that the ends of a kernel are one sample off the crease
# Hysteresis (Canny 1986): a crease needs a sample above the first threshold and follows samples above the second.
KINK_SIGMAS = 5.5
FOLLOW_SIGMAS = 3.0
MIN_SEPARATION = 5  # samples: the filter responds to either side of a strong crease; nearer ridges are not distinct
MIN_MEASURED = 0.5  # share of measured samples in a kernel: at the border of a filled hole there are false kinks


def find_creases(data: Floats, deviation: Floats, inside: Mask) -> Mask:
    """(rows, cols) True on the creases of the surface within `inside` (rows, cols), one sample wide.

    data (rows, cols) has no outliers, and NaN where it is not known; deviation (rows, cols) is the standard deviation
    of each sample, 0 where it was filled in.
    """
    known = inside & np.isfinite(data)
    data, inner = np.where(known, data, 0.0), _eroded(known.astype(np.uint8), HALF_WIDTH)
    interior = _eroded(inner, BORDER_MARGIN)
    strongest, direction = np.zeros(inside.shape, np.float32), np.zeros(inside.shape, np.uint8)
    angles = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
    for k, kink in enumerate(in_threads(partial(_kink_sigmas, data, deviation, inner, interior), angles)):
        direction[kink > strongest] = k
        np.maximum(strongest, kink, out=strongest)
    ridge = np.zeros_like(inside)
    for k, angle in enumerate(angles):
        ridge |= (direction == k) & (strongest >= cv2.dilate(strongest, _line(angle, MIN_SEPARATION)))
    pieces, _ = label(ridge & (strongest > FOLLOW_SIGMAS), np.ones((3, 3)))
    creases: Mask = np.isin(pieces, np.setdiff1d(pieces[ridge & (strongest > KINK_SIGMAS)], [0]))
    return creases


def _eroded(mask: Bytes, samples: int) -> Bytes:
    """The mask (rows, cols) eroded by so many samples."""
    window = np.ones((2 * samples + 1, 2 * samples + 1), np.uint8)
    return np.asarray(cv2.erode(mask, window, borderValue=0), dtype=np.uint8)


def _kink_sigmas(data: Floats, deviation: Floats, inner: Bytes, interior: Bytes, angle: float) -> NDArray[np.float32]:
    """(rows, cols) kink across the direction `angle` in standard deviations of the noise, 0 where not inner.

    It is evaluated where the whole kernel is interior; from there a crease is assumed to continue to the border.
    """
    kernel, line = _kink_kernel(angle), _line(angle + np.pi / 2, HALF_LENGTH)
    variance = np.maximum(cv2.filter2D(deviation**2, cv2.CV_64F, kernel**2), 0.0)
    sigmas = np.abs(cv2.filter2D(data, cv2.CV_64F, kernel)) / np.sqrt(np.maximum(variance, TINY))
    measured = cv2.filter2D((deviation > 0).astype(np.float32), cv2.CV_32F, (kernel != 0) / np.count_nonzero(kernel))
    complete = (cv2.erode(interior, line, borderValue=0) > 0) & (measured > MIN_MEASURED)
    if not complete.any():
        return np.zeros(data.shape, np.float32)
    # Noise that is correlated between samples has a greater response than its variance predicts.
    sigmas /= max(1.0, robust_sigma(sigmas[complete]))
    known = np.where(complete, sigmas, 0.0).astype(np.float32)
    extended = cv2.dilate(known, _line(angle + np.pi / 2, HALF_LENGTH + 2 * BORDER_MARGIN))
    return np.asarray(np.where(complete, known, extended) * inner, dtype=np.float32)


def _kink_kernel(angle: float) -> Floats:
    """Matched filter of |u| across a line through the centre, u running at `angle`; its response to quadratics is 0."""
    size = HALF_WIDTH + HALF_LENGTH
    y, x = np.mgrid[-size : size + 1, -size : size + 1].astype(float)
    u, v = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    # Samples at the edge of the rectangle are weighted by the part of them inside it.
    share = np.clip(HALF_WIDTH + 0.5 - np.abs(u), 0, 1) * np.clip(HALF_LENGTH + 0.5 - np.abs(v), 0, 1)
    support = share > 0
    weight = np.sqrt(share[support])
    terms = np.stack([(u**p * v**q)[support] for p, q in POWERS], axis=1)
    fit, *_ = np.linalg.lstsq(terms * weight[:, None], np.abs(u[support]) * weight, rcond=None)
    kernel = np.zeros_like(u)
    kernel[support] = share[support] * (np.abs(u[support]) - terms @ fit)
    return kernel / (kernel * np.abs(u)).sum()


def _line(angle: float, half_length: int) -> Bytes:
    """Structuring element of a line through the centre at `angle`, half_length samples to either side."""
    line = np.zeros((2 * half_length + 1, 2 * half_length + 1), np.uint8)
    for step in np.arange(-half_length, half_length + 0.25, 0.25):
        line[half_length + round(step * np.sin(angle)), half_length + round(step * np.cos(angle))] = 1
    return line
