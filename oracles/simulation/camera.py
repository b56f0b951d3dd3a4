"""Photographs of the same scene by a hand-held camera: any pose, other light, a lens with distortion.

Camera coordinates are x right, y down and z forward; pixels (x right, y down), the centre of the upper left one (0, 0).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numba
import numpy as np
from numpy.typing import NDArray

from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.raycast import RayCaster, Vectors
from drivers.simulated.scene.albedo import colour_codes, linear, srgb
from drivers.simulated.scene.scene import Scene
from restore.scan import Bytes, Floats, Ints

STRIP_PIXELS = 1_000_000  # rays are followed so many at a time: 24 million at once would take 3 GB
UNDISTORTIONS = 12  # each gains a digit or more with the distortion of any lens that is not a fisheye
GLOSS_SHARPNESS = 400.0  # exponent of the highlight (Blinn 1977): 4° across, as on coated paper
GLOSS_LIGHT = 3.0  # of the highlight over white paper, enough to blind the sensor


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole with Brown's distortion ("Close-range camera calibration", 1971).

    axes        (3, 3) rows right, down and forward of the camera in the scanner's frame.
    position    (3,) mm in the scanner's frame.
    size        width and height in pixels.
    focal_px    focal length.
    centre      (2,) principal point.
    radial      k1, k2, k3.
    tangential  p1, p2.
    """

    axes: Floats
    position: Floats
    size: tuple[int, int]
    focal_px: float
    centre: tuple[float, float]
    radial: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tangential: tuple[float, float] = (0.0, 0.0)

    def project(self, points: Floats) -> Floats:
        """(…, 2) pixels at which points (…, 3) mm in the scanner's frame are seen."""
        x, y, z = np.moveaxis((points - self.position) @ self.axes.T, -1, 0)
        x, y = x / z, y / z
        (k1, k2, k3), (p1, p2) = self.radial, self.tangential
        r2 = x * x + y * y
        stretch = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        bent = np.stack(
            [
                x * stretch + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * stretch + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
            ],
            axis=-1,
        )
        return np.asarray(bent * self.focal_px + np.asarray(self.centre))

    def directions(self, top: int, bottom: int) -> NDArray[np.float32]:
        """(bottom − top, width, 3) lines of sight of the rows from `top` to before `bottom`, in the scanner's frame."""
        return _lines_of_sight(self.size[0], top, bottom, self._lens, np.asarray(self.axes, float))

    def through(self, pixels: Floats) -> Floats:
        """(n, 3) lines of sight of pixels (n, 2), in the scanner's frame, of length 1 along the camera's axis."""
        tangents = np.array([_undistorted(x, y, self._lens) for x, y in np.asarray(pixels, float)]).reshape(-1, 2)
        return np.column_stack([tangents, np.ones(len(tangents))]) @ self.axes

    @property
    def _lens(self) -> Floats:
        return np.array([self.focal_px, *self.centre, *self.radial, *self.tangential])


@dataclass(frozen=True, eq=False)
class Shadow:
    """The soft shadow of somebody beside the table: a half-plane in the scanner's x and y.

    edge_mm   (x, y) of a point where half of the shadow falls.
    into_deg  direction into the shadow.
    width_mm  over which it sets in.
    share     of the light that it takes.
    """

    edge_mm: tuple[float, float]
    into_deg: float
    width_mm: float = 60.0
    share: float = 0.3

    def light(self, points: Vectors) -> NDArray[np.float32]:
        """(n,) share of the light left at points (n, 3) mm."""
        into = np.array([np.cos(np.radians(self.into_deg)), np.sin(np.radians(self.into_deg))])
        depth = (points[:, :2] - np.array(self.edge_mm)) @ into / self.width_mm
        return (1.0 - self.share / (1.0 + np.exp(np.clip(-4.0 * depth, -50.0, 50.0)))).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Exposure:
    """Light and sensor response of a photograph.

    lamp      (3,) direction from the page to the lamp.
    ambient   share of the light that comes from all sides.
    colour    of the light, relative to the camera's white.
    exposure  white paper that faces the lamp gives this share of full scale, linear.
    falloff   share of light lost in the corners.
    blur_px   standard deviation of the lens's blur.
    noise     standard deviation of the sensor's noise in 8-bit codes.
    shadow    of somebody who stands in the light, if any.
    """

    lamp: Floats = field(default_factory=lambda: np.array([0.6, 0.3, 0.75]))
    ambient: float = 0.6
    colour: tuple[float, float, float] = (1.0, 0.95, 0.85)
    exposure: float = 0.75
    falloff: float = 0.2
    blur_px: float = 0.7
    noise: float = 2.0
    shadow: Shadow | None = None


def look_at(
    target: Floats,
    position: Floats,
    *,
    size: tuple[int, int],
    focal_px: float,
    roll_deg: float = 0.0,
    offset: tuple[float, float] = (0.0, 0.0),
    radial: tuple[float, float, float] = (0.0, 0.0, 0.0),
    tangential: tuple[float, float] = (0.0, 0.0),
) -> Camera:
    """A camera at a position (3,) mm that looks at a target (3,) mm, its upper edge up, then rolled clockwise.

    offset: of the principal point from the middle of the picture, in pixels.
    """
    forward = np.asarray(target, float) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    roll = np.radians(roll_deg)
    axes = np.stack([np.cos(roll) * right + np.sin(roll) * down, np.cos(roll) * down - np.sin(roll) * right, forward])
    centre = ((size[0] - 1) / 2 + offset[0], (size[1] - 1) / 2 + offset[1])
    return Camera(axes, np.asarray(position, float), size, focal_px, centre, radial, tangential)


