"""What most photographs show of a page: the reference that each of them is compared with.

The scanner's image is one witness; of a page from photographs alone it is one of the photographs, with the hand that
lies on the page in it. Where three photographs or more show a place, the median of all is what most of them show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from restore.photo.coarse import CoarseView
from restore.photo.obstructions import fitted_gains
from restore.scan import Floats

MIN_WITNESSES = 3  # of a majority, one of them wrong


def consensus(views: Sequence[CoarseView], scanned: CoarseView, normals: Floats) -> CoarseView:
    """Return the median of views in the light of the scan, and the scan where they are few.

    All are (h, w).
    normals: (h, w, 3), of the surface.
    """
    views = [view for view in views if (view.good & scanned.good).any()]  # the light of others cannot be compared
    if len(views) < MIN_WITNESSES:
        return scanned
    seen = np.array([view.good for view in views])
    sharp = seen & [view.resolved for view in views]
    enough, enough_sharp = (mask.sum(axis=0) >= MIN_WITNESSES for mask in (seen, sharp))
    if not enough.any():
        return scanned
    lights = np.full((len(views), enough.sum(), 3), np.nan)
    for light, view, witness in zip(lights, views, np.where(enough_sharp, sharp, seen), strict=True):
        gains = fitted_gains(view.light, scanned.light, normals, view.good & scanned.good)
        light[witness[enough]] = (view.light / np.exp(gains))[enough & witness]
    usual = scanned.light.copy()
    usual[enough] = np.nanmedian(lights, axis=0)
    resolved = np.where(enough, enough_sharp, scanned.resolved)
    return replace(scanned, good=scanned.good | enough, light=usual, resolved=resolved)
