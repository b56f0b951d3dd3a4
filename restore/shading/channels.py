"""Channel-wise operations on colour fields; numpy is slow along an axis of three."""

from __future__ import annotations

import cv2
import numpy as np

from restore.scan import Floats
from restore.shading.relief import Field


def lowest(field: Field) -> Field:
    """Return the least (r, c) of the channels (r, c, 3)."""
    return np.asarray(np.minimum(np.minimum(field[..., 0], field[..., 1]), field[..., 2]))


def highest(field: Field) -> Field:
    """Return the greatest (r, c) of the channels (r, c, 3)."""
    return np.asarray(np.maximum(np.maximum(field[..., 0], field[..., 1]), field[..., 2]))


def total_of(field: Field) -> Field:
    """Return the sum (r, c) of the channels (r, c, 3)."""
    return np.asarray(cv2.transform(field, np.ones((1, 3))))


def scaled(field: Field, factors: Floats) -> Field:
    """A field (r, c, 3), each channel times its own of three factors."""
    return np.asarray(cv2.transform(field, np.diag(factors)))


def as_list(field: Field) -> Field:
    """Return a field (r, c, …) as a list (r · c, …)."""
    return field.reshape(-1, *field.shape[2:])
