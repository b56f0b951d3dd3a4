"""Straight sides of the page in the colour image.

A page that lies straight under the scanner has sides along a row of samples, and no sample shows where between two rows
one is. In the colour image it cuts through pixels, and each is as light as the paper's fraction of it: the light across
the side adds up to as much as a sharp step would, whatever the lens has blurred (partial area effect, Trujillo-Pino et
al., "Accurate subpixel edge location based on partial area effect", 2013).
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.numerics.limits import TINY
from restore.numerics.robust import MAJORITY, robust_sigma
from restore.outline.crossings import Crossings, PictureEdge, where
from restore.range_image.facets.sheet import Sheet
from restore.scan import Bytes, Floats, Mask

# pixels, all along a side: tone curves and edge enhancement. Where a lens that blurs by 0.7 mixes light, of which codes
# are a root, white paper on a black table ends 0.3 farther out.
SHOWN = 0.1
REACH = 4.0  # pixels, or half as many samples, to either side: a step of both, and room for two plateaus
PROFILE = (np.arange(64) + 0.5) / 32 - 1.0  # fractions of the reach: the centres of eighths of a pixel
PLATEAU = 12  # places at either end of a profile that show paper, and table: a pixel and a half
LEVEL = 0.15  # of the step: plateaus with more range hold print or a shadow
MOST = 1.0  # samples from the crossing: a step farther off is another
CUT = 0.5  # samples more, where a mesh was cut: its last vertices lie anywhere within a spacing of the paper's edge
EVEN = 1.0  # codes between the 10th and 90th percentile: a camera's noise has more, what an atlas leaves empty has not


class PictureSteps(NamedTuple):
    """Crossings next to which the image steps from paper to table.

    places: those crossings; either of their samples lies on the step, moved there.
    pixel: mm of the page that one of the image shows, in the mean.
    paper, table: the light on either side, median codes.
    """

    places: Crossings
    pixel: float
    paper: float
    table: float

    def shows_table(self, texture: Bytes, pixels: Floats) -> Mask:
        """Return where a texture is nearer to the table's light than paper's.

        pixels: (k, 2). Returns (k,) bool.
        """
        if not len(pixels):  # which OpenCV refuses
            return np.zeros(0, bool)
        light = _grey(texture, pixels[:, None].astype(np.float32))[:, 0]
        return np.asarray(np.abs(light - self.table) < np.abs(light - self.paper))


def edge_in_picture(sheet: Sheet, crossings: Crossings, normal: Floats) -> PictureEdge | None:
    """Return the side with a given normal by the image at k crossings.

    Its standard deviation is that of a single crossing, not of their mean: a shadow or print next to the side moves
    many of them alike.
    normal: (2,), unit vector that points outwards.
    Returns None where the side is not clear.
    """
    steps = steps_in_picture(sheet, crossings, normal)
    if steps is None:
        return None
    places = steps.places.places @ normal
    offset = float(np.median(places))
    return PictureEdge(offset, float(np.hypot(robust_sigma(places - offset), SHOWN * steps.pixel)))


def steps_in_picture(sheet: Sheet, crossings: Crossings, normal: Floats) -> PictureSteps | None:
    """Return the steps along a normal, if enough crossings show one.

    An atlas, as a mesh may have for a picture, ends some pixels beyond the mesh before what it leaves empty: that is
    not a step of paper.
    normal: (2,), unit vector that points outwards.
    Returns None unless MAJORITY of k crossings show a step.
    """
    if sheet.scan.texture is None or not len(crossings.nodes):
        return None
    pixels, ahead = _pixels(sheet, crossings, normal)
    pixel = 1.0 / np.maximum(np.linalg.norm(ahead, axis=1), TINY)  # a mesh may have one texture position for all
    sample = 1.0 / np.linalg.norm(crossings.jacobians @ normal, axis=1)
    most = (MOST + CUT if sheet.cut_out else MOST) * sample
    reach = REACH * np.maximum(pixel, most / 2)
    profiles = profiles_at(sheet.scan.texture, pixels, reach[:, None] * ahead)
    if sheet.cut_out and np.ptp(np.percentile(profiles[:, -PLATEAU:], [10, 90])) < EVEN:
        return None
    steps, clear, paper, table = steps_of(profiles)
    clear &= np.abs(steps) * reach < most
    if clear.mean() < MAJORITY:
        return None
    there = crossings.places + (steps * reach)[:, None] * normal
    moved = crossings._replace(samples=np.repeat(there[:, None], 2, axis=1))
    lights = (float(np.median(light[clear])) for light in (paper, table))
    return PictureSteps(where(moved, clear), float(pixel[clear].mean()), *lights)


def _pixels(sheet: Sheet, crossings: Crossings, normal: Floats) -> tuple[Floats, Floats]:
    """Return the texture pixels of crossings, and how they move.

    Both (k, 2), x and y; they move for a millimetre along the normal. Determined from a sample and two inside the page:
    a mesh has no texture positions beyond its end.
    """
    ahead = crossings.jacobians @ normal
    sample = ahead / np.linalg.norm(ahead, axis=1)[:, None]
    inner, inmost = (sheet.texcoords(crossings.nodes - samples * sample) for samples in (1.0, 2.0))
    return 2.0 * inner - inmost, (inner - inmost) * np.linalg.norm(ahead, axis=1)[:, None]


def profiles_at(texture: Bytes, pixels: Floats, reach: Floats) -> Floats:
    """Return the light (k, 64) of a texture along PROFILE at pixels.

    pixels: (k, 2).
    reach: (k, 2), pixels to the end of the profile.
    """
    return _grey(texture, (pixels[:, None] + PROFILE[:, None] * reach[:, None]).astype(np.float32))


def _grey(texture: Bytes, at: NDArray[np.float32]) -> Floats:
    """Return the light (k, m) of a texture at pixels (k, m, 2)."""
    colours = cv2.remap(texture, at, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(cv2.cvtColor(colours, cv2.COLOR_RGB2GRAY), np.float64)


def steps_of(profiles: Floats) -> tuple[Floats, Mask, Floats, Floats]:
    """Return where profiles (k, 64) step, as fractions of the reach.

    Returns also which clearly do, and the light of paper and table, each (k,).
    """
    ends = profiles[:, :PLATEAU], profiles[:, -PLATEAU:]
    paper, table = (np.median(end, axis=1) for end in ends)
    step = np.abs(paper - table)
    # Even a plateau of one code has noise: its rounding, and more in a camera.
    clear = np.maximum(*(np.ptp(end, axis=1) for end in ends)) + EVEN < LEVEL * step
    of_paper = (profiles - table[:, None]) / np.where(clear, paper - table, np.inf)[:, None]
    # A shadow darker than both, or a gleam, would count as paper that is missing, or as more of it.
    clear &= (of_paper.min(axis=1) > -LEVEL) & (of_paper.max(axis=1) < 1.0 + LEVEL)
    return 2.0 * of_paper.mean(axis=1) - 1.0, clear, paper, table
