"""Things between a page and its camera, drawn into a photograph: hand, finger, pen, glare, another page; blur.

Each drawing returns the photograph and where it no longer shows the page. All light is linear; sizes are in pixels of
the photograph, from its pixels per millimetre of paper. They are drawn from a generator: no two are alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from drivers.simulated import Text
from drivers.simulated.imaging.shot import printed
from restore.scan import Bytes, Floats, Mask

SKIN = ((0.60, 0.40, 0.30), (0.50, 0.31, 0.22), (0.36, 0.20, 0.13), (0.22, 0.12, 0.075), (0.10, 0.058, 0.04))
BARRELS = ((0.02, 0.02, 0.025), (0.03, 0.06, 0.35), (0.45, 0.03, 0.03), (0.75, 0.75, 0.72), (0.6, 0.5, 0.05))
SLEEVES = ((0.04, 0.05, 0.09), (0.35, 0.36, 0.38), (0.08, 0.20, 0.10), (0.5, 0.1, 0.1))
CONTACT_SHADOW = 0.45  # of the light that is left beside what lies on the page
SHEET_MM = (148.0, 105.0)  # of the other page: A6 lies on A4
HAZE_LEFT = 0.5  # of the contrast: with less the spot counts as glare


@dataclass(frozen=True, eq=False)
class Covered:
    """image (h, w, 3) uint8, and where it does not show the page: hidden (h, w)."""

    image: Bytes
    hidden: Mask


@dataclass(frozen=True, eq=False)
class Shot:
    """A photograph (h, w, 3) uint8, the page's outline in it (n, 2) pixels, and its pixels per millimetre."""

    image: Bytes
    outline: Floats
    per_mm: float


Draw = Callable[[Shot, np.random.Generator], Covered]


def hand(shot: Shot, rng: np.random.Generator) -> Covered:
    """A hand that reaches over the page from one side, with its sleeve."""
    point, way = _reach(shot, rng, rng.uniform(60.0, 110.0))
    across = np.array([-way[1], way[0]])
    mm = shot.per_mm
    palm = point - way * 85 * mm
    fingers = [
        _capsule(shot, palm + across * offset * mm, point + across * offset * spread * mm - way * short * mm, 8.0)
        for offset, short, spread in zip((-30, -10, 10, 30), (14, 2, 0, 12), rng.uniform(1.0, 1.35, 4), strict=True)
    ]
    thumb = _capsule(shot, palm - way * 25 * mm, palm + (across * 65 + way * rng.uniform(-5, 25)) * mm, 10.0)
    skin = np.maximum.reduce([*fingers, thumb, _capsule(shot, palm - way * 20 * mm, palm, 40.0)])
    arm = _capsule(shot, palm - way * 320 * mm, palm - way * 65 * mm, 42.0)
    image = _laid_over(shot, arm, SLEEVES[rng.integers(len(SLEEVES))], rng)
    return _merged(_laid_over(Shot(image.image, shot.outline, mm), skin, SKIN[rng.integers(len(SKIN))], rng), image)


def finger(shot: Shot, rng: np.random.Generator) -> Covered:
    """A finger that holds the page at its edge."""
    point, way = _reach(shot, rng, rng.uniform(18.0, 45.0))
    body = _capsule(shot, point - way * 140 * shot.per_mm, point, rng.uniform(7.5, 10.0))
    return _laid_over(shot, body, SKIN[rng.integers(len(SKIN))], rng)


def pen(shot: Shot, rng: np.random.Generator) -> Covered:
    """A pen that lies anywhere on the page."""
    middle = _inside(shot, rng)
    angle = rng.uniform(0, np.pi)
    half = np.array([np.cos(angle), np.sin(angle)]) * 70 * shot.per_mm
    body = _capsule(shot, middle - half, middle + half, rng.uniform(3.5, 6.0))
    return _laid_over(shot, body, BARRELS[rng.integers(len(BARRELS))], rng)


def glare(shot: Shot, rng: np.random.Generator) -> Covered:
    """A lamp mirrored in the paper: full in its middle, haze round it."""
    middle, light = _inside(shot, rng), _linear(shot.image)
    y, x = np.mgrid[: light.shape[0], : light.shape[1]].astype(np.float32)
    angle = rng.uniform(0, np.pi)
    turned = (
        (x - middle[0]) * np.cos(angle) + (y - middle[1]) * np.sin(angle),
        (y - middle[1]) * np.cos(angle) - (x - middle[0]) * np.sin(angle),
    )
    sides = rng.uniform(8.0, 28.0, 2) * shot.per_mm
    strength = rng.uniform(1.5, 6.0)
    added = strength * np.exp(-((turned[0] / sides[0]) ** 2 + (turned[1] / sides[1]) ** 2))
    usual = float(np.quantile(light[_page(shot)], 0.8))
    # A full sensor shows no print; below that haze takes contrast, and what is left of it is the page still.
    full = usual + added > 1.0 / HAZE_LEFT
    return Covered(_codes(light + added[..., None] * usual), np.asarray(full))


