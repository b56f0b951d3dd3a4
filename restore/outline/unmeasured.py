"""Paper that the picture shows beyond the border of what was measured.

A wall that rises out of the scanner's depth range, or dark paper at the border, gives no range, and a table that gives
none either does not show where it ends: the picture does.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_erosion, gaussian_filter

from restore.camera.rays import EDGE_BLUR
from restore.numerics.limits import TINY
from restore.outline.picture_edge import LEVEL, MOST, PLATEAU, REACH, profiles_at, steps_of
from restore.range_image.facets.sheet import Sheet
from restore.scan import Floats, Mask

MAX_STEPS = 8  # samples beyond the border that are searched: a centimetre of a page that fills the picture


def unmeasured_border(sheet: Sheet) -> float:
    """Return the fraction of the border beyond which paper goes on, 0 to 1.

    The picture shows paper of the same light there, and its step to the table farther out than a sample; nothing was
    measured up to there.
    """
    if sheet.scan.texture is None:
        return 0.0
    inner, outwards = _border(sheet.inside)
    unknown = _unmeasured_beyond(sheet.scan.measured, inner, outwards)
    if not unknown.any():
        return 0.0
    nodes, steps = (inner + outwards / 2)[unknown], outwards[unknown]
    last = sheet.texcoords(nodes - steps)
    sample = last - sheet.texcoords(nodes - 2 * steps)
    pixels = np.maximum(np.linalg.norm(sample, axis=1), TINY)  # of a sample
    reach = np.maximum(REACH / pixels, 2.0 * MOST)
    found = np.full(len(nodes), np.nan)
    for offset in range(MAX_STEPS + 1):
        light = profiles_at(sheet.scan.texture, last + (1 + offset) * sample, reach[:, None] * sample)
        step, clear, paper, table = steps_of(light)
        if not offset:
            own = np.median(light[:, :PLATEAU], axis=1)
        clear &= np.abs(paper - own) < LEVEL * np.abs(paper - table)
        new = clear & np.isnan(found)
        found[new] = (offset + step * reach)[new]
    return float((found > MOST).sum() / len(inner))


def _border(inside: Mask) -> tuple[Floats, Floats]:
    """Return the outermost samples of a mask.

    Returns also the unit normals that point outwards there; both (k, 2).
    """
    # A side at an angle to the rows runs in steps: blurred, they have its normal.
    rows, cols = np.nonzero(np.asarray(inside & ~binary_erosion(inside)))
    slope = np.stack(np.gradient(gaussian_filter(inside.astype(float), EDGE_BLUR)), axis=-1)[rows, cols]
    length = np.linalg.norm(slope, axis=1)
    places, known = np.stack([rows, cols], axis=1).astype(float), length > 0
    return places[known], -slope[known] / length[known, None]


def _unmeasured_beyond(measured: Mask, inner: Floats, outwards: Floats) -> Mask:
    """Return where the first MAX_STEPS samples beyond a border (k,) were not measured."""
    unknown: Mask = np.ones(len(inner), bool)
    for count in range(1, MAX_STEPS + 1):
        at = np.rint(inner + count * outwards).astype(int)
        within = np.asarray(((at >= 0) & (at < measured.shape)).all(axis=1))
        rows, cols = np.where(within[:, None], at, 0).T
        unknown &= ~(within & measured[rows, cols])
    return unknown
