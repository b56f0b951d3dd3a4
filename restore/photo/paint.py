"""Textures the page from photographs, else from the scanner's image."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from restore.camera.photo_camera import project_map
from restore.mesh.raster import rasterise
from restore.numerics.srgb import LINEAR
from restore.page import FlatMesh
from restore.photo.coarse import COARSE_DPI
from restore.photo.sources import Plan, Source
from restore.runtime.rows import Rows
from restore.runtime.threads import in_bands
from restore.scan import Bytes, Mask
from restore.texture.page import MM_PER_INCH, PAPER, Painting, picture_size, texture_mtf50
from restore.texture.resolution import Resolution
from restore.texture.sampling import sample_scaled

BAND = 256  # rows painted at once: 60 MB at a time for an A4 page at 400 dpi
MIN_FRACTION = 1 / 512  # of a pixel: less changes no code
NOWHERE = 255  # source of what is not on the page
RING = 2.0  # pixels: the nearest pixel inside is one of the outermost
EDGE_MM = 0.6  # the outline is known to a sample: so near to it, the photograph may show the table

Codes = NDArray[np.float32]


def paint(page: FlatMesh, sources: Sequence[Source], plan: Plan, dpi: float) -> Painting:
    """Paint a flat page at `dpi` as planned; sources[0] is the scanner's texture.

    Raises BadInput when the page would be too large for any memory.
    """
    assert page.texcoords is not None
    scale = dpi / MM_PER_INCH
    corner = np.array([page.flat[:, 0].min(), page.flat[:, 1].max()])
    corners = (page.flat - corner) * [scale, -scale] - 0.5
    width, height = picture_size(page.flat, dpi)
    image, mask = np.empty((height, width, 3), np.uint8), np.empty((height, width), bool)
    where, which = np.empty((height, width, 2), np.float32), np.empty((height, width), np.uint8)
    values = np.column_stack([page.vertices, page.texcoords])

    def paint_band(band: slice) -> None:
        surface = rasterise(corners - [0, band.start], page.faces, values, band.stop - band.start, width)
        mask[band] = np.isfinite(surface[..., 0])
        image[band], where[band], which[band] = _band(surface, sources, plan, band.start, dpi)

    in_bands(paint_band, height, BAND)
    _carry_to_edge(image, mask, round(EDGE_MM * scale))
    return Painting(image, mask, Rows.of(where), _resolution(page, sources, plan), which)


def _band(
    surface: Codes, sources: Sequence[Source], plan: Plan, top: int, dpi: float
) -> tuple[Bytes, Codes, NDArray[np.uint8]]:
    """Some rows of the page: their colours, the source pixel of each and the source."""
    rows, cols = surface.shape[:2]
    off = np.isnan(surface[..., 0])
    weights = [enlarged(layer, top, rows, cols, dpi) for layer in plan.weights]
    best = np.argmax(weights, axis=0).astype(np.uint8)
    where = np.full((rows, cols, 2), np.nan, np.float32)
    total = np.zeros((rows, cols, 4), np.float32)
    for k, (source, weight) in enumerate(zip(sources, weights, strict=True)):
        used = (weight > MIN_FRACTION) & ~off
        if not used.any():
            continue
        pixels = surface[..., 3:].copy() if source.camera is None else project_map(source.camera, surface[..., :3])
        np.copyto(where, pixels, where=(best == k)[..., None])
        pixels[~used] = np.nan
        codes = sample_scaled(source.image, pixels)
        if (plan.gains[k] != 1).any():
            codes[used] = lit(codes[used], enlarged(plan.gains[k], top, rows, cols, dpi)[used])
        _add(total, codes, weight, used)
    best[off] = NOWHERE
    return _blended(total, off), where, best


@numba.njit(cache=True, nogil=True)
def _add(total: Codes, codes: Codes, weight: Codes, used: Mask) -> None:
    """Add codes (h, w, 3) by their weight (h, w) to the sums.

    total: (h, w, 4), the last that of the weights.
    """
    rows, cols = weight.shape
    for row in range(rows):
        for col in range(cols):
            if used[row, col]:
                fraction = weight[row, col]
                for k in range(3):
                    total[row, col, k] += fraction * codes[row, col, k]
                total[row, col, 3] += fraction


@numba.njit(cache=True, nogil=True)
def _blended(total: Codes, off: Mask) -> Bytes:
    """Return the means (h, w, 3) of sums (h, w, 4); paper off the page."""
    rows, cols = off.shape
    image = np.full((rows, cols, 3), PAPER, np.uint8)
    for row in range(rows):
        for col in range(cols):
            if not off[row, col]:
                fraction = np.float32(1) / max(total[row, col, 3], np.float32(MIN_FRACTION))
                for k in range(3):
                    image[row, col, k] = int(total[row, col, k] * fraction + np.float32(0.5))
    return image


def enlarged(layer: Codes, top: int, rows: int, cols: int, dpi: float) -> Codes:
    """Rows of a page at `dpi` out of a layer (h, w, …) of the coarse page."""
    x = ((np.arange(cols) + 0.5) * COARSE_DPI / dpi - 0.5).astype(np.float32)
    y = ((np.arange(top, top + rows) + 0.5) * COARSE_DPI / dpi - 0.5).astype(np.float32)
    x, y = np.broadcast_arrays(x[None, :], y[:, None])
    larger: Codes = cv2.remap(
        layer, np.ascontiguousarray(x), np.ascontiguousarray(y), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return larger


def lit(codes: Codes, gain: Codes) -> Codes:
    """Codes (…, 3) whose linear light is multiplied by gain (…, 3)."""
    light = np.interp(codes, np.arange(256), LINEAR) * gain
    return np.interp(light, LINEAR, np.arange(256)).astype(np.float32)


def _carry_to_edge(image: Bytes, mask: Mask, margin: int) -> None:
    """Extend the nearest inner pixels' colour, in place, to the last ones before the edge."""
    if margin < 1:
        return
    away = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1]
    outer = away <= margin
    ring = (away > margin) & (away <= margin + RING)
    if not ring.any():
        return
    _, nearest = cv2.distanceTransformWithLabels(outer.astype(np.uint8), cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL)
    inner = np.zeros(int(nearest.max()) + 1, np.int64)
    inner[nearest[ring]] = np.flatnonzero(ring)
    edge = outer & mask
    image[edge] = image.reshape(-1, 3)[inner[nearest[edge]]]


def _resolution(page: FlatMesh, sources: Sequence[Source], plan: Plan) -> Resolution:
    best = np.argmax(plan.weights, axis=0)
    ppi = np.take_along_axis(plan.ppi, best[None], axis=0)[0]
    if not (ppi > 0).any():
        return Resolution(0.0)
    main = int(np.argmax(np.bincount(best[ppi > 0], minlength=len(sources))))
    mtf50 = sources[main].mtf50 if main else texture_mtf50(page)
    return Resolution(float(np.median(ppi[ppi > 0])), mtf50)
