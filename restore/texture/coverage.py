"""What was seen of the page, and what was not: pixel by pixel.

The colour of a page pixel is true where nothing stood between it and the camera. The surface there may still be a
guess: dark ink swallows the laser, and the shape is filled in from round it. Where the paper itself stood in the way
(behind a fold, on a wall seen from its edge, on a side turned away), the colour belongs to another place, and where
the surface has a hole there is none.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from restore.mesh.measures import face_normals
from restore.mesh.raster import rasterise
from restore.numerics import TINY
from restore.range_image.camera import Rays
from restore.range_image.segment import MAX_SLOPE
from restore.range_image.sheet import Sheet
from restore.scan import Bytes, FlatMesh, Floats, Mask, SurfaceMesh
from restore.texture.page import MM_PER_INCH, Painting, page_map

# A surface nearer on the same line of sight occludes by at least this much: more than noise and half a face's depth.
OCCLUSION_MARGIN_MM = 3.0
OCCLUSION_MARGIN_SHARE = 0.01  # of the range of distances, for surfaces of unknown size
MAX_REPROJECTION_PX = 2.0  # rms, texture pixels: a picture of one pinhole camera has less, an atlas of patches more
MIN_POINTS = 12  # six points determine a pinhole camera; twice as many show whether the picture is one's
MIN_SINGULAR_VALUE = 1e-4  # of the largest: below, the points are coplanar and do not determine a camera
STROKE_MM = 2.5  # of a title; those of running text are half a millimetre
PAPER = 255


class Seen(IntEnum):
    """What a page pixel shows."""

    OUTSIDE = 0  # nothing: it is off the page
    MEASURED = 1  # the page, its shape measured
    FILLED = 2  # the page, its shape filled in from round it
    HIDDEN = 3  # nothing: the page was not seen there
    INVENTED = 4  # what the page round it suggests


@dataclass(frozen=True, eq=False)
class Coverage:
    """seen (h, w) uint8, values of `Seen`."""

    seen: Bytes

    @property
    def mask(self) -> Mask:
        """(h, w) True where the camera saw the page."""
        return np.asarray((self.seen == Seen.MEASURED) | (self.seen == Seen.FILLED))

    def shares(self) -> dict[str, float]:
        """Of the page's area, that of each kind."""
        count = np.bincount(self.seen.ravel(), minlength=len(Seen))
        page = max(int(count[Seen.MEASURED :].sum()), 1)
        return {kind.name.lower(): float(count[kind] / page) for kind in Seen if kind is not Seen.OUTSIDE}


def compute_coverage(surface: Sheet | SurfaceMesh, fine: FlatMesh, painting: Painting, dpi: float) -> Coverage:
    """Tell what was seen of a painted page."""
    on_mesh = painting.mask
    seen = np.where(on_mesh, Seen.MEASURED, Seen.OUTSIDE).astype(np.uint8)
    seen[_enclosed_holes(on_mesh)] = Seen.HIDDEN
    if isinstance(surface, Sheet):
        grid_xy = _rasterise_on_page(
            fine, np.stack(surface.rays.grid(fine.vertices), axis=1)[:, ::-1], on_mesh.shape, dpi
        )
        measured = cv2.remap(
            surface.measured.astype(np.uint8), grid_xy, None, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE
        )
        seen[on_mesh & (measured == 0)] = Seen.FILLED
    camera_centre = _camera_centre(surface, fine)
    if camera_centre is not None and fine.texcoords is not None and fine.texture is not None:
        hidden = on_mesh & _occluded(fine, camera_centre, on_mesh.shape, dpi)
        # What a photograph shows, the scanner's camera need not have seen.
        seen[hidden if painting.page_source is None else hidden & (painting.page_source == 0)] = Seen.HIDDEN
    return Coverage(seen)


def _enclosed_holes(covered: Mask) -> Mask:
    """(h, w) True where the mask (h, w) leaves out what it goes all round."""
    outside = np.pad(covered, 1).astype(np.uint8)
    cv2.floodFill(outside, None, (0, 0), 1)
    return outside[1:-1, 1:-1] == 0


