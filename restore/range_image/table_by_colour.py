"""Segment a table by its colour."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from restore.range_image.camera import EDGE_BLUR
from restore.range_image.table_outline import is_sheet
from restore.range_image.table_plane import TablePlane, lies_on
from restore.robust import robust_sigmas
from restore.scan import Floats, Mask, RangeScan

MAX_COLOUR_DISTANCE = 3.5  # Mahalanobis distance; 1 % of a normal colour cloud lies outside
MIN_COLOUR_SIGMA = np.array([8.0, 3.0, 3.0])  # least spread of L, a, b: uneven light changes L most
MIN_COLOUR_DIFFERENCE = 12.0  # ΔE between table and paper, below which the "table" is part of the page
PAPER_PERCENTILE = 75  # of lightness: brighter samples are paper, not ink


class ColouredTable(NamedTuple):
    """A table that its colour tells.

    samples   (rows, cols) True on it.
    brighter  whether the paper on it is.
    flat      whether most of what does not belong to it lies in its plane.
    """

    samples: Mask
    brighter: bool
    flat: bool


def table_by_colour(colour: Floats, plane: TablePlane, band: Mask) -> ColouredTable | None:
    """The samples on a plane that have the colour which most of them have in a band (rows, cols).

    None when the paper has the colour of the table, too, or the rest is no sheet. colour (rows, cols, 3) L*a*b* of the
    samples.
    """
    on_plane = plane.samples
    centre, sigma = _colour_distribution(colour[on_plane & band])
    table = on_plane.copy()
    off = (colour[on_plane] - centre) / sigma
    table[on_plane] = np.einsum("ij,ij->i", off, off) < MAX_COLOUR_DISTANCE**2
    rest = plane.measured & ~table
    paper = _paper_colour(colour[rest]) if rest.any() else centre
    if np.linalg.norm(paper - centre) < MIN_COLOUR_DIFFERENCE or not is_sheet(rest, plane.measured):
        return None
    table |= _blurred_edge(table, on_plane, colour, centre, paper)
    return ColouredTable(table, bool(paper[0] > centre[0]), lies_on(plane, plane.measured & ~table))


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
    """(rows, cols) True beside the table and in its plane where less than half of the light is the paper's.

    A lens and a pixel mix light, of which lightness is the cube root.
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
    """L*a*b* of the paper: the brighter part of all colours (n, 3) off the table."""
    colour: Floats = np.median(rest[rest[:, 0] >= np.percentile(rest[:, 0], PAPER_PERCENTILE)], axis=0)
    return colour
