"""Contrast of print against its surroundings, which removing light must not lower.

A stroke is darker than what lies on both of its sides. A factor that varies slowly leaves that ratio as it is; a wrong
light that is removed drives paper and strokes to white together.
"""

from __future__ import annotations

import cv2
import numpy as np

from restore.numerics.limits import SINGLE_TINY
from restore.scan import Floats, Mask
from restore.shading.certainty import CERTAIN
from restore.shading.channels import total_of
from restore.shading.estimate import block_sums, blocks_of
from restore.shading.relief import Field
from restore.shading.shadow_edges import STROKE


def loses_print(colour: Field, gain: Field, inside: Mask) -> bool:
    """Return whether a gain lowers the contrast of the print of a page.

    It must do so by CERTAIN standard errors. What is narrow and dark in the light itself may go.
    colour, gain (r, c, 3): linear, 1 is white. inside (r, c): where the page is.
    """
    after = np.minimum(colour * gain, np.float32(1))
    lost = _contrast(colour) - _contrast(after) - _contrast(1 / np.maximum(gain, SINGLE_TINY))
    cells = np.flatnonzero(inside)
    total, error = block_sums(lost.ravel()[cells].astype(float), blocks_of(cells, inside.shape))
    return total > CERTAIN * error


def _contrast(colour: Field | Floats) -> Field:
    """Measure by how much strokes (r, c) are darker than what is around them, in logarithms."""
    level = np.maximum(total_of(np.asarray(colour, np.float32)), SINGLE_TINY)
    closed = cv2.morphologyEx(level, cv2.MORPH_CLOSE, np.ones((STROKE, STROKE), np.uint8))
    return np.asarray(np.log(closed / level))