def photograph_scene(scene: Scene, camera: Camera, exposure: Exposure, rng: np.random.Generator) -> Bytes:
    """(h, w, 3) uint8 RGB (sRGB): the scene through the camera."""
    import cv2

    caster, maps = RayCaster(scene.vertices, scene.faces), FaceMaps.of(scene)
    width, height = camera.size
    light = np.empty((height, width, 3), np.float32)
    rows = max(STRIP_PIXELS // width, 1)
    for top in range(0, height, rows):
        bottom = min(top + rows, height)
        light[top:bottom] = _strip(scene, caster, maps, camera, exposure, camera.directions(top, bottom))
    if exposure.blur_px:
        light = cv2.GaussianBlur(light, (0, 0), exposure.blur_px)
    picture = np.empty((height, width, 3), np.uint8)
    for top in range(0, height, rows):
        codes = srgb(light[top : top + rows])
        codes = codes + exposure.noise * rng.standard_normal(codes.shape, dtype=np.float32)
        picture[top : top + rows] = np.clip(np.rint(codes), 0, 255)
    return picture


def _strip(
    scene: Scene, caster: RayCaster, maps: FaceMaps, camera: Camera, exposure: Exposure, rays: NDArray[np.float32]
) -> NDArray[np.float32]:
    """(rows, cols, 3) linear light along rays (rows, cols, 3), 1 where the sensor is full."""
    face, depth = caster.first_hit(camera.position, rays)
    light = np.zeros(rays.shape, np.float32)
    seen = face >= 0
    face, ways = face[seen], rays[seen] * depth[seen][:, None]
    if not len(face):
        return light
    points = ways + camera.position
    codes = colour_codes(scene, float(np.median(depth[seen])) / camera.focal_px)(face, maps.page(face, points))
    lit = linear(codes) * _shading(maps, exposure)[face][:, None]
    if exposure.shadow is not None:
        lit *= exposure.shadow.light(points)[:, None]
    if scene.printed.gloss > 0:
        lit += scene.printed.gloss * GLOSS_LIGHT * _highlight(scene, maps, exposure, face, ways)[:, None]
    forward = rays[seen] @ camera.axes[2] / np.linalg.norm(rays[seen], axis=1)
    vignette = 1 - exposure.falloff * (1 - forward**2) / _corner(camera)
    light[seen] = lit * (vignette * exposure.exposure)[:, None] * np.array(exposure.colour)
    return light


def _shading(maps: FaceMaps, exposure: Exposure) -> Floats:
    """(m,) light on each face, 1 where it faces the lamp."""
    lamp = exposure.lamp / np.linalg.norm(exposure.lamp)
    return np.asarray(exposure.ambient + (1 - exposure.ambient) * np.clip(lamp @ maps.normals, 0, None))


def _highlight(scene: Scene, maps: FaceMaps, exposure: Exposure, face: Ints, ways: Vectors) -> Floats:
    """(n,) share of the lamp that faces (n,) mirror back along ways (n, 3)."""
    half = exposure.lamp / np.linalg.norm(exposure.lamp) - ways.astype(float) / np.linalg.norm(
        ways, axis=1, keepdims=True
    )
    cosine = maps.along_normal(face, half) / np.linalg.norm(half, axis=1)
    return np.where(scene.on_page[face], np.clip(cosine, 0, None) ** GLOSS_SHARPNESS, 0.0)


def _corner(camera: Camera) -> float:
    """Squared sine of the angle between the axis and a corner of the picture."""
    reach = np.hypot(*camera.size) / 2 / camera.focal_px
    return float(reach**2 / (1 + reach**2))


@numba.njit(cache=True)
def _undistorted(col: float, row: float, lens: Floats) -> tuple[float, float]:
    """Tangents of the line of sight of a pixel."""
    focal, cx, cy, k1, k2, k3, p1, p2 = lens
    u, v = (col - cx) / focal, (row - cy) / focal
    x, y = u, v
    for _ in range(UNDISTORTIONS):
        r2 = x * x + y * y
        stretch = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        a = (u - 2 * p1 * x * y - p2 * (r2 + 2 * x * x)) / stretch
        y = (v - p1 * (r2 + 2 * y * y) - 2 * p2 * x * y) / stretch
        x = a
    return x, y


@numba.njit(cache=True)
def _lines_of_sight(width: int, top: int, bottom: int, lens: Floats, axes: Floats) -> NDArray[np.float32]:
    rays = np.empty((bottom - top, width, 3), np.float32)
    for row in range(top, bottom):
        for col in range(width):
            x, y = _undistorted(col, row, lens)
            for k in range(3):
                rays[row - top, col, k] = x * axes[0, k] + y * axes[1, k] + axes[2, k]
    return rays
