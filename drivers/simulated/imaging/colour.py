"""The colour exposure: 640×480 pixels through the same lens, by room light.

Areas are averaged in codes, not in light. What the scanner's tone curve and edge enhancement do to an edge of ink is
not published; this way an edge lies where the image passes half-way from paper to ink, as in most cameras' images.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.illumination import irradiance, lamp_visibility, sky_view_factor
from drivers.simulated.imaging.optics import LENS_CENTRE
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.scene.albedo import colour_codes, linear, srgb
from drivers.simulated.scene.scene import Scene
from drivers.vivid900.geometry.calibration import Calibration
from drivers.vivid900.geometry.triangulation import tangents
from restore.scan import Bytes, Floats, Ints, Mask
from restore.vivid import TEXTURE_COLS, TEXTURE_ROWS

# Rays across and down a pixel; the print is averaged over the area of each ray as well.
SUBSAMPLES = 3
BLUR_PX = 0.35  # standard deviation of the lens's blur: with the pixel's own area, edges rise within about one pixel
NOISE_CODES = 1.5  # standard deviation of the sensor's noise in 8-bit codes
ROOM_STEP = 4  # pixels: the sky view factor varies slowly, and costs 64 rays a sample
_INK, _LIGHT = slice(0, 3), slice(3, 6)  # channels of what a ray sees
VOID = 29.0  # code beyond the table: an unlit room
EXPOSURE = 0.90  # white paper facing the scanner comes out at code 226, below clipping where it faces the lamp


def photograph(
    scene: Scene,
    caster: RayCaster,
    maps: FaceMaps,
    body: Calibration,
    rng: np.random.Generator,
    *,
    noise: bool = True,
    shaded: bool = True,
    noise_codes: float = NOISE_CODES,
    blur_px: float = BLUR_PX,
) -> Bytes:
    """Return a photograph of the scene, (480, 640, 3) uint8 RGB.

    Every pixel is the mean over its area, then come the lens's blur and the sensor's noise.
    noise: False for an image without blur or noise.
    shaded: False for the same light everywhere, that on paper which faces the scanner in the image's centre.
    noise_codes: standard deviation of the sensor's noise.
    """
    import cv2

    rays = _rays(body)
    face, depth = caster.first_hit(LENS_CENTRE, rays)
    seen = face >= 0
    face = face[seen]
    points = rays[seen] * depth[seen][:, None]
    paint = np.full((*seen.shape, 6), (VOID, VOID, VOID, EXPOSURE, EXPOSURE, EXPOSURE), np.float32)
    if len(face):
        footprint = float(np.median(depth[seen])) / body.focal_px / SUBSAMPLES
        paint[seen, :3] = colour_codes(scene, footprint)(face, maps.page(face, points))
        light = _light(scene, caster, maps, seen, face, points) if shaded else scene.light.level
        paint[seen, 3:] = EXPOSURE * light
    # cv2 shrinks no more than four channels at once
    size = (TEXTURE_COLS, TEXTURE_ROWS)
    codes, light = (cv2.resize(paint[..., part], size, interpolation=cv2.INTER_AREA) for part in (_INK, _LIGHT))
    if noise:
        codes, light = (cv2.GaussianBlur(field, (0, 0), blur_px) for field in (codes, light))
    codes = srgb(linear(codes) * light)
    if noise:
        codes = codes + rng.normal(0, noise_codes, codes.shape).astype(np.float32)
    return np.clip(np.rint(codes), 0, 255).astype(np.uint8)


@lru_cache(maxsize=1)  # 33 MB, and shot after shot is taken through the same lens
def _rays(body: Calibration) -> NDArray[np.float32]:
    """Return directions (480·k, 640·k, 3), k = SUBSAMPLES to a pixel's side."""
    row, col = np.mgrid[: TEXTURE_ROWS * SUBSAMPLES, : TEXTURE_COLS * SUBSAMPLES]
    sight = tangents(body, (np.stack([col, row], axis=-1) + 0.5) / SUBSAMPLES - 0.5)
    return np.concatenate([sight, np.full((*sight.shape[:2], 1), -1.0)], axis=-1).astype(np.float32)


def _light(
    scene: Scene, caster: RayCaster, maps: FaceMaps, seen: Mask, face: Ints, points: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return the light (n, 3) on points that rays have seen; facing paper has 1.

    seen: (h, w).
    face: (n,), of the points (n, 3).
    """
    depth_mm = -float(scene.surface.shift[2])
    fields = irradiance(scene.light, maps, face, points.astype(float), depth_mm)
    if scene.light.shadows:
        room = partial(sky_view_factor, caster)
        lamps = (partial(lamp_visibility, lamp, caster) for lamp in scene.light.lamps)
        parts = [_at_pixels(room, maps, seen, face, points, ROOM_STEP)]
        parts += [_at_pixels(lamp, maps, seen, face, points, 1) for lamp in lamps]
        fields = [field * part[seen][:, None] for field, part in zip(fields, parts, strict=True)]
    return np.asarray(sum(fields))


def _at_pixels(
    fraction_of: Callable[[Floats, Floats], Floats],
    maps: FaceMaps,
    seen: Mask,
    face: Ints,
    points: NDArray[np.float32],
    step: int,
) -> NDArray[np.float32]:
    """Return fraction_of(normals, points) spread over the rays (h, w).

    It is evaluated in the centre of every step-th pixel.
    """
    import cv2

    spacing = SUBSAMPLES * step
    middle = (slice(spacing // 2, None, spacing),) * 2
    number = np.full(seen.shape, -1)
    number[seen] = np.arange(len(face))
    kept = number[middle][seen[middle]]
    there = points[kept].astype(float)
    field = np.ones(seen[middle].shape, np.float32)
    field[seen[middle]] = fraction_of(maps.facing(face[kept], there), there)
    return np.asarray(cv2.resize(field, seen.shape[::-1], interpolation=cv2.INTER_LINEAR))
