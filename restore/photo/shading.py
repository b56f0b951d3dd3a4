"""Removes the shading of a page that was textured from several pictures.

Each picture was taken in its own light, and on a creased page no smooth match makes one of the other. So each is
textured alone, its own light is found and removed, and only then are they blended.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from restore.numerics.limits import SINGLE_TINY
from restore.page import FlatMesh
from restore.photo.coarse import LINEAR
from restore.photo.page import Registered, sources_of
from restore.photo.paint import MIN_SHARE, enlarged, lit, paint
from restore.photo.sources import Plan, Source, plan
from restore.scan import Bytes, Mask
from restore.shading.relief import Field, Relief
from restore.shading.remove import ShadingResult, remove_shading

SPARED = 97  # every 97th common pixel of two pictures suffices for a comparison


def remove_registered_shading(
    page: FlatMesh, registered: Sequence[Registered], dpi: float, relief: Relief, painted: Bytes, mask: Mask
) -> ShadingResult:
    """Return a page without its light, from registered photographs.

    painted: (h, w, 3), the page's image, textured from them where mask (h, w) is True.
    """
    sources = sources_of(page, registered)
    planned = plan(page, sources) if len(sources) > 1 else None
    used = [] if planned is None else [k for k, share in enumerate(planned.weights) if share.max() > MIN_SHARE]
    if planned is None or len(used) < 2:
        return remove_shading(painted, mask, dpi, relief)
    # The scanner saw all of the page, and the more paper there is the better its light is known.
    rows, cols = mask.shape
    shares = {k: enlarged(planned.weights[k], 0, rows, cols, dpi) for k in used}
    seen = {k: mask & (share > MIN_SHARE) if k else mask for k, share in shares.items()}
    painted_from = {k: _painted_from(page, sources, planned, k, dpi) for k in used}
    evened = {k: remove_shading(painted_from[k], seen[k], dpi, relief) for k in used}
    main = max(used, key=lambda k: float(shares[k][mask].sum()))
    total = np.zeros((*mask.shape, 3), np.float32)
    weight = np.zeros((*mask.shape, 1), np.float32)
    for k in used:
        share = np.where(seen[k], shares[k], 0)[..., None]
        gain = _gain(evened[main].image, evened[k].image, seen[main] & seen[k])
        total += share * (evened[k].image if k == main else lit(evened[k].image.astype(np.float32), gain))
        weight += share
    image = np.where(mask[..., None], total / np.maximum(weight, MIN_SHARE) + 0.5, painted).astype(np.uint8)
    return ShadingResult(image, _report(evened, main))


def _report(evened: Mapping[int, ShadingResult], main: int) -> dict[str, Any]:
    """Return the report on the main picture.

    With the first reason for which the light of any picture was kept.
    """
    reasons = {k: result.report["reason"] for k, result in evened.items() if "reason" in result.report}
    if not reasons:
        return evened[main].report
    first = min(reasons)
    name = f"photograph {first}" if first else "the scanner's image"
    return evened[main].report | {"removed": False, "reason": f"{reasons[first]} (in {name})"}


def _painted_from(page: FlatMesh, sources: Sequence[Source], planned: Plan, k: int, dpi: float) -> Bytes:
    """The page painted from one source only."""
    weights = np.zeros_like(planned.weights)
    weights[k] = 1.0
    return paint(page, sources, replace(planned, weights=weights, gains=np.ones_like(planned.gains)), dpi).image


def _gain(wanted: Bytes, given: Bytes, both: Mask) -> Field:
    """Return the gain (3,) that matches one picture's light to another's.

    In level and colour.
    """
    some = np.flatnonzero(both)[::SPARED]
    light = [LINEAR[picture.reshape(-1, 3)[some]].sum(axis=0, dtype=float) + SINGLE_TINY for picture in (wanted, given)]
    return np.asarray(light[0] / light[1], dtype=np.float32)
