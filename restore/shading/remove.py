"""Divide light and shadow out of the page.

The paper's way: ink is masked, the bare paper's brightness is continued under it by a smooth surface, and the page is
divided by that surface (Zhang, Yip & Tan, "Removing shading distortions in camera-based document images", 2007). Here
the shape of the page tells first what light must have fallen on it, over creases and under figures too; the smooth
surface only takes what is left.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from typing import Any

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from restore.bands import in_bands
from restore.numerics import SINGLE_TINY
from restore.robust import MAD_TO_SIGMA
from restore.scan import Bytes, Floats, Mask
from restore.shading.channels import as_list, highest, lowest, scaled, total_of
from restore.shading.crease_residual import crease_light
from restore.shading.horizon_map import fill_nearest, horizon_map
from restore.shading.lamps import SAMPLES, Light, Places, fit_light
from restore.shading.paper import paper_candidates
from restore.shading.relief import Field, Relief
from restore.shading.srgb import LINEAR, srgb_codes
from restore.texture.page import MM_PER_INCH

LIGHT_DPI = 60.0  # cells of 0.42 mm, the samples of the range grid: no shadow is known more exactly
TINT = 0.15  # of it, from channel to channel: noise of dim paper stays below, pale inks do not
CONTRAST = 0.12  # of the light expected: cells nearer to it than this are paper
NEAR_MM, FAR_MM = 6.0, 30.0  # widths of the surface that takes what the light leaves: on bare paper, and under figures
FAR_SHARE = 1e-3  # of the wide surface: it counts only where there is no paper near
LEAST_PAPER = 50  # cells: fewer tell nothing of the light
SHRINK = 4  # of the cells for that surface, which is smooth
LITTLE_PAPER = 0.25  # of the page: dark pages that were worse without their light had 4 to 20 %
MAX_GAIN = 8.0  # three stops: a deeper shadow holds no picture to bring back, only noise
DIMMEST = 4 * MAX_GAIN  # of the level light: less is not found in any hollow, and would be divided by
BLUR_MM = 0.5  # of a camera with 50 pixels to the inch
BRIGHTEST = 1.3  # of the paper's light in one channel: printed on white, no ink gives back more
SPARED = 7  # of the cells one in so many tells how uneven they are
CODES = 4096  # steps of light for the way back to codes: half a code at the dark end, far less elsewhere


@dataclass(frozen=True, eq=False)
class ShadingResult:
    """A page with its shading removed: image (h, w, 3) uint8, and the report on it (JSON values)."""

    image: Bytes
    report: dict[str, Any]


def remove_shading(image: Bytes, mask: Mask, dpi: float, relief: Relief) -> ShadingResult:
    """Page (h, w, 3) uint8 with its shading divided out, by its relief; pixels outside mask (h, w) do not change."""
    colour, inside = _cells(image, mask, dpi, relief)
    chosen = np.flatnonzero(paper_candidates(colour, inside, relief.dpi))
    if len(chosen) < LEAST_PAPER:
        return ShadingResult(image, {"lamps": 0, "paper_share": 0.0})
    horizon = horizon_map(relief)
    nodes = horizon.nodes(relief.points)
    openness = cv2.remap(horizon.openness(), nodes, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    # What lies off the page is taken along, and never looked at: to sort it out would take longer.
    places = Places(*(as_list(field) for field in (relief.points, relief.normals, openness, nodes)))
    chosen = chosen[:: max(1, len(chosen) // SAMPLES)]
    light = fit_light(as_list(colour)[chosen], places[chosen], horizon)
    # From here on light is measured in the level light.
    relative = 1 / np.maximum(light.level, SINGLE_TINY)
    expected = np.maximum(scaled(light.irradiance(places).reshape(colour.shape), relative), 1 / DIMMEST)
    # The camera has blurred the light of a crease with everything else.
    expected = cv2.GaussianBlur(fill_nearest(expected, inside), (0, 0), BLUR_MM / MM_PER_INCH * relief.dpi)
    seen = scaled(colour, relative)
    rest, paper = _residual_light(seen / expected, inside)
    surface = expected * rest
    reflectance = seen / surface
    surface *= crease_light(lowest(reflectance), highest(reflectance), total_of(expected), inside)[..., None]
    gain = fill_nearest(np.clip(1 / np.maximum(surface, SINGLE_TINY), 1 / MAX_GAIN, MAX_GAIN), inside)
    evened, scale, codes = np.empty_like(image), relief.dpi / dpi, srgb_codes(np.arange(CODES) / (CODES - 1))
    in_bands(lambda band: _multiply(image, mask, gain, scale, LINEAR, codes, band.start, evened[band]), len(image))
    return ShadingResult(evened, _shading_report(light, colour, gain, paper, inside))


def doubts(report: Mapping[str, Any]) -> list[str]:
    """Warnings that follow from the report of a removal: little bare paper means that print may be taken for light."""
    share = report.get("paper_share")
    if share is None or share >= LITTLE_PAPER:
        return []
    if share == 0.0:
        return ["the light is kept: no bare paper was found on the page"]
    return [
        f"bare paper was found on {share:.0%} of the page only: of dark pages and of pictures that reach the border, "
        "print may have been divided out with the light; compare with the master"
    ]


def _cells(image: Bytes, mask: Mask, dpi: float, relief: Relief) -> tuple[Field, Mask]:
    """Linear colour (r, c, 3) over the cells of the relief, and which of them lie wholly on the page."""
    rows, cols = relief.inside.shape
    scale = relief.dpi / dpi
    # The last cells may reach over the edge of the image.
    high, wide = (max(1, min(count, int(n * scale))) for count, n in zip((rows, cols), mask.shape, strict=True))
    within = np.s_[: max(1, round(high / scale)), : max(1, round(wide / scale))]
    codes = cv2.resize(image[within], (wide, high), interpolation=cv2.INTER_AREA)
    reach = 2 * ceil(1 / scale / 2) + 1  # pixels of a cell, and a fraction more
    whole = cv2.erode(mask[within].view(np.uint8), np.ones((reach, reach), np.uint8))
    whole = cv2.resize(whole, (wide, high), interpolation=cv2.INTER_NEAREST_EXACT) > 0
    codes = cv2.copyMakeBorder(codes, 0, rows - high, 0, cols - wide, cv2.BORDER_REPLICATE)
    whole = np.pad(whole, ((0, rows - high), (0, cols - wide)))
    return np.asarray(cv2.LUT(codes, LINEAR)), whole & relief.inside


def _residual_light(ratio: Field, inside: Mask) -> tuple[Field, Mask]:
    """Smooth residual (r, c, 3) of the paper's brightness over the fitted light, and the paper mask (r, c)."""
    some = as_list(ratio)[np.flatnonzero(inside)[::SPARED]]
    level = np.array([_mode(some[:, k]) for k in range(3)])
    ratio = scaled(ratio, 1 / level)
    # To tell where there may be paper, few cells do.
    few, within = ratio[::SHRINK, ::SHRINK], inside[::SHRINK, ::SHRINK]
    smooth = np.ones_like(few)
    for tolerance in (2 * CONTRAST, CONTRAST):
        paper = _paper(few / smooth, tolerance, within)
        smooth = _smooth(few * paper[..., None], paper.astype(np.float32))
    paper = _paper(ratio / _enlarged(smooth, inside), CONTRAST / 2, inside)
    fields = cv2.copyTo(ratio, paper.view(np.uint8)), paper.astype(np.float32)
    size = smooth.shape[1::-1]
    surface = _enlarged(_smooth(*(cv2.resize(field, size, interpolation=cv2.INTER_AREA) for field in fields)), inside)
    return scaled(surface * _excess_light(ratio / surface, inside), level), paper


