"""The Gray-code patterns of a projector, in OpenCV's order.

Of each bit of the column, most significant first, the pattern and its inverse; then of each bit of the row; at the end
a white and a black picture (`cv2.structured_light.GrayCodePattern`, after Inokuchi, Sato & Matsuda, "Range imaging
system for 3-D object recognition", ICPR 1984).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from restore.errors import BadInput
from restore.scan import Bytes

MIN_SIDE, MAX_SIDE = 16, 8192  # pixels: below it no page is resolved, above it no projector is built


@dataclass(frozen=True)
class Projector:
    """The picture of a projector, in pixels. Raises BadInput for a size that none has.

    >>> projector = Projector(64, 32)
    >>> projector.count, next(projector.patterns()).shape
    (24, (32, 64))
    """

    width: int
    height: int

    def __post_init__(self) -> None:
        if not all(MIN_SIDE <= side <= MAX_SIDE for side in (self.width, self.height)):
            raise BadInput(
                f"a projector of {self.width} × {self.height} pixels cannot be", "give its own resolution, as 1280x800"
            )

    @property
    def bits(self) -> tuple[int, int]:
        """Bits of the column and of the row."""
        return (self.width - 1).bit_length(), (self.height - 1).bit_length()

    @property
    def count(self) -> int:
        """The number of its patterns, the white and the black picture included."""
        return 2 * sum(self.bits) + 2

    def patterns(self) -> Iterator[Bytes]:
        """Yield the patterns (height, width) uint8, 0 or 255, in the order of projection."""
        generator = cv2.structured_light.GrayCodePattern.create(self.width, self.height)
        _, patterns = generator.generate()
        yield from patterns
        shape = (self.height, self.width)
        yield np.full(shape, 255, np.uint8)
        yield np.zeros(shape, np.uint8)
