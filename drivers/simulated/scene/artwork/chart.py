"""A colour chart of 24 patches: the layout and colours of the ColorChecker Classic."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from drivers.simulated.scene.artwork.printed import MM_PER_PIXEL, Box, Gloss, Print, blank, box_mm
from drivers.simulated.scene.sheets.sheet import PageSize, parameters
from restore.scan import Bytes, Floats

# CIE L*a*b* under D50, 2° observer, as X-Rite published it for charts made before November 2014, row by row.
PATCHES = {
    "dark skin": (37.986, 13.555, 14.059),
    "light skin": (65.711, 18.130, 17.810),
    "blue sky": (49.927, -4.880, -21.925),
    "foliage": (43.139, -13.095, 21.905),
    "blue flower": (55.112, 8.844, -25.399),
    "bluish green": (70.719, -33.397, -0.199),
    "orange": (62.661, 36.067, 57.096),
    "purplish blue": (40.020, 10.410, -45.964),
    "moderate red": (51.124, 48.239, 16.248),
    "purple": (30.325, 22.976, -21.587),
    "yellow green": (72.532, -23.709, 57.255),
    "orange yellow": (71.941, 19.363, 67.857),
    "blue": (28.778, 14.179, -50.297),
    "green": (55.261, -38.342, 31.370),
    "red": (42.101, 53.378, 28.190),
    "yellow": (81.733, 4.039, 79.819),
    "magenta": (51.935, 49.986, -14.574),
    "cyan": (51.038, -28.631, -28.638),
    "white": (96.539, -0.425, 1.186),
    "neutral 8": (81.257, -0.638, -0.335),
    "neutral 6.5": (66.766, -0.734, -0.504),
    "neutral 5": (50.867, -0.153, -0.270),
    "neutral 3.5": (35.656, -0.421, -1.231),
    "black": (20.461, -0.079, -0.973),
}
ROWS, COLS = 4, 6
GAP = 0.1  # black between patches, as a fraction of a patch, and twice as much round them
FRAME = (32, 32, 32)
# From XYZ under D50 to linear sRGB: IEC 61966-2-1 with the Bradford transform from D65.
TO_SRGB = np.array(
    [[3.1338561, -1.6168667, -0.4906146], [-0.9787684, 1.9161415, 0.0334540], [0.0719453, -0.2289914, 1.4052427]]
)
D50 = np.array([0.9642, 1.0, 0.8249])


@parameters
class Chart:
    """The chart in the middle of white paper, as large as fits with a margin."""

    name: ClassVar[str] = "chart"
    margin_mm: Annotated[float, Field(ge=0, le=60)] = 12.0
    gloss: Gloss = 0.0

    def print_on(self, page_mm: PageSize) -> Print:
        """Print patches by their names in `Print.patches`.

        Cyan, which sRGB cannot show, is printed as near as it can.
        """
        image = blank(page_mm).copy()
        room = (np.asarray(page_mm) - 2 * self.margin_mm) / MM_PER_PIXEL
        units = np.array([COLS, ROWS]) * (1 + GAP) + 3 * GAP
        patch = float((room / units).min())
        left, top = (np.array(image.shape[1::-1]) - units * patch) / 2
        _fill(image, (left, top, left + units[0] * patch, top + units[1] * patch), np.array(FRAME))
        patches = {}
        for i, (name, lab) in enumerate(PATCHES.items()):
            row, col = divmod(i, COLS)
            x, y = (start + patch * (2 * GAP + k * (1 + GAP)) for start, k in ((left, col), (top, row)))
            patches[name] = _fill(image, (x, y, x + patch, y + patch), _codes(np.array(lab)), page_mm)
        return Print(image, page_mm, gloss=self.gloss, patches=patches)


def _fill(
    image: Bytes, edges: tuple[float, float, float, float], colour: Floats | Bytes, page_mm: PageSize = (0.0, 0.0)
) -> Box:
    left, top, right, bottom = (round(edge) for edge in edges)
    image[top:bottom, left:right] = colour
    return box_mm(left, top, right, bottom, page_mm)


def _codes(lab: Floats) -> Bytes:
    """Return sRGB codes (3,) of a colour in L*a*b* under D50.

    CIE 15:2004, 8.2.1.
    """
    y = (lab[0] + 16) / 116
    f = np.array([y + lab[1] / 500, y, y - lab[2] / 200])
    xyz = D50 * np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))
    light = np.clip(TO_SRGB @ xyz, 0, 1)
    codes = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.rint(codes * 255).astype(np.uint8)
