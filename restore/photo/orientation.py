"""Orientation tags of photographs (EXIF tag 274, CIPA DC-008).

They say how the sensor's image is rotated to be upright. A phone that looks straight down guesses how it is held:
photographs of one set have tags of all four quarters.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore.photo.photograph import UPRIGHT, Photograph
from restore.scan import Bytes

QUARTERS = {UPRIGHT: 0, 8: 1, 3: 2, 6: 3}
"""Tag → quarter turns counter-clockwise that make the picture upright.

The other four tags mirror, too.
"""


def turned_like(photograph: Photograph, first: Photograph) -> Photograph:
    """Rotate a photograph so that its sensor is oriented as in the first.

    It is upright as the first is, whatever its own tag says. One whose tag mirrors stays as it is: its sensor's image
    shows the page mirrored.
    """
    own, wanted = QUARTERS.get(photograph.orientation), QUARTERS.get(first.orientation)
    if own is None or wanted is None or own == wanted:
        return photograph
    image: Bytes = np.ascontiguousarray(np.rot90(photograph.image, wanted - own))
    return replace(photograph, image=image, orientation=first.orientation)
