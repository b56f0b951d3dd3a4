"""The 24 patches of a ColorChecker Classic in a picture, found by OpenCV."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from restore import BadInput
from restore.scan import Bytes, Floats

PATCHES = 24
GREYS = slice(18, 24)  # white to black, the last row
CHANNELS = 3
CLIPPED = 254.0  # a patch as bright as this on average has lost its colour to the end of the scale


@dataclass(frozen=True, eq=False)
class Chart:
    """Measured codes of the patches, in the order of the chart.

    codes  (24, 3) mean RGB, 0 to 255.
    noise  (24, 3) standard deviation, in the same unit.
    """

    codes: Floats
    noise: Floats


def find_chart(image: Bytes) -> Chart:
    """Find the chart in a picture (h, w, 3) uint8 RGB.

    Raises BadInput when it is not found, or is overexposed.
    """
    detector = cv2.mcc.CCheckerDetector.create()
    picture = np.ascontiguousarray(image[..., ::-1])  # OpenCV's order
    if not _process(detector, picture):
        raise BadInput(
            "the image shows no colour chart",
            "show a whole ColorChecker Classic, squarely, without glare, its patches 20 pixels wide or more",
        )
    # Rows: patch by patch, red, green, blue. Columns: pixels, mean, standard deviation, least, most.
    seen = np.asarray(detector.getBestColorChecker().getChartsRGB()).reshape(PATCHES, CHANNELS, -1)
    chart = Chart(seen[..., 1], seen[..., 2])
    if chart.codes.max() > CLIPPED:
        raise BadInput("the chart's white is overexposed", "lower the gain or the light, and capture the chart again")
    return chart


def _process(detector: Any, picture: Bytes) -> bool:
    if hasattr(detector, "setColorChartType"):  # OpenCV 5
        detector.setColorChartType(cv2.mcc.MCC24)
        return bool(detector.process(picture, 1))
    return bool(detector.process(picture, cv2.mcc.MCC24, 1))
