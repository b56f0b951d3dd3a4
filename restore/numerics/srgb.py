"""Linear light of sRGB codes, and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.scan import Bytes

CLIPPED = 252  # code from which a sensor may be full, and the light unknown
DARKEST = 12.0  # codes: below, the noise of a sensor is as large as what print leaves
CONTRAST_PX = 8.0  # standard deviation in a scanner's image: light and shade are wider, print is finer
NOISE_BLUR_PX = 1.0  # standard deviation: takes most of the noise of a sensor, and leaves print
_CODE = np.arange(256) / 255
LINEAR = np.where(_CODE <= 0.04045, _CODE / 12.92, ((_CODE + 0.055) / 1.055) ** 2.4).astype(np.float32)
"""Linear light (256,) of each sRGB code (IEC 61966-2-1)."""


def srgb_codes(light: NDArray[Any]) -> Bytes:
    """Convert linear light (…), clipped to 0 to 1, to uint8 sRGB codes (…)."""
    light = np.clip(light, 0, 1)
    codes = np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055) * 255
    return np.rint(codes).astype(np.uint8)