def blank_hidden(image: Bytes, coverage: Coverage) -> Bytes:
    """The page (h, w, 3) without what belongs elsewhere: white where it was not seen, as off the page."""
    blanked = image.copy()
    blanked[coverage.seen == Seen.HIDDEN] = PAPER
    return blanked


def inpaint_hidden(image: Bytes, coverage: Coverage, dpi: float, widest_mm: float) -> tuple[Bytes, Coverage]:
    """Fill hidden places up to `widest_mm` across from what is round them, and note them as invented.

    Strokes of ink are not continued, or letters would be smeared to others: paper is, and what is broad.
    A. Telea, "An image inpainting technique based on the fast marching method", J. Graphics Tools 9(1), 2004.
    """
    hidden = coverage.seen == Seen.HIDDEN
    if widest_mm == 0 or not hidden.any():
        return image, coverage
    pieces, count = label(hidden, np.ones((3, 3)))
    depth = cv2.distanceTransform(hidden.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    half_widths = np.zeros(count + 1)
    np.maximum.at(half_widths, pieces.ravel(), depth.ravel())
    narrow = half_widths * 2 <= widest_mm / MM_PER_INCH * dpi + 1
    narrow[0] = False
    selected = narrow[pieces]
    # Off the page lies nothing to continue: white from there must not run into the hole.
    unknown = (~coverage.mask).astype(np.uint8)
    filled = _inpaint(_close_strokes(image, unknown, dpi), unknown, selected)
    seen = np.where(selected, np.uint8(Seen.INVENTED), coverage.seen)
    return np.where(selected[..., None], filled, image), Coverage(seen)


def _close_strokes(image: Bytes, unknown: NDArray[np.uint8], dpi: float) -> Bytes:
    """The page (h, w, 3) closed over what is thinner than a stroke of print; what is unknown has no say."""
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * round(STROKE_MM / MM_PER_INCH * dpi / 2) + 1,) * 2)
    unknown_pixels = (unknown > 0)[..., None]
    brightest = cv2.dilate(np.where(unknown_pixels, np.uint8(0), image), kernel)
    return np.asarray(cv2.erode(np.where(unknown_pixels, np.uint8(PAPER), brightest), kernel), np.uint8)


def _inpaint(image: Bytes, unknown: NDArray[np.uint8], selected: Mask) -> Bytes:
    """Inpaint what is chosen, box by box, so that a page costs no more than its holes."""
    out = image.copy()
    margin = 8  # pixels of surroundings: more than the method looks at
    boxes, count = label(cv2.dilate(selected.astype(np.uint8), np.ones((3, 3), np.uint8)))
    for number in range(1, count + 1):
        rows, cols = np.nonzero(boxes == number)
        part = (
            slice(max(0, rows.min() - margin), rows.max() + margin + 1),
            slice(max(0, cols.min() - margin), cols.max() + margin + 1),
        )
        out[part] = cv2.inpaint(np.ascontiguousarray(image[part]), unknown[part].copy(), 3, cv2.INPAINT_TELEA)
    return out


def _rasterise_on_page(fine: FlatMesh, values: Floats, shape: tuple[int, ...], dpi: float) -> NDArray[np.float32]:
    """Values (n, k) of vertices at the pixels of a page of some shape (h, w), NaN outside."""
    return _crop_or_pad(page_map(fine.flat, fine.faces, values, dpi), shape)


