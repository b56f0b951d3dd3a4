"""Removes the shading of a page that was textured from several pictures.

Each picture was taken in its own light, and on a creased page no smooth match makes one of the other. So each is
textured alone, its own light is found and removed, and only then are they blended.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from restore.numerics.limits import SINGLE_TINY
from restore.numerics.srgb import LINEAR
from restore.page import FlatMesh
from restore.photo.page import Registered, sources_of
from restore.photo.paint import MIN_FRACTION, enlarged, lit, paint
from restore.photo.sources import Plan, Source, plan
from restore.report import LightReport
from restore.scan import Bytes, Mask
from restore.shading.relief import Field, Relief
from restore.shading.remove import LIGHT_DPI, ShadingResult, find_light
from restore.texture.page import Painting

SPARED = 97  # every 97th common pixel of two pictures suffices for a comparison


def remove_registered_shading(
    page: FlatMesh, registered: Sequence[Registered], relief: Relief, cells: Painting, painting: Painting, dpi: float
) -> ShadingResult:
    """Remove the light of a page painted at `dpi`.

    cells: the same painted at LIGHT_DPI.
    """
    sources = sources_of(page, registered)
    planned = plan(page, sources) if len(sources) > 1 else None
    used = [] if planned is None else [k for k, layer in enumerate(planned.weights) if layer.max() > MIN_FRACTION]
    if planned is None or len(used) < 2:
        return find_light(cells.image, cells.mask, relief).removed_from(painting.image, painting.mask, dpi)
    mask, layers = painting.mask, {k: planned.weights[k] for k in used}
    evened, seen = {}, {}
    for k, layer in layers.items():
        alone = [_painted_from(page, sources, planned, k, at) for at in (LIGHT_DPI, dpi)]
        shown, seen[k] = (_seen(one.mask, layer, k, at) for one, at in ((cells, LIGHT_DPI), (painting, dpi)))
        evened[k] = find_light(alone[0], shown, relief).removed_from(alone[1], seen[k], dpi)
    main = max(used, key=lambda k: float(_enlarged(layers[k], mask, dpi)[mask].sum()))
    total = np.zeros((*mask.shape, 3), np.float32)
    weight = np.zeros((*mask.shape, 1), np.float32)
    for k in used:
        counted = np.where(seen[k], _enlarged(layers[k], mask, dpi), 0)[..., None]
        gain = _gain(evened[main].image, evened[k].image, seen[main] & seen[k])
        total += counted * (evened[k].image if k == main else lit(evened[k].image.astype(np.float32), gain))
        weight += counted
    image = np.where(mask[..., None], total / np.maximum(weight, MIN_FRACTION) + 0.5, painting.image).astype(np.uint8)
    return ShadingResult(image, _report(evened, main))


def _seen(mask: Mask, layer: Field, k: int, dpi: float) -> Mask:
    """Mark where a page (h, w) is painted from the source k, by its layer of weights.

    The scanner saw all of the page, and the more paper there is the better its light is known.
    """
    return mask & (_enlarged(layer, mask, dpi) > MIN_FRACTION) if k else mask


def _enlarged(layer: Field, mask: Mask, dpi: float) -> Field:
    """Enlarge a layer of the coarse page to the shape of mask (h, w)."""
    rows, cols = mask.shape
    return enlarged(layer, 0, rows, cols, dpi)


def _report(evened: Mapping[int, ShadingResult], main: int) -> LightReport:
    """Return the main picture's report, with the first reason for which any light was kept."""
    reasons = {k: result.report["reason"] for k, result in evened.items() if "reason" in result.report}
    if not reasons:
        return evened[main].report
    first = min(reasons)
    name = f"photograph {first}" if first else "the scanner's image"
    return {**evened[main].report, "removed": False, "reason": f"{reasons[first]} (in {name})"}


def _painted_from(page: FlatMesh, sources: Sequence[Source], planned: Plan, k: int, dpi: float) -> Bytes:
    weights = np.zeros_like(planned.weights)
    weights[k] = 1.0
    return paint(page, sources, replace(planned, weights=weights, gains=np.ones_like(planned.gains)), dpi).image


def _gain(wanted: Bytes, given: Bytes, both: Mask) -> Field:
    """Return the gain (3,) that matches one picture's light to another's, in level and colour."""
    some = np.flatnonzero(both)[::SPARED]
    light = [LINEAR[picture.reshape(-1, 3)[some]].sum(axis=0, dtype=float) + SINGLE_TINY for picture in (wanted, given)]
    return np.asarray(light[0] / light[1], dtype=np.float32)
