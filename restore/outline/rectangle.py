"""Rectangular pages: the rotation that aligns one with the axes, and its size."""

from __future__ import annotations

import cv2
import numpy as np

from restore.numerics.robust import NEARLY_ALL
from restore.scan import Floats

MIN_TORN_FILL = 0.8  # of it, with a corner torn off: a larger one takes two thirds of both adjacent sides
MIN_TORN_SIDE = 0.3  # straight fraction of the sides that it shortens: of a fifth, a third; of a slanting side 0.1
SIDE_BAND_MM = 2.0  # outline points this near to a side belong to it
TIP_FRACTION = 0.02  # of the outline points: a tip has fewer; more, in all, are the corners of a page with pointed ones
BINS = 20  # of a side: outlines of pages have a few points in each
TRIMS = 2  # a tip may rotate the rectangle that the first starts from
CORNER_FRACTION = 0.05  # of a side at either end is left out: there it may be rounded or dog-eared


def fills_rectangle(outline: Floats, area: float) -> bool:
    """Return whether a page is a rectangle up to rough sides and dog-ears.

    outline: (n, 2) mm, of a page of `area` mm².
    """
    _, (width, height), _ = cv2.minAreaRect(_without_tips(outline).astype(np.float32))
    return bool(area >= (1.0 - CORNER_FRACTION) * width * height)


def has_straight_sides(outline: Floats, area: float) -> bool:
    """Return whether a page is a rectangle, up to a corner torn off.

    The two sides away from that corner are then straight all along, and of those next to it the rest.
    outline: (n, 2) mm, of a page of `area` mm².
    """
    if fills_rectangle(outline, area):
        return True
    outline = _without_tips(outline)
    _, (width, height), angle = cv2.minAreaRect(outline.astype(np.float32))
    if area < MIN_TORN_FILL * width * height:
        return False
    fractions = _straight_fractions(outline @ _rotation(-np.deg2rad(angle)).T)
    whole = fractions >= NEARLY_ALL  # dents take a part of them
    return bool(whole[0].any() and whole[1].any() and fractions.min() >= MIN_TORN_SIDE)


def _straight_fractions(outline: Floats) -> Floats:
    """Return the straight fractions of an outline's (n, 2) low and high sides across x, y.

    Returns (2, 2).
    """
    low, high = outline.min(axis=0), outline.max(axis=0)
    fractions = np.zeros((2, 2))
    for across in (0, 1):
        place = (outline[:, 1 - across] - low[1 - across]) / (high - low)[1 - across]
        for end, side in enumerate((low[across], high[across])):
            near_side = np.abs(outline[:, across] - side) < _band((high - low)[across])
            found = np.histogram(place[near_side], BINS, (CORNER_FRACTION, 1.0 - CORNER_FRACTION))[0]
            fractions[across, end] = (found > 0).mean()
    return fractions


def squaring_rotation(outline: Floats, area: float) -> Floats:
    """Return the rotation that aligns the outline of a page with the axes.

    outline: (n, 2) mm, of a page of `area` mm². Returns (2, 2), by at most 45°.
    """
    if not has_straight_sides(outline, area):
        return np.eye(2)
    outline = _without_tips(outline)
    _, _, angle = cv2.minAreaRect(outline.astype(np.float32))
    coarse = _rotation(-np.deg2rad((angle + 45.0) % 90.0 - 45.0))
    return _rotation(-_mean_tilt(outline @ coarse.T)) @ coarse


def page_size(outline: Floats) -> tuple[float, float]:
    """Return width and height of a page, mm.

    They are between the medians of opposite sides.
    outline: (n, 2), axis-aligned.
    """
    outline = _without_tips(outline)
    low, high = outline.min(axis=0), outline.max(axis=0)
    extent = high - low
    for along, across in ((0, 1), (1, 0)):
        band = _band(extent[across])
        inner = np.abs(outline[:, along] - (low + high)[along] / 2) < (0.5 - CORNER_FRACTION) * (high - low)[along]
        sides = [
            outline[inner & (np.abs(outline[:, across] - side) < band), across] for side in (low[across], high[across])
        ]
        if min(map(len, sides)) >= 3:
            extent[across] = np.median(sides[1]) - np.median(sides[0])
    return float(extent[0]), float(extent[1])


def _without_tips(outline: Floats) -> Floats:
    """Outline points (k, 2) mm without the few of (n, 2) that stick out of a side."""
    kept = outline
    for _ in range(TRIMS):
        _, _, angle = cv2.minAreaRect(kept.astype(np.float32))
        turned = kept @ _rotation(-np.deg2rad(angle)).T
        low, high = np.quantile(turned, [TIP_FRACTION, 1.0 - TIP_FRACTION], axis=0)
        kept = kept[((turned > low - SIDE_BAND_MM) & (turned < high + SIDE_BAND_MM)).all(axis=1)]
        if len(kept) < (1.0 - TIP_FRACTION) * len(outline):
            return outline
    return kept


def _band(extent: float) -> float:
    """Return the distance from a side within which points belong to it, mm.

    On a narrow page the points of the other side are near.
    """
    return min(SIDE_BAND_MM, extent / 4)


def _rotation(angle: float) -> Floats:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _mean_tilt(outline: Floats) -> float:
    """Return the mean angle of the four sides with the axes, radians.

    Each side is weighted by its number of points.
    """
    low, high = outline.min(axis=0), outline.max(axis=0)
    tilts, weights = [0.0], [1e-9]
    for along, across in ((0, 1), (1, 0)):
        margin, band = CORNER_FRACTION * (high - low)[along], _band((high - low)[across])
        middle = (outline[:, along] > low[along] + margin) & (outline[:, along] < high[along] - margin)
        for side in (low[across], high[across]):
            near = outline[middle & (np.abs(outline[:, across] - side) < band)]
            if len(near) >= 3 and np.ptp(near[:, along]) > band:  # of a shorter row the slope is not determined
                slope = np.polyfit(near[:, along], near[:, across], 1)[0]
                tilts.append(slope if along == 0 else -slope)
                weights.append(float(len(near)))
    return float(np.arctan(np.average(tilts, weights=weights)))
