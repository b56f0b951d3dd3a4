"""Find creases in a noisy surface: where a kink that goes on for a while stands out of the noise."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from restore.numerics import TINY
from restore.range_image.quadratic_fit import POWERS
from restore.robust import robust_sigma
from restore.scan import Bytes, Floats, Mask

RADIUS = 4  # samples to either side of a crease tell its kink; facets that are narrower hide it
REACH = 12  # samples along it, either way: 11 mm on a Vivid at 0.9 m, and most creases of crumpled paper run as far
RIM = 2  # samples at the border of the page are cut by it, and bend the surface along all of it
DIRECTIONS = 16  # every 11.25°: half of that off the crease, its ends are a sample away from it
# Hysteresis (Canny 1986): a crease starts where nothing but a kink can be, and goes on while it still stands out.
KINK_SIGMAS = 5.5
FOLLOW_SIGMAS = 3.0
APART = 5  # samples: a strong crease answers again on either side, no true crease is told apart so near to it
SURE = 0.5  # of the samples must be measured: at the rim of what was filled in there are kinks that are none


def find_creases(data: Floats, deviation: Floats, inside: Mask) -> Mask:
    """The samples (rows, cols) that lie on a crease of the surface `inside`, one sample wide.

    data has no outliers, and NaN where nothing is known; deviation is the standard deviation of each sample, 0 where it
    was filled in.
    """
    known = inside & np.isfinite(data)
    data, inner = np.where(known, data, 0.0), _within(known.astype(np.uint8), RADIUS)
    sound = _within(inner, RIM)
    strongest, across = np.zeros(inside.shape, np.float32), np.zeros(inside.shape, np.uint8)
    angles = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
    for k, angle in enumerate(angles):
        kink = _kinks(data, deviation, inner, sound, angle)
        across[kink > strongest] = k
        np.maximum(strongest, kink, out=strongest)
    crest = np.zeros_like(inside)
    for k, angle in enumerate(angles):
        crest |= (across == k) & (strongest >= cv2.dilate(strongest, _line(angle, APART)))
    pieces, _ = label(crest & (strongest > FOLLOW_SIGMAS), np.ones((3, 3)))
    creases: Mask = np.isin(pieces, np.setdiff1d(pieces[crest & (strongest > KINK_SIGMAS)], [0]))
    return creases


def _within(mask: Bytes, samples: int) -> Bytes:
    """What of a mask lies so many samples inside it."""
    window = np.ones((2 * samples + 1, 2 * samples + 1), np.uint8)
    return np.asarray(cv2.erode(mask, window, borderValue=0), dtype=np.uint8)


def _kinks(data: Floats, deviation: Floats, inner: Bytes, sound: Bytes, angle: float) -> NDArray[np.float32]:
    """How many standard deviations a kink across the direction `angle` stands out (rows, cols), 0 where not inner.

    Only where all of its kernel is sound is it looked for: from there a crease is taken to go on to the border.
    """
    kernel, along = _kernel(angle), _line(angle + np.pi / 2, REACH)
    variance = np.maximum(cv2.filter2D(deviation**2, cv2.CV_64F, kernel**2), 0.0)
    sigmas = np.abs(cv2.filter2D(data, cv2.CV_64F, kernel)) / np.sqrt(np.maximum(variance, TINY))
    measured = cv2.filter2D((deviation > 0).astype(np.float32), cv2.CV_32F, (kernel != 0) / np.count_nonzero(kernel))
    whole = (cv2.erode(sound, along, borderValue=0) > 0) & (measured > SURE)
    if not whole.any():
        return np.zeros(data.shape, np.float32)
    # Noise that is correlated between samples reaches farther than its variance tells.
    sigmas /= max(1.0, robust_sigma(sigmas[whole]))
    known = np.where(whole, sigmas, 0.0).astype(np.float32)
    carried = cv2.dilate(known, _line(angle + np.pi / 2, REACH + 2 * RIM))
    return np.asarray(np.where(whole, known, carried) * inner, dtype=np.float32)


def _kernel(angle: float) -> Floats:
    """Matched filter of |u| across a line through the centre, u running at `angle`; any quadratic gives nothing."""
    size = RADIUS + REACH
    y, x = np.mgrid[-size : size + 1, -size : size + 1].astype(float)
    u, v = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    # Samples on the rim of the rectangle count by as much of them as lies in it.
    share = np.clip(RADIUS + 0.5 - np.abs(u), 0, 1) * np.clip(REACH + 0.5 - np.abs(v), 0, 1)
    within = share > 0
    root = np.sqrt(share[within])
    terms = np.stack([(u**p * v**q)[within] for p, q in POWERS], axis=1)
    fit, *_ = np.linalg.lstsq(terms * root[:, None], np.abs(u[within]) * root, rcond=None)
    kernel = np.zeros_like(u)
    kernel[within] = share[within] * (np.abs(u[within]) - terms @ fit)
    return kernel / (kernel * np.abs(u)).sum()


def _line(angle: float, reach: int) -> Bytes:
    """The samples of a line through the centre at `angle`, so many to either side."""
    line = np.zeros((2 * reach + 1, 2 * reach + 1), np.uint8)
    for step in np.arange(-reach, reach + 0.25, 0.25):
        line[reach + round(step * np.sin(angle)), reach + round(step * np.cos(angle))] = 1
    return line
