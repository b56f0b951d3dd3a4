"""Range grid of a pinhole camera without distortion: lines of sight, evenly spaced."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from restore.scan import Floats
from restore.structured_light.rig import Lens

# A grid as fine as the scanner's own: all sizes in samples that the preparation knows were measured on that.
SAMPLES = 640 * 480
BORDER_STEPS = 64  # points on each side of the picture at which its view is measured


@dataclass(frozen=True, eq=False)
class ViewGrid:
    """Lines of sight over a picture.

    tangents  (rows, cols, 2): x right, y down.
    pixels    (rows, cols, 2) of the picture.
    spacing   of the samples, pixels in the middle of the picture.
    """

    tangents: Floats
    pixels: Floats
    spacing: float


def view_grid(lens: Lens, size: tuple[int, int], least_spacing: float = 1.0) -> ViewGrid:
    """Return the grid of up to SAMPLES samples over a picture of width × height pixels."""
    width, height = size
    spacing = max(least_spacing, float(np.sqrt(width * height / SAMPLES)))
    step = spacing / lens.matrix[[0, 1], [0, 1]]
    fraction = np.linspace(0.0, 1.0, BORDER_STEPS)
    along = np.column_stack([fraction * (width - 1), fraction * (height - 1)])
    near, far = np.zeros(BORDER_STEPS), np.ones(BORDER_STEPS)
    border = np.concatenate(
        [
            np.column_stack([along[:, 0], near]),
            np.column_stack([along[:, 0], far * (height - 1)]),
            np.column_stack([near, along[:, 1]]),
            np.column_stack([far * (width - 1), along[:, 1]]),
        ]
    )
    seen = lens.tangents(border)
    low, high = seen.min(axis=0), seen.max(axis=0)
    x, y = (np.arange(low[k], high[k] + step[k] / 2, step[k]) for k in (0, 1))
    tangents = np.stack(np.meshgrid(x, y), axis=-1)
    return ViewGrid(tangents, lens.pixels(tangents.reshape(-1, 2)).reshape(tangents.shape), spacing)
