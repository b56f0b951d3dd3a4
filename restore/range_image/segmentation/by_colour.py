"""Segment a table by its colour."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from restore.camera.rays import EDGE_BLUR, SUBSET_STRIDE
from restore.numerics.robust import OUTLYING, robust_sigma, robust_sigmas
from restore.range_image.segmentation.outline import is_sheet
from restore.range_image.segmentation.plane import TablePlane, refitted
from restore.scan import Floats, Mask, RangeScan

MAX_COLOUR_DISTANCE = 3.5  # Mahalanobis distance; 1 % of a normal colour cloud lies outside
MIN_COLOUR_SIGMA = np.array([8.0, 3.0, 3.0])  # least spread of L, a, b: uneven light changes L most
MAX_WRINKLE_MM = 2.0  # above or below a table's plane: what rises more is a fold of the cloth, or a page
MIN_COLOUR_DIFFERENCE = 12.0  # ΔE between table and paper, below which the "table" is part of the page
REFITS = 4  # from the border to the middle of a table: two reach it, the others settle
GROWN = 0.01  # of a table's samples that its middle adds: noise of the fit moves a thousandth


class ColouredTable(NamedTuple):
    """Table that is recognised by its colour.

    samples: (rows, cols), True on it.
    plane: its plane, with a tolerance for its own unevenness: cloth lies in wrinkles.
    brighter: whether the paper on it is brighter.
    alike: (rows, cols), True off its plane where something has its colour, as a corner that is bowed more.
    """

    samples: Mask
    plane: TablePlane
    brighter: bool
    alike: Mask


def table_by_colour(colour: Floats, plane: TablePlane, band: Mask, own: Mask) -> ColouredTable | None:
    """Return the samples on a plane that have the colour of most of its own.

    own: (rows, cols), the samples that determine the plane; they lie in a band (rows, cols), which shows how uneven the
        table is.
    colour: (rows, cols, 3), L*a*b* of the samples.
    Returns None when the paper has the colour of the table, too, or the rest is not a sheet.
    """
    centre, sigma = _colour_distribution(colour[plane.samples & own])
    plane = plane._replace(tolerance=_unevenness(plane, band, colour, centre, sigma))
    plane = _with_middle(plane, colour, centre, sigma)
    on_plane = plane.samples
    table = on_plane.copy()
    table[on_plane] = _of_colour(colour[on_plane], centre, sigma)
    rest = plane.measured & ~table
    paper = _paper_colour(colour[rest][::SUBSET_STRIDE]) if rest.any() else centre
    if np.linalg.norm(paper - centre) < MIN_COLOUR_DIFFERENCE or not is_sheet(rest, plane.measured):
        return None
    table |= _blurred_edge(table, on_plane, colour, centre, paper)
    alike = plane.measured & ~table
    alike[alike] = _of_colour(colour[alike], centre, sigma)
    return ColouredTable(table, plane, bool(paper[0] > centre[0]), alike)


def _with_middle(plane: TablePlane, colour: Floats, centre: Floats, sigma: Floats) -> TablePlane:
    """Fit a plane to all of its table, not to the border alone.

    A scan by the manual's figures bows a table by more, and in another way, than its border shows. The plane itself
    where its middle adds nothing.
    """
    of_colour = plane.measured
    of_colour[of_colour] = _of_colour(colour[of_colour], centre, sigma)
    before, found = (plane.samples & of_colour).sum(), plane
    for _ in range(REFITS):
        found = refitted(found, found.samples & of_colour)
        if (found.samples & of_colour).sum() <= (1.0 + GROWN) * before:
            return plane
    return found


def _unevenness(plane: TablePlane, band: Mask, colour: Floats, centre: Floats, sigma: Floats) -> float:
    """Return the tolerance of an uneven table, mm.

    Its heights scatter in a band (rows, cols) by more than noise explains.
    """
    near = band & (np.abs(plane.height) < MAX_WRINKLE_MM)
    heights = plane.height[near][_of_colour(colour[near], centre, sigma)]
    return max(plane.tolerance, min(OUTLYING * robust_sigma(heights), MAX_WRINKLE_MM))


def _of_colour(colours: Floats, centre: Floats, sigma: Floats) -> Mask:
    """Return which colours (n, 3) are within a distribution, (n,) bool.

    centre, sigma: (3,), mean and standard deviations.
    """
    off = (colours - centre) / sigma
    return np.asarray(np.einsum("ij,ij->i", off, off) < MAX_COLOUR_DISTANCE**2)


def lab_colours(scan: RangeScan) -> Floats | None:
    """L*a*b* of every sample (rows, cols, 3), or None for a scan without colour."""
    if scan.texture is None:
        return None
    smooth = cv2.medianBlur(scan.texture, 3).astype(np.float32) / 255.0
    lab = cv2.cvtColor(smooth, cv2.COLOR_RGB2LAB)
    positions = np.nan_to_num(scan.texture_xy, nan=-1.0).astype(np.float32)
    colours: Floats = cv2.remap(lab, positions, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).astype(
        np.float64
    )
    return colours


def _blurred_edge(table: Mask, on_plane: Mask, colour: Floats, centre: Floats, paper: Floats) -> Mask:
    """Return samples at the table's edge with less than half paper light.

    They are next to the table and in its plane. A lens and a pixel mix light, of which lightness is the cube root.
    Returns (rows, cols) bool.
    """
    adjacent = cv2.dilate(table.astype(np.uint8), np.ones((2 * EDGE_BLUR + 1, 2 * EDGE_BLUR + 1), np.uint8)).astype(
        bool
    )
    edge = adjacent & on_plane
    light, of_table, of_paper = (_luminance(one) for one in (colour[edge], centre, paper))
    edge[edge] = np.abs(light - of_table) < np.abs(light - of_paper)
    return edge


def _luminance(colours: Floats) -> Floats:
    """Luminance of L*a*b* colours (…, 3), white's is 1 (CIE 15)."""
    root = (colours[..., 0] + 16.0) / 116.0
    return np.where(root > 6.0 / 29.0, root**3, 3.0 * (6.0 / 29.0) ** 2 * (root - 4.0 / 29.0))


def _colour_distribution(colours: Floats) -> tuple[Floats, Floats]:
    """The median (3,) and robust standard deviations (3,) of L*a*b* colours (n, 3)."""
    centre = np.median(colours, axis=0)
    sigma = robust_sigmas(colours - centre)
    return centre, np.maximum(sigma, MIN_COLOUR_SIGMA)


def _paper_colour(rest: Floats) -> Floats:
    """L*a*b* of the paper, not ink: the brighter half of all colours (n, 3) off the table."""
    colour: Floats = np.median(rest[rest[:, 0] >= np.median(rest[:, 0])], axis=0)
    return colour
