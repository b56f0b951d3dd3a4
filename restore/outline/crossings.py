"""Where the outline passes between samples, and where a straight side passes between them all.

Each crossing tells the side to a sample. Where the side stands askew in the picture it passes by the samples at all
distances, and of those on the page the outermost, of those beyond the innermost tell its place to a small part of one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import expit

from restore.range_image.sheet import PageOnGrid, Sheet
from restore.scan import Floats, Ints

REACH = 1.0  # samples to either side of the mean of the crossings, which is within half of one but for lost samples
STEP = 0.02  # samples: 0.01 mm
RAGGED = np.array([0.5, 0.2, 0.1, 0.05, 0.02])  # samples that an outline may scatter by; no layout is surer
WRONG = 0.2  # of the samples, at most, are lost beside ink, or are specks of the table


class Crossings(NamedTuple):
    """Where the outline passes between two neighbouring samples.

    samples    (k, 2, 2) mm: where the one on the page lies on it, and where the one beyond would.
    jacobians  (k, 2, 2) samples/mm: of grid position by flat position there.
    """

    samples: Floats
    jacobians: Floats


def crossings_of(sheet: Sheet, page: PageOnGrid, border: Ints, jacobians: Floats) -> Crossings:
    """All k crossings of a page with vertices (b,) on its border; jacobians (b, 2, 2) are those there."""
    first = [np.argwhere(np.diff(sheet.inside, axis=axis)) for axis in (0, 1)]
    steps = np.repeat(np.eye(2, dtype=int), [len(one) for one in first], axis=0)
    places = np.concatenate(first)[:, None] + np.stack([np.zeros_like(steps), steps], axis=1)
    leaves = sheet.inside[tuple(places[:, 0].T)]
    places = np.where(leaves[:, None, None], places, places[:, ::-1])
    _, nearest = cKDTree(page.nodes[border]).query(places.mean(axis=1))
    off = places - page.nodes[border][nearest][:, None]
    samples = page.flat[border][nearest][:, None] + np.einsum("kij,ksj->ksi", np.linalg.pinv(jacobians)[nearest], off)
    return Crossings(samples, jacobians[nearest])


def parting_offset(crossings: Crossings, normal: Floats) -> float:
    """mm along a unit normal (2,) that points outwards: the place of the straight side that k crossings tell.

    The mean of all places, each as likely as what was measured is from there, however ragged the outline is. A chance
    that a sample is wrong, whatever its distance, keeps lost ones from drawing the side in.
    """
    across = crossings.samples @ normal
    per_mm = np.linalg.norm(crossings.jacobians @ normal, axis=1)[:, None]
    places = across.mean() + np.arange(-REACH, REACH + STEP, STEP) / per_mm.mean()
    within = (places[:, None, None] - across) * per_mm  # samples by which one lies within a side at this place
    right = expit(within * [1.0, -1.0] / RAGGED[:, None, None, None])
    likelihood = np.log(WRONG + (1.0 - 2.0 * WRONG) * right).sum(axis=(2, 3))
    weights = np.exp(likelihood - likelihood.max()).sum(axis=0)
    return float(np.average(places, weights=weights))