def other_page(shot: Shot, rng: np.random.Generator) -> Covered:
    """Another sheet with print of its own, laid over a part of the page."""
    words = Text(seed=int(rng.integers(1 << 30)))
    picture = printed(words, SHEET_MM).image
    corner, angle = _inside(shot, rng), rng.uniform(0, 2 * np.pi)
    right = np.array([np.cos(angle), np.sin(angle)]) * shot.per_mm
    down = np.array([-right[1], right[0]])
    width, height = SHEET_MM
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]])
    placed = corner + corners @ np.stack([right, down]) + rng.normal(0, 3 * shot.per_mm, (4, 2))
    rows, cols = picture.shape[:2]
    pixels = np.array([[0, 0], [cols, 0], [cols, rows], [0, rows]], np.float32)
    small = cv2.GaussianBlur(picture, (0, 0), max(0.5 * cols / width / shot.per_mm, 0.3))
    matrix = cv2.getPerspectiveTransform(pixels, placed.astype(np.float32))
    size = shot.image.shape[1::-1]
    laid = cv2.warpPerspective(small, matrix, size)
    alpha = cv2.warpPerspective(np.ones(picture.shape[:2], np.float32), matrix, size)
    return _over(shot, alpha, _linear(laid) * _paper(shot), rng)


KINDS: dict[str, Draw] = {"hand": hand, "finger": finger, "pen": pen, "glare": glare, "other page": other_page}


def blurred(shot: Shot, rng: np.random.Generator, sigma_px: float | None = None) -> Bytes:
    """The photograph out of focus, or moved while it was taken, by 2 to 12 pixels."""
    light = _linear(shot.image).astype(np.float32)
    if sigma_px is not None or rng.random() < 0.5:
        return _codes(cv2.GaussianBlur(light, (0, 0), sigma_px or rng.uniform(2.0, 12.0)))
    length, angle = rng.uniform(8.0, 45.0), rng.uniform(0, np.pi)
    side = 2 * int(length / 2 + 1.5) + 1
    kernel = np.zeros((side, side), np.float32)
    way = np.array([np.cos(angle), np.sin(angle)]) * length / 2
    start, end = ((side // 2 + sign * way) * 16 for sign in (-1, 1))
    cv2.line(kernel, start.astype(int).tolist(), end.astype(int).tolist(), 1.0, 1, cv2.LINE_AA, 4)
    return _codes(cv2.filter2D(light, -1, kernel / kernel.sum()))


def _reach(shot: Shot, rng: np.random.Generator, depth_mm: float) -> tuple[Floats, Floats]:
    """A point so deep in the page, and the way in from its outline."""
    start = shot.outline[rng.integers(len(shot.outline))]
    way = shot.outline.mean(axis=0) - start
    way = way / np.linalg.norm(way)
    return start + way * depth_mm * shot.per_mm, way


def _inside(shot: Shot, rng: np.random.Generator) -> Floats:
    """A point on the page."""
    middle = shot.outline.mean(axis=0)
    return np.asarray(middle + (shot.outline[rng.integers(len(shot.outline))] - middle) * rng.uniform(0.0, 0.75))


def _capsule(shot: Shot, start: Floats, end: Floats, radius_mm: float) -> Floats:
    """(h, w) height of a rounded rod over the page as a share of its radius, 0 beside it."""
    y, x = np.mgrid[: shot.image.shape[0], : shot.image.shape[1]].astype(np.float32)
    along = end - start
    share = np.clip(((x - start[0]) * along[0] + (y - start[1]) * along[1]) / max(float(along @ along), 1.0), 0, 1)
    away = np.hypot(x - start[0] - share * along[0], y - start[1] - share * along[1]) / (radius_mm * shot.per_mm)
    return np.asarray(np.sqrt(np.clip(1.0 - away**2, 0.0, 1.0)))


def _laid_over(shot: Shot, height: Floats, colour: tuple[float, float, float], rng: np.random.Generator) -> Covered:
    """The photograph with a rounded thing of a colour in it; height (h, w), 1 at its top."""
    grain = cv2.GaussianBlur(rng.normal(0, 1, height.shape).astype(np.float32), (0, 0), 1.5 * shot.per_mm)
    grain *= 0.08 / max(float(grain.std()), 1e-6)
    shade = (0.35 + 0.65 * height) * (1 + grain)
    return _over(shot, (height > 0).astype(np.float32), shade[..., None] * np.array(colour) * _paper(shot), rng)


def _over(shot: Shot, alpha: Floats, light: Floats, rng: np.random.Generator) -> Covered:
    soft = cv2.GaussianBlur(alpha.astype(np.float32), (0, 0), 0.8)[..., None]
    lean = rng.uniform(-1.5, 1.5, 2) * shot.per_mm
    moved = np.array([[1, 0, lean[0]], [0, 1, lean[1]]], np.float32)
    shadow = cv2.warpAffine(alpha.astype(np.float32), moved, shot.image.shape[1::-1])
    shadow = cv2.GaussianBlur(shadow, (0, 0), 1.2 * shot.per_mm)[..., None] * (1 - CONTACT_SHADOW)
    below = _linear(shot.image) * (1 - shadow)
    noise = rng.normal(0, 1.5, below.shape) * soft
    return Covered(np.clip(_codes(below * (1 - soft) + light * soft) + noise, 0, 255).astype(np.uint8), alpha > 0.5)


def _merged(last: Covered, first: Covered) -> Covered:
    return Covered(last.image, last.hidden | first.hidden)


def _page(shot: Shot) -> Mask:
    mask = np.zeros(shot.image.shape[:2], np.uint8)
    cv2.fillPoly(mask, [cv2.convexHull(shot.outline.astype(np.int32))], 1)
    return mask > 0


def _paper(shot: Shot) -> Floats:
    """(3,) linear light of the photograph's paper."""
    return np.asarray(np.quantile(_linear(shot.image[_page(shot)][::7]), 0.9, axis=0))


def _linear(codes: Bytes) -> Floats:
    share = np.arange(256) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4).astype(np.float32)[codes]


def _codes(light: Floats) -> Bytes:
    light = np.clip(light, 0.0, 1.0)
    codes = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)
    return np.asarray(codes * 255 + 0.5).astype(np.uint8)
