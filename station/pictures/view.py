"""Rendering of a mesh in perspective, with shading and a cast shadow."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from restore import SurfaceMesh
from restore.drawing import rasterise, vertex_normals
from restore.scan import Bytes, Floats, Mask

BACKGROUND = np.array([58.0, 63.0, 70.0])  # darker than any paper, so that the page stands out
UNPAINTED = np.array([205.0, 203.0, 198.0])  # paper of a mesh without colour, and the back of any page
LAMP = np.array([-0.4, 0.25, 0.9])  # direction to the lamp in the page's frame: above, from the left and the far side
AMBIENT = 0.4  # light on a surface that is edge-on to the lamp
SHADOW = 0.65  # what is left of the ground's light in the page's shadow
PENUMBRA = 0.012  # of the picture's width, blur of the shadow's edge
SUPERSAMPLING = 2  # drawn twice as large and shrunk: smooth edges
MARGIN = 0.04  # of the picture's size, left free round the page
MAX_ROWS = 32_000  # of a map for cv2.remap, which counts in 16 bits
EYE_DISTANCE = 3.0  # in radii of the page: perspective as of a photograph


@dataclass(frozen=True)
class Camera:
    """Camera aimed at `centre` (3,) mm.

    rotation: (3, 3), from the page's frame to right, up, towards the eye.
    radius: mm.
    """

    centre: Floats
    rotation: Floats
    radius: float

    def project(self, points: Floats) -> tuple[Floats, Floats]:
        """Project points (n, 3) mm to the picture.

        Returns position (n, 2), x right and y up, without unit, and depth (n,) mm.
        """
        right, up, towards = self.rotation @ (points - self.centre).T
        depth = EYE_DISTANCE * self.radius - towards
        return np.column_stack([right, up]) / depth[:, None], depth


def oblique_camera(points: Floats, *, azimuth: float = 28.0, elevation: float = 42.0) -> Camera:
    """Return a camera before the page.

    elevation 90 looks straight down on the page as the scanner does, 0 along it from its lower edge.
    points: (n, 3) mm, z towards the scanner.
    azimuth, elevation: degrees.
    """
    turn, tilt = np.radians(azimuth), np.radians(90 - elevation)
    about_z = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)], [0, -np.sin(tilt), np.cos(tilt)]])
    low, high = points.min(axis=0), points.max(axis=0)
    return Camera((low + high) / 2, about_x @ about_z, float(np.linalg.norm(high - low)) / 2)


def render_mesh(mesh: SurfaceMesh, camera: Camera, *, height: int, width: int, extent: Floats | None = None) -> Bytes:
    """Render the mesh as the camera sees it, lit, with its shadow.

    The shadow is on the ground.
    extent: (k, 3) mm, points that have to fit into the picture, and whose lowest lies on the ground; the mesh's own
        when not given.
    Returns (height, width, 3) uint8 RGB.
    """
    rows, cols = height * SUPERSAMPLING, width * SUPERSAMPLING
    extent = mesh.vertices if extent is None else extent
    ground = float(extent[:, 2].min())
    frame, _ = camera.project(np.concatenate([extent, _shadow_points(extent, ground)]))

    def rasterise_corners(points: Floats, values: Floats) -> Floats:
        """Interpolate values (3·m, k) at the corners of the faces, as seen.

        Returns (rows, cols, k), NaN without a face.
        """
        projected, depth = camera.project(points[mesh.faces.ravel()])
        return _perspective(_to_pixels(projected, frame, rows, cols), 1.0 / depth, values, rows, cols)

    covered = np.isfinite(
        rasterise_corners(_shadow_points(mesh.vertices, ground), np.ones((mesh.faces.size, 1)))[..., 0]
    )
    shadow = cv2.GaussianBlur(covered.astype(np.float32), (0, 0), PENUMBRA * cols)
    picture = BACKGROUND * (1 - (1 - SHADOW) * shadow)[..., None]
    visible = rasterise_corners(mesh.vertices, _appearance(mesh, camera))
    covered = np.isfinite(visible[..., 0])
    picture[covered] = visible[covered][:, :1] * _colour(mesh.texture, visible[covered][:, 1:])
    shrunk = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
    return np.clip(np.rint(shrunk), 0, 255).astype(np.uint8)


def _to_pixels(projected: Floats, frame: Floats, height: int, width: int) -> Floats:
    low, high, size = frame.min(axis=0), frame.max(axis=0), np.array([width, height])
    scale = (size * (1 - 2 * MARGIN) / (high - low)).min()
    return (projected - (low + high) / 2) * [scale, -scale] + (size - 1) / 2


def _perspective(xy: Floats, inverse_depth: Floats, values: Floats, rows: int, cols: int) -> Floats:
    """Interpolate values (3·m, k) of the nearest of m triangles.

    Divided by depth, values that are affine in space are affine in the picture.
    xy: (3·m, 2), three positions for each triangle.
    Returns (rows, cols, k).
    """
    weighted = np.column_stack([inverse_depth, values * inverse_depth[:, None]])
    triangles = np.arange(len(xy)).reshape(-1, 3)
    picture = rasterise(xy, triangles, weighted, rows, cols, inverse_depth).astype(np.float64)
    return picture[..., 1:] / picture[..., :1]


def _shadow_points(points: Floats, ground: float) -> Floats:
    """Return the shadows (n, 3) mm of points (n, 3) on the plane z = ground."""
    return points - LAMP * ((points[:, 2:] - ground) / LAMP[2])


def _illumination(mesh: SurfaceMesh) -> Floats:
    """Return the illumination (n, 1), 0 to 1.

    A sheet is thin: its back takes the light that its front would.
    """
    cosine = np.abs(vertex_normals(mesh.vertices, mesh.faces) @ LAMP) / np.linalg.norm(LAMP)
    lit: Floats = AMBIENT + (1 - AMBIENT) * cosine[:, None]
    return lit


def _appearance(mesh: SurfaceMesh, camera: Camera) -> Floats:
    """Return the appearance (3·m, 4) at every corner of the faces.

    Light, whether the printed side is seen, texture pixel (x, y).
    """
    texcoords = np.zeros((len(mesh.vertices), 2)) if mesh.texcoords is None else mesh.texcoords
    at = mesh.faces.ravel()
    return np.column_stack([_illumination(mesh)[at], np.repeat(_front_facing(mesh, camera), 3), texcoords[at]])


def _colour(texture: Bytes | None, visible: Floats) -> Floats:
    """Return the colours (p, 3) RGB of pixels.

    visible: (p, 3), whether the printed side is seen, texture pixel (x, y).
    """
    colour = np.tile(UNPAINTED, (len(visible), 1))
    if texture is not None:
        front = visible[:, 0] > 0.5
        colour[front] = _sample(texture, visible[front, 1:].astype(np.float32)[:, None])
    return colour


def _sample(texture: Bytes, at: NDArray[np.float32]) -> Floats:
    strips = np.array_split(at, len(at) // MAX_ROWS + 1)
    return np.concatenate([cv2.remap(texture, strip, None, cv2.INTER_LINEAR)[:, 0] for strip in strips]).astype(float)


def _front_facing(mesh: SurfaceMesh, camera: Camera) -> Mask:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    eye = camera.centre + camera.rotation[2] * EYE_DISTANCE * camera.radius
    front: Mask = np.einsum("fk,fk->f", np.cross(b - a, c - a), eye - a) > 0
    return front
