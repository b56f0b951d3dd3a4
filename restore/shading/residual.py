"""Residual of the fitted light on the page's ground.

It is a smooth surface, measured on the ground alone. The ground is the paper of a page, or the one ink that covers most
of it. It is found from its largest patch on: a patch belongs to it when it has the ground's colour where it lies, by
the surface that the ground has given so far. A pale tint or a grey field differs from that by its edge, and is print,
however large it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from restore.numerics.limits import SINGLE_TINY
from restore.scan import Floats, Ints, Mask
from restore.shading.channels import as_list, highest, lowest, scaled, total_of
from restore.shading.regions import MIN_FRACTION, NOISE_RANGE, WINDOW, patches_of, relative_noise
from restore.shading.relief import Field
from restore.shading.steps import VISIBLE
from restore.texture.page import MM_PER_INCH

CONTRAST = 0.12  # of the ground: patches nearer to it than this may be where it begins
TINT = 0.06  # of it, from channel to channel: noise of a dim cell stays below
NEAR_MM, FAR_MM = 6.0, 30.0  # widths of the surface: on the ground, and under figures
FAR_FRACTION = 1e-3  # of the wide surface: it counts only away from the ground
SHRINK = 4  # of the cells for that surface, which is smooth
ROUNDS = 3  # of patches joining the ground
EDGE = 0.025  # of the ratio, over two windows, which show two thirds of a step: what the lamps leave changes by less
CREASE_EDGE = 0.06  # along creases, where the lamps leave a step
SPARED = 7  # every seventh cell suffices for the level


@dataclass(frozen=True, eq=False)
class Residual:
    """Residual of the ground's brightness.

    surface: (r, c, 1), 1 on average.
    ground: (r, c), and its colour (3,).
    """

    surface: Field
    ground: Mask
    colour: Field


def residual_light(ratio: Field, normals: Field, inside: Mask, dpi: float) -> Residual:
    """Residual of the ground over the fitted light.

    ratio (r, c, 3): colour over the fitted light, `dpi` cells to the inch; normals (r, c, 3).
    """
    level = _level(as_list(ratio)[np.flatnonzero(inside)[::SPARED]])
    ratio = scaled(ratio, 1 / level)
    patches = patches_of(ratio, normals, inside, EDGE, CREASE_EDGE)
    smooth = np.ones_like(ratio[..., :1])
    plain = inside & ~_tinted(ratio, inside)
    ground = _core(ratio, patches) & plain
    if ground.sum() < MIN_FRACTION * inside.sum():
        return Residual(smooth, np.zeros_like(inside), level)
    for _ in range(ROUNDS):
        smooth = _surface(ratio, ground, dpi)
        unit = ratio / smooth
        alike = _alike(unit, patches)
        ground = (patches > 0) & alike[patches] & plain & _near(unit, CONTRAST)
    ground |= (patches == 0) & plain & _near(ratio / smooth, 2 * VISIBLE)
    return Residual(_surface(ratio, ground, dpi), ground, level)


def _core(ratio: Field, patches: Ints) -> Mask:
    """Return the largest patch of about the ground's colour, (r, c)."""
    areas, means = _means(ratio, patches)
    areas = np.where((np.abs(means - 1) < CONTRAST).all(axis=1), areas, 0)
    areas[0] = 0
    return np.asarray((patches == int(np.argmax(areas))) & (patches > 0))


def _alike(unit: Field, patches: Ints) -> Mask:
    """Return whether each patch has the colour 1 in all channels, (n,)."""
    _, means = _means(unit, patches)
    return np.asarray((np.abs(means - 1) < VISIBLE).all(axis=1))


def _means(field: Field, patches: Ints) -> tuple[Floats, Floats]:
    """Cells (n,) and mean colour (n, 3) of every patch."""
    numbers = patches.ravel()
    areas = np.bincount(numbers).astype(float)
    sums = [np.bincount(numbers, field[..., k].ravel()) for k in range(3)]
    return areas, np.stack(sums, axis=1) / np.maximum(areas, 1)[:, None]


def _tinted(ratio: Field, inside: Mask) -> Mask:
    """Return where a ratio (r, c, 3) differs between channels, (r, c).

    The lamps' own colours have been removed from it.
    """
    calm = np.maximum(cv2.blur(ratio, (WINDOW, WINDOW)), SINGLE_TINY)
    high, noise = highest(calm), relative_noise(total_of(ratio), total_of(calm), inside)
    return np.asarray(high - lowest(calm) > (TINT + NOISE_RANGE * noise) * high)


def _near(unit: Field, tolerance: float) -> Mask:
    """Return where a ratio (r, c, 3) is 1 within a tolerance, (r, c)."""
    return np.asarray((lowest(unit) > 1 - tolerance) & (highest(unit) < 1 + tolerance))


def _surface(ratio: Field, ground: Mask, dpi: float) -> Field:
    """Return the weighted mean brightness of the ground round every cell, also under ink.

    One for all channels: what the lamps leave is of their colour, and a faint tint is print. Returns (r, c, 1).
    """
    size = tuple(-(-n // SHRINK) for n in ground.shape[::-1])
    brightness = np.where(ground, total_of(ratio) / 3, np.float32(0))
    value, weight = (
        cv2.resize(field, size, interpolation=cv2.INTER_AREA) for field in (brightness, ground.astype(np.float32))
    )
    total, count = np.full_like(value, SINGLE_TINY), np.full_like(value, SINGLE_TINY)
    for width, fraction in ((NEAR_MM, 1.0), (FAR_MM, FAR_FRACTION)):
        sigma = width / MM_PER_INCH * dpi / SHRINK
        total += fraction * cv2.GaussianBlur(value, (0, 0), sigma)
        count += fraction * cv2.GaussianBlur(weight, (0, 0), sigma)
    smooth = cv2.resize(total / count, ground.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(smooth[..., None])


def _level(colours: Field) -> Field:
    """Return the commonest colour near 1, that of the ground.

    The light was fitted to it. One brightness is looked for, and the median colour at it, so that no channel is taken
    from another print.
    colours: (n, 3). Returns (3,).
    """
    colours = colours[(np.abs(colours - 1) < 2 * CONTRAST).all(axis=1)]
    if not len(colours):
        return np.ones(3, np.float32)
    brightness = colours.mean(axis=1)
    count, edges = np.histogram(brightness, bins=50, range=(1 - 2 * CONTRAST, 1 + 2 * CONTRAST))
    top = int(np.argmax(np.convolve(count, np.ones(3), "same")))
    common = (brightness >= edges[max(top - 1, 0)]) & (brightness <= edges[min(top + 2, 50)])
    return np.asarray(np.median(colours[common], axis=0), dtype=np.float32)
