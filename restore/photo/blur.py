"""Blur of a photograph relative to the scanner's image of the print."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.camera.photo_camera import PhotoCamera
from restore.numerics.limits import SINGLE_TINY
from restore.numerics.srgb import CONTRAST_PX, LINEAR
from restore.photo.dense import predict
from restore.photo.reference import Reference
from restore.scan import Bytes, Mask

Light = NDArray[np.float32]

BLURS = (0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)
"""Standard deviations in pixels of the reference that are tried."""
PREDICTION_PX = 0.5  # by which shrinking and interpolation spread the prediction of a sharp photograph


def relative_blur(reference: Reference, photograph: Bytes, camera: PhotoCamera) -> float:
    """Return the Gaussian blur that makes the reference most like a photo.

    Contrasts are compared, which no smooth light changes.
    photograph: (h, w).
    Returns the standard deviation in pixels of the reference, 0 when the photograph is as sharp or sharper.
    """
    predicted, seen, _ = predict(reference, photograph, camera)
    seen &= reference.page
    inner = cv2.erode(seen.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    if not inner.any():
        return 0.0
    ours, theirs = (_contrast(LINEAR[grey], seen) for grey in (reference.grey, predicted))
    ours = _blurred(ours, PREDICTION_PX)
    likeness = [_correlation(_blurred(ours, sigma)[inner], theirs[inner]) for sigma in BLURS]
    return BLURS[int(np.argmax(likeness))]


def _contrast(light: Light, mask: Mask) -> Light:
    """Linear light (h, w) relative to its local mean over a mask (h, w), less 1."""
    inside = mask.astype(np.float32)
    mean = cv2.GaussianBlur(light * inside, (0, 0), CONTRAST_PX)
    mean = mean / np.maximum(cv2.GaussianBlur(inside, (0, 0), CONTRAST_PX), SINGLE_TINY)
    return np.where(mask, light / np.maximum(mean, SINGLE_TINY) - 1.0, 0.0).astype(np.float32)


def _blurred(picture: Light, sigma: float) -> Light:
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), sigma)) if sigma else picture


def _correlation(one: Light, other: Light) -> float:
    one, other = one - one.mean(), other - other.mean()
    return float((one * other).sum() / np.sqrt(max(float((one**2).sum() * (other**2).sum()), SINGLE_TINY)))