def _crop_or_pad(field: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """A field over the page at the very size of its picture, which may have been rounded otherwise."""
    more = [(0, max(0, wanted - size)) for wanted, size in zip(shape, field.shape, strict=False)]
    full = np.pad(field, [*more, (0, 0)], constant_values=np.nan)
    return np.ascontiguousarray(full[: shape[0], : shape[1]])


def _camera_centre(surface: Sheet | SurfaceMesh, fine: FlatMesh) -> Floats | None:
    """Where the camera stood (3,) mm, or None when the picture is not one pinhole's."""
    if isinstance(surface, Sheet) and _is_scanner_camera(surface.rays):
        return surface.rays.origin
    return None if fine.texcoords is None else pinhole_centre(fine.vertices, fine.texcoords)


def _is_scanner_camera(rays: Rays) -> bool:
    """Whether the rays are the scanner's own, and not those of a view made up for a mesh."""
    return not rays.origin.any()


def pinhole_centre(points: Floats, pixels: Floats) -> Floats | None:
    """The centre (3,) of the pinhole that sees points (n, 3) at pixels (n, 2), or None when none does.

    Direct linear transformation with normalised coordinates (Hartley & Zisserman, "Multiple View Geometry", 2nd ed.,
    alg. 7.1). Points in a plane do not tell where it stands.
    """
    if len(points) < MIN_POINTS:
        return None
    world, to_world = _normalised(points)
    seen, to_seen = _normalised(pixels)
    homogeneous = np.column_stack([world, np.ones(len(world))])
    zeros = np.zeros_like(homogeneous)
    rows = np.concatenate(
        [
            np.column_stack([homogeneous, zeros, -seen[:, :1] * homogeneous]),
            np.column_stack([zeros, homogeneous, -seen[:, 1:] * homogeneous]),
        ]
    )
    values, vectors = np.linalg.eigh(rows.T @ rows)
    if values[1] < MIN_SINGULAR_VALUE**2 * values[-1]:
        return None
    camera = np.linalg.inv(to_seen) @ vectors[:, 0].reshape(3, 4) @ to_world
    projected = np.column_stack([points, np.ones(len(points))]) @ camera.T
    error = projected[:, :2] / projected[:, 2:] - pixels
    if np.sqrt((error**2).sum(axis=1).mean()) > MAX_REPROJECTION_PX:
        return None
    return np.asarray(-np.linalg.solve(camera[:, :3], camera[:, 3]))


def _normalised(points: Floats) -> tuple[Floats, Floats]:
    """Points (n, k) about the origin and of unit spread, and the matrix (k + 1, k + 1) that makes them so."""
    centre = points.mean(axis=0)
    scale = 1 / max(float(np.sqrt(((points - centre) ** 2).sum(axis=1).mean())), TINY)
    size = points.shape[1]
    matrix = np.eye(size + 1)
    matrix[:size, :size] *= scale
    matrix[:size, size] = -scale * centre
    return (points - centre) * scale, matrix


def _occluded(fine: FlatMesh, camera_centre: Floats, shape: tuple[int, ...], dpi: float) -> Mask:
    """(h, w) True where the page was turned away from the eye (3,), seen from its edge, or hidden by itself."""
    assert fine.texcoords is not None and fine.texture is not None
    distance = np.linalg.norm(fine.vertices - camera_centre, axis=1)
    turned_away = _turned_away(fine, camera_centre)
    size = fine.texture.shape[:2]
    nearest_distance = rasterise(fine.texcoords, fine.faces, distance[:, None], *size, 1.0 / distance)[..., 0]
    on_page = _rasterise_on_page(fine, np.column_stack([fine.texcoords, distance]), shape, dpi)
    front_distance = cv2.remap(
        np.where(np.isnan(nearest_distance), np.float32(np.inf), nearest_distance),
        np.ascontiguousarray(on_page[..., :2]),
        None,
        cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=float("inf"),
    )
    margin = max(OCCLUSION_MARGIN_MM, OCCLUSION_MARGIN_SHARE * float(np.ptp(distance)))
    hidden = on_page[..., 2] - front_distance > margin
    if not turned_away.any():
        return np.asarray(hidden)
    corner_flags = np.repeat(turned_away.astype(np.float64)[:, None], 3, axis=0)
    corners = np.arange(3 * len(fine.faces)).reshape(-1, 3)
    flags = page_map(fine.flat[fine.faces].reshape(-1, 2), corners, corner_flags, dpi)
    return np.asarray(hidden | (_crop_or_pad(flags, shape)[..., 0] > 0.5))


def _turned_away(fine: FlatMesh, camera_centre: Floats) -> NDArray[np.bool_]:
    """(m,) True for faces that the eye (3,) sees from behind or from the edge."""
    a, b, c = (fine.vertices[fine.faces[:, k]] for k in range(3))
    normals, to_camera = face_normals(fine.vertices, fine.faces), camera_centre - (a + b + c) / 3
    scale = np.linalg.norm(normals, axis=1) * np.linalg.norm(to_camera, axis=1)
    cosine = np.einsum("ij,ij->i", normals, to_camera) / np.maximum(scale, TINY)
    return np.asarray(cosine < 1 / np.hypot(1.0, MAX_SLOPE))
