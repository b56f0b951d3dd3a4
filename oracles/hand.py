"""Scans of pages that need a hand: a finger on the page, a torn corner; and what a hand draws on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from drivers.simulated import Truth
from oracles.layout import grid_positions
from restore import RangeScan
from restore.numerics.polygons import inside_polygon
from restore.scan import Floats, Mask

Random = np.random.Generator

STEP_MM = 20.0  # between two points that are drawn along an edge
PER_MM = 20  # of the canvas on which areas are counted: to a twentieth of a millimetre
FINGER_MM, HEIGHT_MM = 8.0, 12.0  # half the width of a finger, and how far it stands above the page
SKIN = (205.0, 160.0, 135.0)
RAGGED_MM = 1.5  # of a tear


@dataclass(frozen=True, eq=False)
class Drawing:
    """A polygon on the sheet. uv: (n, 2) mm from its lower left corner; px: (n, 2) of the colour image."""

    uv: Floats
    px: Floats

    @property
    def polygon(self) -> tuple[tuple[float, float], ...]:
        """Its points as corrections have them."""
        return tuple((float(x), float(y)) for x, y in self.px)

    def on_paper_mm2(self, page_mm: Sequence[float], within: Floats | None = None) -> float:
        """Return the area of the sheet within it; within a second polygon (k, 2) mm, too, where one is given."""
        canvas = np.zeros((round(page_mm[1] * PER_MM), round(page_mm[0] * PER_MM)), np.uint8)
        cv2.fillPoly(canvas, [np.rint(self.uv * PER_MM - 0.5).astype(np.int32)], 1)
        if within is not None:
            other = np.zeros_like(canvas)
            cv2.fillPoly(other, [np.rint(within * PER_MM - 0.5).astype(np.int32)], 1)
            canvas &= other
        return float(np.count_nonzero(canvas)) / PER_MM**2


def draw(scan: RangeScan, truth: Truth, uv: Floats, random: Random, off_mm: float) -> Drawing:
    """Draw a polygon (n, 2) mm on the sheet with a hand that is off by `off_mm` at most, across and along."""
    uv = uv + random.uniform(-off_mm, off_mm, uv.shape)
    return Drawing(uv, _picture_of(scan, truth)(uv))


def outline_uv(page_mm: Sequence[float], corner: Floats | None = None) -> Floats:
    """(n, 2) mm: points along the edges of a sheet; with a torn corner (k, 2), along the tear from edge to edge."""
    ends = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * np.asarray(page_mm)
    sides = []
    for start, end in zip(ends, np.roll(ends, -1, axis=0), strict=True):
        count = int(np.ceil(np.linalg.norm(end - start) / STEP_MM))
        sides.append(start + (end - start) * np.arange(count)[:, None] / count)
    points = np.concatenate(sides)
    if corner is None:
        return points
    low, high = corner.min(axis=0), corner.max(axis=0)
    torn = ((points >= low - 1e-9) & (points <= high + 1e-9)).all(axis=1)
    last = int(np.flatnonzero(torn)[-1]) + 1  # the rest follows on it, counter-clockwise
    return np.concatenate([corner[::-1], np.roll(points, -last, axis=0)[~np.roll(torn, -last)]])


def lay_finger(scan: RangeScan, truth: Truth, random: Random) -> tuple[RangeScan, Floats]:
    """Return the scan with a finger over the lower edge, and its outline (n, 2) mm on the sheet."""
    x = random.uniform(0.25, 0.75) * truth.page_mm[0]
    foot, tip = np.array([x, -25.0]), np.array([x + random.uniform(-10, 10), random.uniform(18, 30)])
    angle = np.arctan2(*(tip - foot)[::-1]) + np.linspace(np.pi / 2, -np.pi / 2, 9)
    ends = FINGER_MM * np.column_stack([np.cos(angle), np.sin(angle)])
    outline = np.concatenate([foot + ends[:1], tip + ends, foot + ends[-1:]])
    to_picture = _picture_of(scan, truth)
    spine, edge = to_picture(np.stack([foot, tip])), to_picture(tip + ends[:1])
    radius = float(np.linalg.norm(edge - to_picture(tip[None])))
    away = _distance(scan.texture_xy, *spine) / radius
    height = HEIGHT_MM * np.sqrt(np.clip(1 - away**2, 0, None))
    depth = -scan.points[..., 2]
    points = scan.points * ((depth - np.where(away < 1, height, 0.0)) / depth)[..., None]
    assert scan.texture is not None
    pixels = np.stack(np.meshgrid(*map(np.arange, scan.texture.shape[1::-1])), axis=-1).astype(float)
    over = _distance(pixels, *spine) / radius
    skin = np.array(SKIN) * (0.6 + 0.4 * np.sqrt(np.clip(1 - over**2, 0, None)))[..., None]
    texture = np.where((over < 1)[..., None], skin, scan.texture).astype(np.uint8)
    return replace(scan, points=points, texture=texture), outline


def tear_corner(scan: RangeScan, truth: Truth, random: Random) -> tuple[RangeScan, Floats]:
    """Return the scan without its upper right corner, where the table is seen, and the tear (n, 2) mm, downwards."""
    page, legs = np.asarray(truth.page_mm), random.uniform(45, 70, 2)
    at = np.linspace(0, 1, 5)[:, None]
    tear = page - [legs[0], 0.0] + at * [legs[0], -legs[1]]
    tear[1:-1] += random.uniform(-RAGGED_MM, RAGGED_MM, (3, 2))
    torn = np.concatenate([tear[::-1], page[None] + 5.0 * np.array([[0, 1], [1, 1], [1, 0]])[[0, 1, 2]]])
    polygon = _picture_of(scan, truth)(torn)
    samples = inside_polygon(scan.texture_xy, polygon)
    table = scan.measured & ~np.isfinite(truth.flat[..., 0])
    design = np.column_stack([scan.points[table][:, :2], np.ones(table.sum())])
    a, b, c = np.linalg.lstsq(design, scan.points[table][:, 2])[0]
    rays = truth.points / truth.points[..., 2:]
    depth = c / (1 - a * rays[..., 0] - b * rays[..., 1])
    points = np.where(samples[..., None], rays * depth[..., None], scan.points)
    assert scan.texture is not None
    pixels = np.stack(np.meshgrid(*map(np.arange, scan.texture.shape[1::-1])), axis=-1).astype(float)
    dark = np.median(scan.texture[~_page_pixels(scan, truth)], axis=0)
    texture = np.where(inside_polygon(pixels, polygon)[..., None], dark, scan.texture).astype(np.uint8)
    return replace(scan, points=points, texture=texture), tear


def _picture_of(scan: RangeScan, truth: Truth) -> Callable[[Floats], Floats]:
    """(n, 2) mm on the sheet → (n, 2) pixels of the colour image, through a lens without distortion."""
    known = np.isfinite(truth.points[..., 2])
    rays = truth.points[known][:, :2] / truth.points[known][:, 2:]
    design = np.column_stack([rays, np.ones(len(rays))])
    to_picture, *_ = np.linalg.lstsq(design, scan.texture_xy[known])

    def picture_of(uv: Floats) -> Floats:
        space = truth.surface(uv)
        return np.column_stack([space[:, :2] / space[:, 2:], np.ones(len(space))]) @ to_picture

    return picture_of


def _distance(places: Floats, start: Floats, end: Floats) -> Floats:
    """(…): distance of places (…, 2) from the line between two points."""
    along = end - start
    at = np.clip((places - start) @ along / (along @ along), 0.0, 1.0)
    return np.asarray(np.linalg.norm(places - start - at[..., None] * along, axis=-1))


def _page_pixels(scan: RangeScan, truth: Truth) -> Mask:
    """(h, w) of the colour image: the pixels that show the page."""
    assert scan.texture is not None
    pixels = np.stack(np.meshgrid(*map(np.arange, scan.texture.shape[1::-1])), axis=-1).reshape(-1, 2)
    rows, cols = np.rint(grid_positions(pixels.astype(float), scan)).astype(int)
    inside = (rows >= 0) & (rows < scan.points.shape[0]) & (cols >= 0) & (cols < scan.points.shape[1])
    page = np.zeros(len(pixels), bool)
    page[inside] = np.isfinite(truth.flat[rows[inside], cols[inside], 0])
    return page.reshape(scan.texture.shape[:2])
