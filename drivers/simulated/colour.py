"""The colour exposure of a simulated Vivid: 640×480 pixels through the same lens, by room light.

Areas are averaged in codes, not in light. What the scanner's tone curve and edge enhancement do to an edge of ink is
not published; this way an edge lies where the picture passes half-way from paper to ink, as in most cameras' pictures.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from drivers.simulated.albedo import colour_codes, linear, srgb
from drivers.simulated.facemaps import FaceMaps
from drivers.simulated.optics import LENS_CENTRE
from drivers.simulated.raycast import RayCaster
from drivers.simulated.scene import Scene
from drivers.vivid900.calibration import Calibration
from drivers.vivid900.lenses import TEXTURE_COLS, TEXTURE_ROWS
from drivers.vivid900.triangulation import tangents
from restore.scan import Bytes

# Rays across and down a pixel; the print is averaged over the share of each ray as well.
SUBSAMPLES = 3
BLUR_PX = 0.35  # standard deviation of the lens's blur: with the pixel's own area, edges rise within about one pixel
NOISE_CODES = 1.5  # standard deviation of the sensor's noise in 8-bit codes
VOID = 29.0  # code of what lies beyond the table: an unlit room
# From the upper left, the usual side for a desk lamp.
LAMP = np.array([-0.5, 0.45, 0.75]) / np.linalg.norm([-0.5, 0.45, 0.75])
AMBIENT = 0.45  # share of the light that comes from all sides
EXPOSURE = 0.90  # white paper facing the scanner comes out at code 226, below clipping where it faces the lamp


def photograph(
    scene: Scene, caster: RayCaster, maps: FaceMaps, body: Calibration, rng: np.random.Generator, *, noise: bool = True
) -> Bytes:
    """(480, 640, 3) uint8 RGB: every pixel the mean over its area, then the lens's blur and the sensor's noise."""
    import cv2

    rays = _rays(body)
    face, depth = caster.first_hit(LENS_CENTRE, rays)
    seen = face >= 0
    face = face[seen]
    uv = maps.page(face, rays[seen] * depth[seen][:, None])
    paint = np.full((*seen.shape, 4), (VOID, VOID, VOID, EXPOSURE), np.float32)
    if len(face):
        footprint = float(np.median(depth[seen])) / body.focal_px / SUBSAMPLES
        paint[seen, :3] = colour_codes(scene, footprint)(face, uv)
        paint[seen, 3] = EXPOSURE * _shading(maps)[face]
    paint = cv2.resize(paint, (TEXTURE_COLS, TEXTURE_ROWS), interpolation=cv2.INTER_AREA)
    if noise:
        paint = cv2.GaussianBlur(paint, (0, 0), BLUR_PX)
    codes = srgb(linear(paint[..., :3]) * paint[..., 3:])
    if noise:
        codes = codes + rng.normal(0, NOISE_CODES, codes.shape).astype(np.float32)
    return np.clip(np.rint(codes), 0, 255).astype(np.uint8)


@lru_cache(maxsize=1)  # 33 MB, and shot after shot is taken through the same lens
def _rays(body: Calibration) -> NDArray[np.float32]:
    """(480·k, 640·k, 3) directions, k = SUBSAMPLES to a pixel's side."""
    row, col = np.mgrid[: TEXTURE_ROWS * SUBSAMPLES, : TEXTURE_COLS * SUBSAMPLES]
    sight = tangents(body, (np.stack([col, row], axis=-1) + 0.5) / SUBSAMPLES - 0.5)
    return np.concatenate([sight, np.full((*sight.shape[:2], 1), -1.0)], axis=-1).astype(np.float32)


def _shading(maps: FaceMaps) -> NDArray[np.float32]:
    """(m,) float32 light on each face; 1 where it faces the scanner squarely."""
    lamp = np.clip(LAMP @ maps.normals, 0, None) / LAMP[2]
    return (AMBIENT + (1 - AMBIENT) * lamp).astype(np.float32)