def _paper(ratio: Field, tolerance: float, inside: Mask) -> Mask:
    """Where the page is paper by a ratio (r, c, 3) that is 1 there, give or take a tolerance."""
    low, high = lowest(ratio), highest(ratio)
    return np.asarray(inside & (low > 1 - tolerance) & (high < 1 + tolerance) & (high - low < TINT))


def _excess_light(ratio: Field, inside: Mask) -> Field:
    """(r, c, 1) factor by which the light must exceed the fitted light, 1 almost everywhere.

    No ink is brighter than paper in all channels, and none much brighter in one: what seems to be lies beside a crease
    or a shadow that is not quite where it was thought to be.
    """
    above = np.maximum(lowest(ratio) / (1 + CONTRAST / 2), highest(ratio) / BRIGHTEST)
    above = np.where(inside, np.maximum(above, 1), 1).astype(np.float32)
    lifted: Field = cv2.GaussianBlur(cv2.dilate(above, np.ones((3, 3), np.uint8)), (0, 0), 1.0)
    return lifted[..., None]


def _mode(values: Field) -> float:
    """The commonest value near 1: that of bare paper, since the light was fitted to it."""
    near = values[(values > 0.5) & (values < 1.5)]
    if not len(near):
        return 1.0
    count, edges = np.histogram(near, bins=100, range=(0.5, 1.5))
    top = int(np.argmax(np.convolve(count, np.ones(3), "same")))
    return float(edges[top : top + 2].mean())


