"""Orientation tags of photographs (EXIF tag 274, CIPA DC-008): how the sensor's picture is turned to be upright.

A phone that looks straight down guesses how it is held: photographs of one set come with tags of all four quarters.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore.photo.photograph import UPRIGHT, Photograph
from restore.scan import Bytes

QUARTERS = {UPRIGHT: 0, 8: 1, 3: 2, 6: 3}
"""Tag → quarter turns counter-clockwise that make the picture upright. The other four tags mirror, too."""


def turned_like(photograph: Photograph, first: Photograph) -> Photograph:
    """A photograph turned so that its sensor lies as in the first: upright as the first is, whatever its own tag says.

    One whose tag mirrors stays as it is: its sensor's picture shows the page the wrong way round.
    """
    own, wanted = QUARTERS.get(photograph.orientation), QUARTERS.get(first.orientation)
    if own is None or wanted is None or own == wanted:
        return photograph
    image: Bytes = np.ascontiguousarray(np.rot90(photograph.image, wanted - own))
    return replace(photograph, image=image, orientation=first.orientation)
