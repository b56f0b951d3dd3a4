"""Divide light and shadow out of the page.

The paper's way: ink is masked, the bare paper's brightness is continued under it by a smooth surface, and the page is
divided by that surface (Zhang, Yip & Tan, "Removing shading distortions in camera-based document images", 2007). Here
the shape of the page tells first what light must have fallen on it, over creases and under figures too; the smooth
surface only takes what is left.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from restore.horizon import horizon_map, spread
from restore.light import MAD, SAMPLES, Light, Places, fit_light
from restore.relief import Field, Relief
from restore.scan import Bytes, Floats, Mask
from restore.texture import MM_PER_INCH

LIGHT_DPI = 60.0  # cells of 0.42 mm, the samples of the range grid: no shadow is known more exactly
LOCAL_MM = 20.0  # the brightest thing within this distance is paper
PAPER_SHARE = 0.6  # of that light: darker is ink or picture
HUE = 0.05  # of a channel's share in the colour: lamps of several colours differ by less, inks by more
CONTRAST = 0.12  # of the light expected: cells nearer to it than this are paper
NEAR_MM, FAR_MM = 6.0, 30.0  # widths of the surface that takes what the light leaves: on bare paper, and under figures
FAR_SHARE = 1e-3  # of the wide surface: it counts only where there is no paper near
LEAST_PAPER = 50  # cells: fewer tell nothing of the light
SHRINK = 4  # of the cells for that surface, which is smooth
MAX_GAIN = 8.0  # three stops: a deeper shadow holds no picture to bring back, only noise
CLIPPED = 252  # code above which the sensor may be full and the light unknown
TINY = 1e-6
CODES = 4096  # steps of light for the way back to codes: half a code at the dark end, far less elsewhere

_CODE = np.arange(256) / 255
LINEAR = np.where(_CODE <= 0.04045, _CODE / 12.92, ((_CODE + 0.055) / 1.055) ** 2.4).astype(np.float32)
"""(256,) linear light of an sRGB code (IEC 61966-2-1)."""


@dataclass(frozen=True, eq=False)
class Evened:
    """A page without its light: image (h, w, 3) uint8, and what was found of it (JSON values)."""

    image: Bytes
    facts: dict[str, Any]


def remove_shading(image: Bytes, mask: Mask, dpi: float, relief: Relief) -> Evened:
    """Even out the light of a page (h, w, 3) uint8 whose shape is known; outside mask (h, w) nothing changes."""
    colour, inside = _cells(image, mask, dpi, relief)
    chosen = np.flatnonzero(_bare(colour, inside)[inside])
    if len(chosen) < LEAST_PAPER:
        return Evened(image, {"lamps": 0, "paper_share": 0.0})
    horizon = horizon_map(relief)
    nodes = np.nan_to_num(horizon.nodes(relief.points))
    openness = cv2.remap(horizon.openness(), nodes, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    places = Places(*(field[inside] for field in (relief.points, relief.normals, openness, nodes)))
    chosen = chosen[:: max(1, len(chosen) // SAMPLES)]
    light = fit_light(colour[inside][chosen], places[chosen], horizon)
    expected = np.ones_like(colour)
    expected[inside] = np.maximum(light.on(places), light.level.max() / MAX_GAIN / 4)
    rest, paper = _rest(colour / expected, inside)
    surface = expected * rest
    gain = np.clip(light.level / np.maximum(surface, TINY), 1 / MAX_GAIN, MAX_GAIN)
    gain = np.ascontiguousarray(spread(gain, inside))
    evened = _apply(image, mask, gain, relief.dpi / dpi, LINEAR, _codes())
    return Evened(evened, _facts(light, colour, gain, paper, inside))


def _cells(image: Bytes, mask: Mask, dpi: float, relief: Relief) -> tuple[Field, Mask]:
    """Linear colour (r, c, 3) over the cells of the relief, and which of them lie wholly on the page."""
    rows, cols = relief.inside.shape
    height, width = (max(1, round(n * dpi / relief.dpi)) for n in (rows, cols))
    bottom, right = max(0, height - image.shape[0]), max(0, width - image.shape[1])
    padded = cv2.copyMakeBorder(image[:height, :width], 0, bottom, 0, right, cv2.BORDER_REPLICATE)
    covered = cv2.copyMakeBorder(mask[:height, :width].astype(np.uint8) * 255, 0, bottom, 0, right, cv2.BORDER_CONSTANT)
    codes = cv2.resize(padded, (cols, rows), interpolation=cv2.INTER_AREA)
    whole = cv2.resize(covered, (cols, rows), interpolation=cv2.INTER_AREA) == 255
    return LINEAR[codes], whole & relief.inside


def _bare(colour: Field, inside: Mask) -> Mask:
    """Where the page may show bare paper: as bright as its surroundings, of the paper's hue, and beside no ink."""
    brightness = np.where(inside, colour.mean(axis=2), 0).astype(np.float32)
    small = brightness[::SHRINK, ::SHRINK]
    reach = 2 * round(LOCAL_MM / MM_PER_INCH * LIGHT_DPI / SHRINK / 2) + 1
    brightest = cv2.dilate(small, np.ones((reach, reach), np.uint8))
    brightest = cv2.resize(brightest, brightness.shape[::-1], interpolation=cv2.INTER_LINEAR)
    hue = colour / np.maximum(colour.sum(axis=2, keepdims=True), TINY)
    bright = inside & (brightness > PAPER_SHARE * brightest)
    if not bright.any():
        return bright
    odd = np.abs(hue - np.median(hue[bright][::7], axis=0)).max(axis=2) > HUE
    dark = (~bright | odd).astype(np.uint8)
    full = colour.min(axis=2) > LINEAR[CLIPPED]
    return np.asarray((cv2.dilate(dark, np.ones((3, 3), np.uint8)) == 0) & ~full)


