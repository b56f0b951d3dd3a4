"""Visibility of the page from a camera: occlusion, grazing view, specular glare."""

from __future__ import annotations

from math import ceil

import cv2
import numpy as np

from restore.camera.photo_camera import PhotoCamera
from restore.mesh.raster import rasterise
from restore.numerics.limits import SINGLE_TINY
from restore.numerics.srgb import CLIPPED
from restore.photo.coarse import blurred_widely
from restore.scan import Bytes, Floats, Ints, Mask

BUFFER_SIDE = 1200  # pixels of the depth buffer's longer side: a quarter of a millimetre on a page that fills it
OCCLUSION_MM = 1.0  # what lies this much behind the nearest surface is hidden; one pixel on a wall of 70° is less
MIN_FACING = 0.2  # cosine of 78°: seen flatter than that, print cannot be read
GLARE_FRACTION = 0.3  # of the pixels of a spot
GLARE_GAIN = 1.25  # of the spot's light over that of its surroundings, against what the scanner saw
# On dark ink a glare need not fill the sensor: no slope is lit three times as much as its surroundings, and light
# that little does not make black blacker.
INK_GAIN, INK_LIGHT = 3.0, 0.05
HAZE_GAIN = 1.1  # of the haze round it, which is not full


def visible_points(camera: PhotoCamera, vertices: Floats, faces: Ints, points: Floats, normals: Floats) -> Mask:
    """Return which points a camera sees on a mesh.

    points, normals: (n, 3) mm and (n, 3).
    faces: (m, 3).
    Returns (n,) bool.
    """
    small = camera.scaled(_fitted(camera.size))
    corners = np.nan_to_num(small.project(vertices), nan=-1e6)
    inverse_depth = small.inverse_depth(vertices)
    width, height = small.size
    nearest = np.nan_to_num(rasterise(corners, faces, inverse_depth[:, None], height, width, inverse_depth)[..., 0])
    pixels = small.project(points)
    inside = np.asarray(((pixels >= 0) & (pixels <= np.array(small.size) - 1)).all(axis=1))
    cols, rows = np.rint(np.where(inside[:, None], pixels, 0)).astype(int).T
    behind = 1.0 / camera.inverse_depth(points) - 1.0 / np.maximum(nearest[rows, cols], SINGLE_TINY)
    ways = camera.position - points
    facing = (ways * normals).sum(axis=1) / np.linalg.norm(ways, axis=1)
    return np.asarray(inside & (behind < OCCLUSION_MM) & (facing > MIN_FACING))


def _fitted(size: tuple[int, int]) -> tuple[int, int]:
    ratio = min(1.0, BUFFER_SIDE / max(size))
    return ceil(size[0] * ratio), ceil(size[1] * ratio)


def glare_mask(clipped: Floats, light: Floats, expected: Floats, seen: Mask, reach: float) -> Mask:
    """Return where the light of a lamp is mirrored, (h, w) bool.

    clipped: (h, w), fraction of full pixels.
    light, expected: (h, w), what the photograph and the scanner saw, linear.
    seen: (h, w), where both did.
    reach: pixels that the surroundings extend.
    """
    gain = np.where(seen, light / np.maximum(expected, SINGLE_TINY), 0.0)
    unclipped = (seen & (clipped < GLARE_FRACTION)).astype(float)
    total = blurred_widely(unclipped, reach)
    # Twice: the haze round a glare is not part of the usual light.
    for _ in range(2):
        usual = blurred_widely(gain * unclipped, reach) / np.maximum(total, SINGLE_TINY)
        unclipped = unclipped * (gain < HAZE_GAIN * usual)
        total = blurred_widely(unclipped, reach)
    haze = seen & (gain > HAZE_GAIN * usual)
    core = seen & (clipped >= GLARE_FRACTION) & (gain > GLARE_GAIN * usual)
    # A stroke of ink is lighter by the paper next to it in the less sharp of two pictures: no lamp does that.
    nearby = cv2.dilate(expected, np.ones((3, 3), np.uint8))
    core |= seen & (gain > INK_GAIN * usual) & (light - usual * nearby > INK_LIGHT)
    # Haze ends near its glare; what is bright farther off is another light on another slope.
    haze &= cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 3) < reach / 2
    _, pieces = cv2.connectedComponents(haze.astype(np.uint8), connectivity=8)
    return np.asarray(haze & np.isin(pieces, np.unique(pieces[core])))


def clipped_fraction(image: Bytes, size: tuple[int, int]) -> Floats:
    """Return the fraction of clipped pixels at a smaller size (w, h).

    A pixel is clipped where every channel is full.
    image: (H, W, 3).
    Returns (h, w).
    """
    full = cv2.inRange(image, (CLIPPED,) * 3, (255,) * 3)
    return np.asarray(cv2.resize(full, size, interpolation=cv2.INTER_AREA).astype(np.float64) / 255.0)
