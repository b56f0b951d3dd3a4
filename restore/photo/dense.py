"""Refines a camera on the whole surface, by dense shifts.

The photograph is projected over surface and camera into the scanner's view, as a prediction of the scanner's image.
Where both show texture, the shift between them is measured (Lucas & Kanade 1981) and determines which surface point
really belongs to the photograph's pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from restore.camera.photo_camera import PhotoCamera
from restore.numerics.srgb import CONTRAST_PX
from restore.photo.reference import Reference
from restore.scan import Bytes, Floats, Ints, Mask

GRID = 10  # reference pixels from one measured place to the next: 2,500 places on a page that fills the picture
WINDOW = 31  # reference pixels: two lines of text, so that a patch is unlike its neighbours
FLOOR = 3.0  # grey levels of contrast that count as noise
GAIN = 42.0  # of a contrast of one standard deviation, in the codes of a compared picture: three fit on either side
COARSE_LEVELS = 2  # of the pyramid: shifts of up to 30 reference pixels are found, but also the next line of text
MIN_TEXTURE = 2e-3  # smaller eigenvalue of the structure tensor, as calcOpticalFlowPyrLK normalises it
ALIKE = 0.6  # correlation of patches that show the same
SPARED = 4  # every fourth reference pixel suffices for the scale
ROOM = 0.9  # of reference pixels, to the photograph's: it is shrunk to this before it is sampled


@dataclass(frozen=True, eq=False)
class Shifts:
    """Shifts measured at places on the page.

    places: (n, 2), whole reference pixels with texture, on the part of the page that the photograph shows.
    moved: (n, 2), where in the reference the prediction for a place is.
    alike: (n,), True where the patches there show the same print.
    pixels: (n, 2), the photograph's pixels that were predicted at the places.
    coverage: fraction of the page that the photograph shows.
    scale: the photograph's pixels to one of the reference.
    """

    places: Ints
    moved: Floats
    alike: Mask
    pixels: Floats
    coverage: float
    scale: float


def measure(reference: Reference, photograph: Bytes, camera: PhotoCamera, *, near: bool = False) -> Shifts:
    """Measure the shifts between the reference and a photograph.

    photograph: (h, w) uint8; it may be a smaller copy of what the camera took: all pixels are those of the camera.
    near: the camera is right to a pixel of the reference or two.
    """
    predicted, seen, where = predict(reference, photograph, camera)
    ours, theirs = contrast(reference.grey, seen), contrast(predicted, seen)
    places = _textured(theirs, _places(seen))
    moved, alike = np.empty((0, 2)), np.empty(0, bool)
    if len(places):
        start = places.astype(np.float32).reshape(-1, 1, 2)
        levels = 0 if near else COARSE_LEVELS
        ends, found, _ = cv2.calcOpticalFlowPyrLK(theirs, ours, start, None, winSize=(WINDOW, WINDOW), maxLevel=levels)
        moved = ends.reshape(-1, 2).astype(float)
        alike = (found.ravel() > 0) & (_correlation(theirs, ours, places, moved) > ALIKE)
    coverage = float(seen.sum() / max(reference.page.sum(), 1))
    return Shifts(places, moved, alike, where[places[:, 1], places[:, 0]], coverage, _scale(where, seen))


def predict(reference: Reference, photograph: Bytes, camera: PhotoCamera) -> tuple[Bytes, Mask, Floats]:
    """Return a photograph (h, w) as the scanner would have seen it.

    Returns the image, where it shows the page, and its pixels.
    """
    width, height = camera.size
    where = camera.project(reference.points.reshape(-1, 3).astype(np.float64)).reshape(*reference.page.shape, 2)
    seen = np.asarray(((where >= 0) & (where <= [width - 1, height - 1])).all(axis=2))
    small = min(photograph.shape[1] / width, 1.0 / (ROOM * _scale(where, seen)))
    size = (max(round(width * small), 1), max(round(height * small), 1))
    shrunk = cv2.resize(photograph, size, interpolation=cv2.INTER_AREA)
    ratio = np.array(shrunk.shape[::-1]) / [width, height]
    at = np.where(seen[..., None], (where + 0.5) * ratio - 0.5, -1).astype(np.float32)
    return cv2.remap(shrunk, at, None, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE), seen, where


def _scale(where: Floats, seen: Mask) -> float:
    """The photograph's pixels to a reference pixel, median over the page."""
    steps = np.linalg.norm(where[::SPARED, 1::SPARED] - where[::SPARED, :-1:SPARED], axis=2)
    both = seen[::SPARED, 1::SPARED] & seen[::SPARED, :-1:SPARED]
    return float(np.median(steps[both])) if both.any() else 1.0


def contrast(grey: Bytes, mask: Mask) -> Bytes:
    """Return a picture (h, w) without its light and shade.

    128 is the local mean, GAIN a local standard deviation.
    """
    inside = mask.astype(np.float32)
    weight = np.maximum(cv2.GaussianBlur(inside, (0, 0), CONTRAST_PX), 1e-3)
    value = np.where(mask, grey, 0).astype(np.float32)
    flat = (value - cv2.GaussianBlur(value, (0, 0), CONTRAST_PX) / weight) * inside
    deviation = np.sqrt(cv2.GaussianBlur(flat * flat, (0, 0), CONTRAST_PX) / weight + FLOOR**2)
    return np.clip(128 + GAIN * flat / deviation, 0, 255).astype(np.uint8)


def _places(seen: Mask) -> Ints:
    """Return the grid points (n, 2), x and y, with enough page round them.

    At least half a window shows the page.
    """
    half = WINDOW // 2
    inner = cv2.erode(seen.astype(np.uint8), np.ones((half, half), np.uint8), borderValue=0)
    rows, cols = np.nonzero(inner[GRID // 2 :: GRID, GRID // 2 :: GRID])
    return np.stack([cols, rows], axis=1) * GRID + GRID // 2


def _textured(picture: Bytes, places: Ints) -> Ints:
    """Return the places (n, 2) where a picture changes in both directions.

    A shift shows only there.
    """
    corner = cv2.cornerMinEigenVal(picture, WINDOW)
    return places[corner[places[:, 1], places[:, 0]] > MIN_TEXTURE]


def _correlation(one: Bytes, other: Bytes, places: Ints, moved: Floats) -> Floats:
    """Return the correlation (n,) of windows round places of two pictures.

    places: (n, 2), in one picture.
    moved: (n, 2), in the other.
    """
    reach = np.arange(WINDOW, dtype=np.float32) - WINDOW // 2
    offsets = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(1, -1, 2)

    def windows(picture: Bytes, at: Floats | Ints) -> Floats:
        where = at[:, None].astype(np.float32) + offsets
        values = cv2.remap(picture, where, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).astype(np.float32)
        values -= values.mean(axis=1, keepdims=True)
        return np.asarray(values / np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-6))

    return np.asarray((windows(one, places) * windows(other, moved)).sum(axis=1))