def _rest(ratio: Field, inside: Mask) -> tuple[Field, Mask]:
    """What the light found leaves of the paper's brightness, smooth (r, c, 3), and where bare paper was."""
    level = np.array([_mode(ratio[..., k][inside]) for k in range(3)], np.float32)
    ratio = ratio / level
    surface = np.ones_like(ratio)
    paper = inside
    for tolerance in (2 * CONTRAST, CONTRAST, CONTRAST / 2):
        paper = inside & (np.abs(ratio / surface - 1).max(axis=2) < tolerance)
        surface = _smooth(ratio, paper)
    return surface * level, paper


def _mode(values: Field) -> float:
    """The commonest value near 1: that of bare paper, since the light was fitted to it."""
    near = values[(values > 0.5) & (values < 1.5)]
    if not len(near):
        return 1.0
    count, edges = np.histogram(near, bins=100, range=(0.5, 1.5))
    top = int(np.argmax(np.convolve(count, np.ones(3), "same")))
    return float(edges[top : top + 2].mean())


def _smooth(ratio: Field, paper: Mask) -> Field:
    """The mean of the paper's ratio (r, c, 3) round every cell, continued under ink and figures."""
    size = tuple(-(-n // SHRINK) for n in paper.shape[::-1])
    weight = cv2.resize(paper.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    value = cv2.resize(ratio * paper[..., None], size, interpolation=cv2.INTER_AREA)
    total, count = TINY * np.ones_like(value), np.full_like(weight, TINY)
    for width, share in ((NEAR_MM, 1.0), (FAR_MM, FAR_SHARE)):
        sigma = width / MM_PER_INCH * LIGHT_DPI / SHRINK
        total += share * cv2.GaussianBlur(value, (0, 0), sigma)
        count += share * cv2.GaussianBlur(weight, (0, 0), sigma)
    surface: Field = cv2.resize(total / count[..., None], paper.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return surface


def _facts(light: Light, colour: Field, gain: Field, paper: Mask, inside: Mask) -> dict[str, Any]:
    before = colour[paper].mean(axis=1)
    after = (colour[paper] * gain[paper]).mean(axis=1)
    return {
        "lamps": len(light.lamps),
        "paper_share": float(paper.sum() / max(inside.sum(), 1)),
        "unevenness_before": _unevenness(before),
        "unevenness": _unevenness(after),
        "gain": {"min": float(gain[inside].min()), "max": float(gain[inside].max())},
    }


def _unevenness(brightness: Floats) -> float:
    """Robust standard deviation over the mean of bare paper."""
    if not len(brightness):
        return 0.0
    centre = np.median(brightness)
    return float(MAD * np.median(np.abs(brightness - centre)) / max(centre, TINY))


def _codes() -> NDArray[np.uint8]:
    light = np.arange(CODES) / (CODES - 1)
    codes = np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055) * 255
    return np.clip(np.rint(codes), 0, 255).astype(np.uint8)


@numba.njit(cache=True)
def _apply(image: Bytes, mask: Mask, gain: Field, scale: float, linear: Field, codes: NDArray[np.uint8]) -> Bytes:
    """Multiply the light of every masked pixel by the gain of its cells, in between by straight lines."""
    height, width, _ = image.shape
    rows, cols, _ = gain.shape
    out = image.copy()
    top = len(codes) - 1
    across = np.empty((cols, 3), np.float32)
    for row in range(height):
        y = min(max((row + 0.5) * scale - 0.5, 0.0), rows - 1.0)
        i = min(int(y), rows - 2) if rows > 1 else 0
        v = np.float32(y - i)
        below = i + 1 if rows > 1 else i
        for c in range(cols):
            for k in range(3):
                across[c, k] = gain[i, c, k] + v * (gain[below, c, k] - gain[i, c, k])
        for col in range(width):
            if not mask[row, col]:
                continue
            x = min(max((col + 0.5) * scale - 0.5, 0.0), cols - 1.0)
            j = min(int(x), cols - 2) if cols > 1 else 0
            u = np.float32(x - j)
            right = j + 1 if cols > 1 else j
            for k in range(3):
                light = linear[image[row, col, k]] * (across[j, k] + u * (across[right, k] - across[j, k]))
                out[row, col, k] = codes[min(int(light * top + 0.5), top)]
    return out