def _smooth(value: Field, weight: Field) -> Field:
    """The weighted mean round every cell of every SHRINK-th row and column: value (r, c, 3) is that of paper times
    weight (r, c), the share of paper; under ink and figures it is continued."""
    total, count = SINGLE_TINY * np.ones_like(value), np.full_like(weight, SINGLE_TINY)
    for width, share in ((NEAR_MM, 1.0), (FAR_MM, FAR_SHARE)):
        sigma = width / MM_PER_INCH * LIGHT_DPI / SHRINK
        total += share * cv2.GaussianBlur(value, (0, 0), sigma)
        count += share * cv2.GaussianBlur(weight, (0, 0), sigma)
    return np.asarray(total / count[..., None])


def _enlarged(field: Field, over: Mask) -> Field:
    """A smooth field on every cell of a mask (r, c)."""
    return np.asarray(cv2.resize(field, over.shape[::-1], interpolation=cv2.INTER_LINEAR))


def _shading_report(light: Light, colour: Field, gain: Field, paper: Mask, inside: Mask) -> dict[str, Any]:
    some = np.flatnonzero(paper)[::SPARED]
    seen, gains = (as_list(field)[some] for field in (colour, gain))
    before, after = seen.mean(axis=1), (seen * gains).mean(axis=1)
    return {
        "lamps": len(light.lamps),
        "paper_share": float(paper.sum() / max(inside.sum(), 1)),
        "unevenness_before": _unevenness(before),
        "unevenness": _unevenness(after),
        "gain": {"min": float(gain.min()), "max": float(gain.max())},
    }


def _unevenness(brightness: Floats) -> float:
    """Robust standard deviation over the mean of bare paper."""
    if not len(brightness):
        return 0.0
    centre = np.median(brightness)
    return float(MAD_TO_SIGMA * np.median(np.abs(brightness - centre)) / max(centre, SINGLE_TINY))


@numba.njit(cache=True, nogil=True)
def _multiply(
    image: Bytes, mask: Mask, gain: Field, scale: float, linear: Field, codes: NDArray[np.uint8], first: int, out: Bytes
) -> None:
    """Multiply the light of every masked pixel by the gain of its cells, in between by straight lines.

    The rows of the image from `first` on are written to out (some rows, w, 3).
    """
    _, width, _ = image.shape
    rows, cols, _ = gain.shape
    top = np.float32(len(codes) - 1)
    across = np.empty((cols, 3), np.float32)
    left, share = np.empty(width, np.uint32), np.empty(width, np.float32)
    for col in range(width):
        x = min(max((col + 0.5) * scale - 0.5, 0.0), cols - 1.0)
        left[col] = min(int(x), max(cols - 2, 0))
        share[col] = x - left[col]
    step = np.uint32(1 if cols > 1 else 0)  # without a sign, no index needs a look for negative ones
    for row in range(first, first + len(out)):
        y = min(max((row + 0.5) * scale - 0.5, 0.0), rows - 1.0)
        i = min(int(y), max(rows - 2, 0))
        v = np.float32(y - i)
        below = min(i + 1, rows - 1)
        for c in range(cols):
            for k in range(3):
                across[c, k] = top * (gain[i, c, k] + v * (gain[below, c, k] - gain[i, c, k]))
        before, after, on = image[row], out[row - first], mask[row]
        for col in range(width):
            if not on[col]:
                after[col] = before[col]
                continue
            j, u = left[col], share[col]
            for k in range(3):
                here = across[j, k]
                light = linear[before[col, k]] * (here + u * (across[j + step, k] - here))
                after[col, k] = codes[np.uint32(min(light + np.float32(0.5), top))]
