"""Detects creases in a noisy surface.

They are lines along which a kink is significant against the noise.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.fft import fft, irfft2, next_fast_len, rfft, rfft2
from scipy.ndimage import label

from restore.numerics.limits import SINGLE_TINY
from restore.numerics.robust import MAJORITY, SIGNIFICANT, robust_sigma
from restore.range_image.facets.quadratic_fit import POWERS
from restore.runtime.threads import in_threads
from restore.scan import Bytes, Floats, Mask

HALF_WIDTH = 4  # samples to either side of a crease over which its kink is measured; narrower facets hide it
HALF_LENGTH = 12  # samples along a crease, either way: 11 mm on a Vivid at 0.9 m; most creases are longer
REACH = HALF_WIDTH + HALF_LENGTH  # samples from the middle of a kernel to its border, whatever its direction
BORDER_MARGIN = 2  # samples: kernels cut by the border of the page respond to it all along
DIRECTIONS = 16  # every 11.25°: at half of that the ends of a kernel are one sample off the crease
# Hysteresis (Canny 1986): a crease needs a sample above the first threshold and follows samples above the second.
KINK_SIGMAS = 5.5
MAX_SPREAD = 300.0  # greatest deviation over the median, whose square is then a hundred steps of single precision

Spectrum = NDArray[np.complexfloating[Any, Any]]


def find_creases(data: Floats, deviation: Floats, inside: Mask) -> Mask:
    """Find the creases of a surface, one sample wide.

    data: (rows, cols), without outliers, NaN where unknown.
    deviation: (rows, cols), standard deviation of each sample, 0 where it was filled in.
    inside: (rows, cols), where to look.
    Returns (rows, cols) bool.
    """
    known = inside & np.isfinite(data)
    data, inner = np.where(known, data, 0.0), _eroded(known.astype(np.uint8), HALF_WIDTH)
    interior = _eroded(inner, BORDER_MARGIN)
    strongest, direction = np.zeros(inside.shape, np.float32), np.zeros(inside.shape, np.uint8)
    angles = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
    kinks = partial(_kink_sigmas, _pictures(data, deviation), inner, interior)
    for k, kink in enumerate(in_threads(kinks, angles)):
        direction[kink > strongest] = k
        np.maximum(strongest, kink, out=strongest)
    ridge = np.zeros_like(inside)
    for k, angle in enumerate(angles):
        # The filter responds to either side of a strong crease: nearer ridges are not distinct.
        ridge |= (direction == k) & (strongest >= cv2.dilate(strongest, _line(angle, HALF_WIDTH + 1)))
    pieces, _ = label(ridge & (strongest > SIGNIFICANT), np.ones((3, 3)))
    creases: Mask = np.isin(pieces, np.setdiff1d(pieces[ridge & (strongest > KINK_SIGMAS)], [0]))
    return creases


def _eroded(mask: Bytes, samples: int) -> Bytes:
    """Return the mask (rows, cols) eroded by `samples`."""
    window = np.ones((2 * samples + 1, 2 * samples + 1), np.uint8)
    return np.asarray(cv2.erode(mask, window, borderValue=0), dtype=np.uint8)


def _pictures(data: Floats, deviation: Floats) -> tuple[Spectrum, Spectrum, Spectrum]:
    """The spectra of the data, of the variance of its noise, and of what was measured.

    They are in units of the greatest deviation, for single precision, unless that stands out.
    """
    measured, greatest = deviation > 0, float(deviation.max())
    usual = float(np.median(deviation[measured])) if measured.any() else 1.0
    unit, real = (usual, np.float64) if greatest > MAX_SPREAD * usual else (greatest or 1.0, np.float32)
    pictures = data / unit, (deviation / unit) ** 2, measured
    of_data, of_variance, of_measured = (_spectrum(picture.astype(real)) for picture in pictures)
    return of_data, of_variance, of_measured


def _kink_sigmas(
    pictures: tuple[Spectrum, Spectrum, Spectrum], inner: Bytes, interior: Bytes, angle: float
) -> NDArray[np.float32]:
    """Return the kink across `angle` in standard deviations of the noise.

    It is evaluated where the whole kernel is interior; from there a crease is assumed to continue to the border.
    Returns (rows, cols), 0 where not inner.
    """
    data, variance, measured = pictures
    kernel, line = _kink_kernel(angle), _line(angle + np.pi / 2, HALF_LENGTH)
    deviation = np.sqrt(np.maximum(_filtered(variance, kernel**2, inner.shape), SINGLE_TINY))
    fraction = _filtered(measured, (kernel != 0) / np.count_nonzero(kernel), inner.shape)
    complete = (cv2.erode(interior, line, borderValue=0) > 0) & (fraction > MAJORITY)
    if not complete.any():
        return np.zeros(inner.shape, np.float32)
    sigmas = np.abs(_filtered(data, kernel, inner.shape)) / deviation
    # Noise that is correlated between samples has a greater response than its variance predicts.
    sigmas /= max(1.0, robust_sigma(sigmas[complete]))
    known = np.where(complete, sigmas, np.float32(0.0))
    extended = cv2.dilate(known, _line(angle + np.pi / 2, HALF_LENGTH + 2 * BORDER_MARGIN))
    return np.asarray(np.where(complete, known, extended) * inner, dtype=np.float32)


def _spectrum(picture: NDArray[np.floating[Any]]) -> Spectrum:
    """Return the spectrum of a picture (rows, cols), zero-padded.

    It is 0 beyond the border as far as a kernel reaches, in the picture's precision.
    """
    return np.asarray(rfft2(picture, _transformed(picture.shape)))


def _filtered(spectrum: Spectrum, kernel: Floats, shape: tuple[int, ...]) -> NDArray[np.floating[Any]]:
    """Return the picture with this spectrum, filtered by a kernel.

    kernel: (2k + 1, 2k + 1), point-symmetric. Returns (rows, cols) of a shape.
    """
    (rows, cols), middle = _transformed(shape), len(kernel) // 2
    along = rfft(kernel.astype(spectrum.real.dtype), cols, axis=1)  # its few rows alone: the others are 0
    filtered = irfft2(spectrum * fft(along, rows, axis=0), (rows, cols))
    return np.asarray(filtered[middle : middle + shape[0], middle : middle + shape[1]])


def _transformed(shape: tuple[int, ...]) -> list[int]:
    """Rows and columns that are transformed of a picture of a shape."""
    return [next_fast_len(size + REACH, real=True) for size in shape]


def _kink_kernel(angle: float) -> Floats:
    """Return the matched filter of |u| across a line at `angle`.

    The line runs through the centre; the response to quadratics is 0. The sum of its squares is 1: white noise passes
    it as it is.
    """
    y, x = np.mgrid[-REACH : REACH + 1, -REACH : REACH + 1].astype(float)
    u, v = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    # Samples at the edge of the rectangle are weighted by the part of them inside it.
    fraction = np.clip(HALF_WIDTH + 0.5 - np.abs(u), 0, 1) * np.clip(HALF_LENGTH + 0.5 - np.abs(v), 0, 1)
    support = fraction > 0
    weight = np.sqrt(fraction[support])
    terms = np.stack([(u**p * v**q)[support] for p, q in POWERS], axis=1)
    fit, *_ = np.linalg.lstsq(terms * weight[:, None], np.abs(u[support]) * weight, rcond=None)
    kernel = np.zeros_like(u)
    kernel[support] = fraction[support] * (np.abs(u[support]) - terms @ fit)
    return kernel / np.linalg.norm(kernel)


def _line(angle: float, half_length: int) -> Bytes:
    """Return the structuring element of a line through the centre.

    It runs at `angle`, half_length samples to either side.
    """
    line = np.zeros((2 * half_length + 1, 2 * half_length + 1), np.uint8)
    steps = np.arange(-half_length, half_length + 0.25, 0.25)
    row, col = (half_length + np.rint(steps * part(angle)).astype(int) for part in (np.sin, np.cos))
    line[row, col] = 1
    return line
