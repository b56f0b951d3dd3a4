"""Segment the table that a sheet lies on."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from scipy.ndimage import binary_erosion, binary_fill_holes, distance_transform_edt

from restore.range_image.table_by_depth import EDGE_BLUR, table_by_depth
from restore.robust import robust_sigma, robust_sigmas
from restore.scan import Floats, Mask, RangeScan

BORDER_BAND = 12  # samples: the table reaches the border of the picture, the sheet should not
MIN_SHARE = 0.25  # of the band's samples on one plane; less is no table
RANSAC_TRIALS = 200  # of three samples: with a quarter on the plane, one trial in 64 hits it
TRIAL_SUBSET = 2000  # samples on which the inliers of a trial are counted
ON_PLANE_SIGMAS = 4.0
MAX_COLOUR_DISTANCE = 3.5  # Mahalanobis distance; 1 % of a normal colour cloud lies outside
MIN_COLOUR_SIGMA = np.array([8.0, 3.0, 3.0])  # least spread of L, a, b: uneven light changes L most
MIN_COLOUR_DIFFERENCE = 12.0  # ΔE between table and paper, below which the "table" is part of the page
MIN_CLEAR = 0.25  # of a page's outline stands clear of a table; of a surface that bends up from a flat margin, none
PAPER_PERCENTILE = 75  # of lightness: brighter samples are paper, not ink
MIN_NOISE_MM = 0.01  # coordinates are written to a hundredth of a millimetre
MESH_APART = 4  # samples of the view of a mesh, more than a vertex lies from the next: within a face noise is linear
MIN_SHEET = 0.05  # of the samples, in one piece; the rest of a page that fills the picture is letters and lines


class Table(NamedTuple):
    """The table in a range image.

    samples   (rows, cols) True on it. False everywhere when no table is detected.
    touching  share of the page's outline that touches a table of its own colour, where its edge is not seen.
    """

    samples: Mask
    touching: float = 0.0


def find_table(scan: RangeScan, inverse_depth: Floats, measured: Mask, *, framed: bool = True) -> Table:
    """The table: in its plane and of its colour, or, where the paper has that, too, below a page that stands clear.

    inverse_depth (rows, cols) 1/mm: for a plane it is an affine function of the direction of a sample. A table extends
    to the frame of the picture; when that is not the scanner's (`framed` False), as for a mesh that was rotated, it
    extends to the outer border of the measured samples, on all sides: a panel of a leaflet in a light of its own does
    not. Most of the others must be off its plane.
    """
    no_table = Table(np.zeros_like(measured))
    outer = np.ones_like(measured) if framed else binary_fill_holes(measured)
    band = measured & ~binary_erosion(outer, iterations=BORDER_BAND)
    if band.sum() < MIN_SHARE * (outer & ~binary_erosion(outer, iterations=BORDER_BAND)).sum():
        return no_table
    directions = scan.points[..., :2] * inverse_depth[..., None]
    pitch = _pitch(directions[..., 0].T)
    apart = 1 if framed else MESH_APART
    nearer, tolerance = _fit_plane(inverse_depth, directions / pitch, band, apart)
    on_plane = measured & (np.abs(nearer) < tolerance)
    if on_plane[band].mean() < MIN_SHARE or not (framed or _surrounds(on_plane, band)):
        return no_table
    colour = _lab_colours(scan)
    samples, touching = None if colour is None else _by_colour(colour, on_plane, band, measured), 0.0
    if samples is None:
        depth = float(np.median(1.0 / inverse_depth[band]))
        samples, clear, touching = table_by_depth(nearer * depth**2, tolerance * depth**2, abs(pitch) * depth)
        steps_up = framed and clear >= MIN_CLEAR  # faces of a mesh bridge the step
        if not steps_up and not ((colour is None or not framed) and _surrounds(on_plane, band)):
            return no_table
    rest = measured & ~samples
    if not framed and not (rest.any() and on_plane[rest].mean() <= 0.5):
        return no_table
    return Table(samples, touching)


def _by_colour(colour: Floats, on_plane: Mask, band: Mask, measured: Mask) -> Mask | None:
    """(rows, cols) True on the plane where its colour is that of the table, none at all when the rest is no sheet.

    None when the paper has the colour of the table, too. colour (rows, cols, 3) L*a*b* of the samples.
    """
    centre, sigma = _colour_distribution(colour[on_plane & band])
    table = on_plane & (_colour_distance(colour, centre, sigma) < MAX_COLOUR_DISTANCE)
    rest = measured & ~table
    paper = _paper_colour(colour[rest]) if rest.any() else centre
    if np.linalg.norm(paper - centre) < MIN_COLOUR_DIFFERENCE:
        return None
    if _largest_share(rest, measured) < MIN_SHEET:
        return np.zeros_like(table)
    return table | _blurred_edge(table, on_plane, colour, centre, paper)


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


def _surrounds(on_plane: Mask, band: Mask) -> bool:
    """True when the plane is present on all four sides of the picture; one side of a fold that fills it is on three."""
    sides = (np.s_[:BORDER_BAND], np.s_[-BORDER_BAND:], np.s_[:, :BORDER_BAND], np.s_[:, -BORDER_BAND:])
    return all((on_plane & band)[side].sum() > MIN_SHARE * band[side].sum() for side in sides)


def _fit_plane(inverse_depth: Floats, directions: Floats, band: Mask, apart: int) -> tuple[Floats, float]:
    """(rows, cols) 1/mm nearer than the plane of most of the band (RANSAC), and the tolerance that noise explains.

    directions (rows, cols, 2) of the samples, in samples: with lens distortion row and column are not affine in them.
    apart: so many samples lie between two that have noise of their own.
    """
    values, design = inverse_depth[band], np.column_stack([np.ones(band.sum()), directions[band]])
    noise = _noise_sigma(inverse_depth, band, apart)
    random = np.random.default_rng(0)  # fixed: the same scan gives the same page
    subset = random.choice(len(values), min(TRIAL_SUBSET, len(values)), replace=False)
    triples = random.integers(len(values), size=(RANSAC_TRIALS, 3))
    best, best_count = np.zeros(3), -1
    for triple in triples:
        if abs(np.linalg.det(design[triple])) < 1.0:
            continue
        plane = np.linalg.solve(design[triple], values[triple])
        count = int((np.abs(design[subset] @ plane - values[subset]) < ON_PLANE_SIGMAS * noise).sum())
        if count > best_count:
            best, best_count = plane, count
    for _ in range(3):
        inliers = np.abs(design @ best - values) < ON_PLANE_SIGMAS * noise
        if inliers.sum() < 3:
            break
        best, *_ = np.linalg.lstsq(design[inliers], values[inliers], rcond=None)
    return inverse_depth - best[0] - directions @ best[1:], ON_PLANE_SIGMAS * noise


def _pitch(along: Floats) -> float:
    """The median change from row to row of values (rows, cols), NaN for none, by rows as near as values stand."""
    changes = ((along[apart:] - along[:-apart]) / apart for apart in range(1, len(along)))
    return float(next((np.nanmedian(one) for one in changes if np.isfinite(one).any()), 1.0))


def _noise_sigma(inverse_depth: Floats, band: Mask, least: int) -> float:
    """Standard deviation of one sample, 1/mm, from second differences down the columns, where noise is uncorrelated.

    They are of samples at least so far apart, and as near as three were measured, in a scan that has every second row
    as well.
    """
    value = np.where(band, inverse_depth, np.nan)
    differences = (
        value[2 * apart :] - 2 * value[apart:-apart] + value[: -2 * apart]
        for apart in range(least, (len(value) + 1) // 2)
    )
    known = (second[np.isfinite(second)] for second in differences)
    second = next((some for some in known if some.size), np.zeros(1))
    floor = MIN_NOISE_MM * float(np.nanmedian(inverse_depth)) ** 2
    return max(robust_sigma(second) / float(np.sqrt(6.0)), floor)


def _lab_colours(scan: RangeScan) -> Floats | None:
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


def _colour_distribution(colours: Floats) -> tuple[Floats, Floats]:
    """The median (3,) and robust standard deviations (3,) of L*a*b* colours (n, 3)."""
    centre = np.median(colours, axis=0)
    sigma = robust_sigmas(colours - centre)
    return centre, np.maximum(sigma, MIN_COLOUR_SIGMA)


def _colour_distance(colours: Floats, centre: Floats, sigma: Floats) -> Floats:
    distance: Floats = np.linalg.norm((colours - centre) / sigma, axis=-1)
    return distance


def _paper_colour(rest: Floats) -> Floats:
    """L*a*b* of the paper: the brighter part of all colours (n, 3) off the table."""
    colour: Floats = np.median(rest[rest[:, 0] >= np.percentile(rest[:, 0], PAPER_PERCENTILE)], axis=0)
    return colour


def _largest_share(rest: Mask, measured: Mask) -> float:
    """Share of the measured samples that the largest connected piece has, without links one or two samples wide.

    Where nothing was measured the piece goes on as beside it: dark ink and a weak laser lose samples on paper, too.
    """
    rows, cols = distance_transform_edt(~measured, return_distances=False, return_indices=True)
    solid = cv2.morphologyEx(rest[rows, cols].astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    _, labels = cv2.connectedComponents(solid)
    return float(np.bincount(labels[rest])[1:].max(initial=0) / measured.sum())
