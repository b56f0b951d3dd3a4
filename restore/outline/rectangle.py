"""Put a rectangular page square to the picture."""

from __future__ import annotations

import cv2
import numpy as np

from restore.scan import Floats

RECTANGLE = 0.95  # of its bounding rectangle: a page that fills less is torn or no rectangle and stays as it lies
NEAR_SIDE_MM = 2.0  # outline points this near belong to the side
CORNER_SHARE = 0.05  # of a side at either end is left out: dog-ears and rounding live there


def fills_rectangle(outline: Floats, area: float) -> bool:
    """Whether a page of `area` mm² with outline (n, 2) mm is a rectangle but for rough sides and dog-ears."""
    _, (width, height), _ = cv2.minAreaRect(outline.astype(np.float32))
    return bool(area >= RECTANGLE * width * height)


def square_up(outline: Floats, area: float) -> Floats:
    """(2, 2) rotation that turns the outline (n, 2) mm of a page of `area` mm² by less than 45° to lie square."""
    if not fills_rectangle(outline, area):
        return np.eye(2)
    _, _, angle = cv2.minAreaRect(outline.astype(np.float32))
    rough = _turn(-np.deg2rad((angle + 45.0) % 90.0 - 45.0))
    return _turn(-_tilt(outline @ rough.T)) @ rough


def page_size(outline: Floats) -> tuple[float, float]:
    """Width and height in mm of a page with outline (n, 2) that lies square: between the medians of opposite sides."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    extent = high - low
    for along, across in ((0, 1), (1, 0)):
        inner = np.abs(outline[:, along] - (low + high)[along] / 2) < (0.5 - CORNER_SHARE) * (high - low)[along]
        sides = [
            outline[inner & (np.abs(outline[:, across] - side) < NEAR_SIDE_MM), across]
            for side in (low[across], high[across])
        ]
        if min(map(len, sides)) >= 3:
            extent[across] = np.median(sides[1]) - np.median(sides[0])
    return float(extent[0]), float(extent[1])


def _turn(angle: float) -> Floats:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _tilt(outline: Floats) -> float:
    """How far the four sides still lean, in radians, each side weighted by its points."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    leans, weights = [0.0], [1e-9]
    for along, across in ((0, 1), (1, 0)):
        margin = CORNER_SHARE * (high - low)[along]
        middle = (outline[:, along] > low[along] + margin) & (outline[:, along] < high[along] - margin)
        for side in (low[across], high[across]):
            near = outline[middle & (np.abs(outline[:, across] - side) < NEAR_SIDE_MM)]
            if len(near) >= 3:
                slope = np.polyfit(near[:, along], near[:, across], 1)[0]
                leans.append(slope if along == 0 else -slope)
                weights.append(float(len(near)))
    return float(np.arctan(np.average(leans, weights=weights)))
