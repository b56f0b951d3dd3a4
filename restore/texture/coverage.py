"""Coverage of the page: which pixels the camera saw, and on which of them the shape was measured.

The colour of a page pixel is true where nothing occludes it from the camera. The surface there may still be
interpolated: dark ink absorbs the laser, and photographs of blank paper show nothing to measure. There the shape is
filled in from its neighbourhood. Where the page occludes itself (behind a fold, on a wall seen edge-on, on a side
turned away) the texture has the colour of another place, and where the surface has a hole there is none.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.spatial import cKDTree

from restore.mesh.measures import face_normals, signed_areas
from restore.mesh.ordered_grid import GridMesh
from restore.mesh.raster import rasterise
from restore.numerics import TINY
from restore.range_image.camera import Rays
from restore.range_image.organise import MIRRORED
from restore.range_image.segment import MAX_SLOPE
from restore.range_image.sheet import Sheet
from restore.scan import Bytes, FlatMesh, Floats, InterpolatedMesh, Mask, SurfaceMesh
from restore.texture.page import MM_PER_INCH, Painting, page_map

# A surface nearer on the same line of sight occludes by at least this much: more than noise and half a face's depth.
OCCLUSION_MARGIN_MM = 3.0
OCCLUSION_MARGIN_SHARE = 0.01  # of the range of distances, for surfaces of unknown size
MAX_REPROJECTION_PX = 2.0  # rms, texture pixels: a picture of one pinhole camera has less, an atlas of patches more
MIN_POINTS = 12  # six points determine a pinhole camera; twice as many show whether the picture is one's
MIN_SINGULAR_VALUE = 1e-4  # of the largest: below, the points are coplanar and do not determine a camera
FAR = 50.0  # sizes of the page: a relief of a tenth of it changes a picture of 640 pixels by one
BY_FAR = 2.0
SAME_AREA = 1e-3  # of the mean face in the picture: what rounding makes of the area of a face
NEARLY_PARALLEL = 1e-9  # 1/mm: a camera a thousand kilometres away
MAX_HIDDEN = 0.1  # of the page: the gutter of a book hides less, beside the letters that are lost there
STROKE_MM = 2.5  # of a title; those of running text are half a millimetre
MAX_FILLED_MM = 20.0  # across: between two lines of text a page bends little, over a hand's breadth of a book too much
EDGE_PX = 3.0  # of the picture: the page is painted by interpolation, so its last pixel lies within two of the edge
# of the outline of a page that is said to be cut off: the presets of the station are amber from there
MAX_CUT = 0.02
STEEPEST_COSINE = 1.0 / np.hypot(1.0, MAX_SLOPE)
PAPER = 255


class Seen(IntEnum):
    """The kind of a page pixel."""

    OUTSIDE = 0  # off the page
    MEASURED = 1  # seen by the camera, its shape measured
    FILLED = 2  # seen by the camera, its shape filled in
    HIDDEN = 3  # on the page and not seen by the camera
    INVENTED = 4  # hidden, and inpainted from its neighbourhood
    COVERED = 5  # seen, but covered by something in a photograph, and painted from another picture


@dataclass(frozen=True, eq=False)
class Coverage:
    """The kinds of the pixels of a page: seen (h, w) uint8, values of `Seen`."""

    seen: Bytes

    @property
    def mask(self) -> Mask:
        """(h, w) True where the camera saw the page."""
        return np.asarray((self.seen == Seen.MEASURED) | (self.seen == Seen.FILLED) | (self.seen == Seen.COVERED))

    def shares(self) -> dict[str, float]:
        """The share of the page's area of each kind, 0 to 1."""
        count = {kind: np.count_nonzero(self.seen == kind) for kind in Seen if kind is not Seen.OUTSIDE}
        page = max(sum(count.values()), 1)
        return {kind.name.lower(): number / page for kind, number in count.items()}

    def warnings(self) -> list[str]:
        """What an operator must know of a page that is white in large part."""
        hidden = self.shares()["hidden"]
        if hidden <= MAX_HIDDEN:
            return []
        return [
            f"{hidden:.0%} of the page is hidden from the camera, and white: scan or photograph it from another side"
        ]


def compute_coverage(surface: Sheet | SurfaceMesh, fine: FlatMesh, painting: Painting, dpi: float) -> Coverage:
    """The coverage of a painted page at a resolution of dpi."""
    on_mesh = painting.mask
    seen = np.where(on_mesh, Seen.MEASURED, Seen.OUTSIDE).astype(np.uint8)
    seen[_enclosed_holes(on_mesh)] = Seen.HIDDEN
    if isinstance(surface, Sheet):
        grid_xy = rasterise_on_page(
            fine, np.stack(surface.rays.grid(fine.vertices), axis=1)[:, ::-1], on_mesh.shape, dpi
        )
        measured = cv2.remap(
            surface.measured.astype(np.uint8), grid_xy, None, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE
        )
        seen[on_mesh & (measured == 0)] = Seen.FILLED
    if painting.covered is not None:
        seen[painting.covered & on_mesh] = Seen.COVERED
    camera_centre = _camera_centre(surface, fine)
    if camera_centre is not None and fine.texcoords is not None and fine.texture is not None:
        hidden = on_mesh & occluded(fine, camera_centre, on_mesh.shape, dpi)
        # Pixels painted from a photograph need not be visible to the scanner's camera.
        seen[hidden if painting.page_source is None else hidden & (painting.page_source == 0)] = Seen.HIDDEN
    return Coverage(seen)


def with_interpolated(coverage: Coverage, surface: InterpolatedMesh, fine: FlatMesh, dpi: float) -> Coverage:
    """The coverage of a page at a resolution of dpi, FILLED where the surface was interpolated between measured points.

    fine: the flat page of the surface.
    """
    seen = coverage.seen.copy()
    distance = distance_to(surface.measured, fine.vertices)
    near = rasterise_on_page(fine, distance[:, None], seen.shape, dpi)[..., 0] <= surface.reach_mm
    seen[~near & (seen == Seen.MEASURED)] = Seen.FILLED
    return Coverage(seen)


def distance_to(measured: Floats, points: Floats) -> Floats:
    """(n,) mm from points (n, 3) to the nearest of measured points (k, 3); inf without any."""
    return np.asarray(cKDTree(measured).query(points)[0]) if len(measured) else np.full(len(points), np.inf)


def _enclosed_holes(covered: Mask) -> Mask:
    """(h, w) True in the holes of a mask (h, w): outside it and not connected to the border."""
    outside = np.pad(covered, 1).astype(np.uint8)
    cv2.floodFill(outside, None, (0, 0), 1)
    return outside[1:-1, 1:-1] == 0


def cut_share(page: Mask, page_map: NDArray[np.float32], size: tuple[int, int]) -> float:
    """Share of the outline of a page (h, w) that shows the edge of the picture: there the page goes on, unseen.

    page_map: (h, w, 2) texture pixels. size: height and width of the texture.
    """
    outline = page & ~cv2.erode(np.pad(page.astype(np.uint8), 1), np.ones((3, 3), np.uint8))[1:-1, 1:-1].astype(bool)
    x, y = page_map[outline].T
    inside = (x > EDGE_PX) & (y > EDGE_PX) & (x < size[1] - 1 - EDGE_PX) & (y < size[0] - 1 - EDGE_PX)
    known = np.isfinite(x) & np.isfinite(y)
    return float((known & ~inside).sum() / max(known.sum(), 1))


def cut_warnings(share: float) -> list[str]:
    """What an operator must know of a page of whose outline a share is at the edge of the picture."""
    if share <= MAX_CUT:
        return []
    return [
        f"{share:.0%} of the page's outline is at the edge of the picture, where the page may go on unseen: "
        "move it into the picture, or the scanner back; if the table is shown as a part of it, lay it on a dark cloth"
    ]


def filled_warnings(seen: Bytes, dpi: float) -> list[str]:
    """What an operator must know of a page (h, w), values of `Seen`, that gave no range over a broad area."""
    filled = np.pad(seen == Seen.FILLED, 1).astype(np.uint8)
    across = 2.0 * float(cv2.distanceTransform(filled, cv2.DIST_L2, cv2.DIST_MASK_5).max()) * MM_PER_INCH / dpi
    if across <= MAX_FILLED_MM:
        return []
    return [
        f"an area of the page {across:.0f} mm across gave no range, and its shape is filled in from beside it: unless "
        "it is a hole, raise the laser power for dark ink, or turn glossy paper out of the light, and scan again"
    ]


def blank_hidden(image: Bytes, coverage: Coverage) -> Bytes:
    """The page (h, w, 3) with hidden pixels white, as off the page."""
    blanked = image.copy()
    blanked[coverage.seen == Seen.HIDDEN] = PAPER
    return blanked


def inpaint_hidden(image: Bytes, coverage: Coverage, dpi: float, widest_mm: float) -> tuple[Bytes, Coverage]:
    """The page (h, w, 3), hidden regions up to `widest_mm` wide inpainted, and the coverage that marks them INVENTED.

    Strokes of ink are removed before, or letters would be extended to other letters; paper and broad areas are not.
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
    # Pixels off the page are unknown too: their white must not be propagated into the hole.
    unknown = (~coverage.mask).astype(np.uint8)
    filled = _inpaint(_close_strokes(image, unknown, dpi), unknown, selected)
    seen = np.where(selected, np.uint8(Seen.INVENTED), coverage.seen)
    return np.where(selected[..., None], filled, image), Coverage(seen)


def _close_strokes(image: Bytes, unknown: NDArray[np.uint8], dpi: float) -> Bytes:
    """The page (h, w, 3) morphologically closed over strokes of print, unknown pixels left out."""
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * round(STROKE_MM / MM_PER_INCH * dpi / 2) + 1,) * 2)
    unknown_pixels = (unknown > 0)[..., None]
    brightest = cv2.dilate(np.where(unknown_pixels, np.uint8(0), image), kernel)
    return np.asarray(cv2.erode(np.where(unknown_pixels, np.uint8(PAPER), brightest), kernel), np.uint8)


def _inpaint(image: Bytes, unknown: NDArray[np.uint8], selected: Mask) -> Bytes:
    """The page (h, w, 3) inpainted in the selected regions, one bounding box at a time to save time."""
    out = image.copy()
    margin = 8  # pixels of surroundings, more than the radius of the method
    boxes, count = label(cv2.dilate(selected.astype(np.uint8), np.ones((3, 3), np.uint8)))
    for number in range(1, count + 1):
        rows, cols = np.nonzero(boxes == number)
        part = (
            slice(max(0, rows.min() - margin), rows.max() + margin + 1),
            slice(max(0, cols.min() - margin), cols.max() + margin + 1),
        )
        out[part] = cv2.inpaint(np.ascontiguousarray(image[part]), unknown[part].copy(), 3, cv2.INPAINT_TELEA)
    return out


def rasterise_on_page(fine: FlatMesh, values: Floats, shape: tuple[int, ...], dpi: float) -> NDArray[np.float32]:
    """(h, w, k) float32: values (n, k) of the vertices at the pixels of a page of a shape (h, w), NaN outside."""
    return _crop_or_pad(page_map(fine.flat, fine.faces, values, dpi), shape)


def _crop_or_pad(field: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """A field (h, w, k) cropped or padded with NaN to a shape (h, w), which may have been rounded otherwise."""
    if field.shape[:2] == shape:
        return field
    more = [(0, max(0, wanted - size)) for wanted, size in zip(shape, field.shape, strict=False)]
    full = np.pad(field, [*more, (0, 0)], constant_values=np.nan)
    return np.ascontiguousarray(full[: shape[0], : shape[1]])


def _camera_centre(surface: Sheet | SurfaceMesh, fine: FlatMesh) -> Floats | None:
    """The centre (3,) mm of the camera, or None when the texture is not the picture of one pinhole camera.

    That of a segment of a volume is none: it was drawn over the grid.
    """
    if isinstance(surface, GridMesh):
        return None
    if isinstance(surface, Sheet) and _is_scanner_camera(surface.rays):
        return surface.rays.origin
    return viewpoint(fine)


def viewpoint(page: FlatMesh) -> Floats | None:
    """The centre (3,) mm of the camera that took the texture of a page, or None when it was not one pinhole camera.

    A picture that was painted, of charts or of the colours of vertices, is no camera's, be it like one's.
    Nor is a chart that the surface was laid out in, though a camera before or behind the page may come near to it. Of a
    camera as good as at infinity the projection does not tell on which side of the page it was: on the side that most
    faces are turned to.
    """
    camera = _page_camera(page)
    if camera is None:
        return None
    centre = _centre_of(camera)
    mirrored = _is_mirrored(_cosines(page, centre))
    return 2.0 * page.vertices.mean(axis=0) - centre if mirrored and _is_far(page, centre) else centre


def _page_camera(page: FlatMesh) -> Floats | None:
    """(3, 4) the pinhole camera that took the texture of a page, or None when it was not one."""
    if page.texcoords is None or "oversampling" in page.provenance:
        return None
    camera = pinhole_camera(page.vertices, page.texcoords)
    return None if camera is None or _is_chart(page, page.texcoords, camera) else camera


def _is_far(page: FlatMesh, centre: Floats) -> bool:
    return bool(np.linalg.norm(centre - page.vertices.mean(axis=0)) > FAR * np.ptp(page.vertices, axis=0).max())


def _is_chart(page: FlatMesh, texcoords: Floats, camera: Floats) -> bool:
    """Whether the areas of faces in the texture, texcoords (n, 2) pixels, are those on the surface rather than those
    that a camera (3, 4) sees: then it was laid out, and not photographed. A camera that took it explains them better
    by far, as noise lies along its rays."""
    on_surface = np.linalg.norm(face_normals(page.vertices, page.faces), axis=1)
    in_texture, in_view = (
        np.abs(signed_areas(pixels, page.faces)) for pixels in (texcoords, _projected(page.vertices, camera))
    )
    least = TINY + SAME_AREA * in_texture.mean()
    as_laid_out, as_seen = (
        np.log((in_texture + least) / (areas * (in_texture.sum() / max(areas.sum(), TINY)) + least))
        for areas in (on_surface, in_view)
    )
    return bool(on_surface @ np.abs(as_laid_out) < BY_FAR * (on_surface @ np.abs(as_seen)))


def _is_scanner_camera(rays: Rays) -> bool:
    """True when the rays are the scanner's own, and not those of a virtual camera for a mesh."""
    return not rays.origin.any()


def pinhole_centre(points: Floats, pixels: Floats) -> Floats | None:
    """The centre (3,) mm of the pinhole camera that images points (n, 3) mm at pixels (n, 2), or None without one."""
    camera = pinhole_camera(points, pixels)
    return None if camera is None else _centre_of(camera)


def _centre_of(camera: Floats) -> Floats:
    """(3,) mm the centre of a camera (3, 4)."""
    *direction, weight = np.linalg.svd(camera)[2][3]  # the null vector, of weight 0 at infinity
    return np.asarray(direction) / np.copysign(max(abs(weight), NEARLY_PARALLEL), weight)


def _projected(points: Floats, camera: Floats) -> Floats:
    """(n, 2) pixels of points (n, 3) mm in a camera (3, 4)."""
    projected = np.column_stack([points, np.ones(len(points))]) @ camera.T
    return np.asarray(projected[:, :2] / projected[:, 2:])


def pinhole_camera(points: Floats, pixels: Floats) -> Floats | None:
    """(3, 4) the pinhole camera that images points (n, 3) mm at pixels (n, 2), or None without one.

    Direct linear transformation with normalised coordinates (Hartley & Zisserman, "Multiple View Geometry", 2nd ed.,
    alg. 7.1). It is not determined by coplanar points.
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
    error = _projected(points, camera) - pixels
    return None if np.sqrt((error**2).sum(axis=1).mean()) > MAX_REPROJECTION_PX else camera


def _normalised(points: Floats) -> tuple[Floats, Floats]:
    """Points (n, k) centred and scaled to unit mean square, and the matrix (k + 1, k + 1) that normalises them."""
    centre = points.mean(axis=0)
    scale = 1 / max(float(np.sqrt(((points - centre) ** 2).sum(axis=1).mean())), TINY)
    size = points.shape[1]
    matrix = np.eye(size + 1)
    matrix[:size, :size] *= scale
    matrix[:size, size] = -scale * centre
    return (points - centre) * scale, matrix


def occluded(fine: FlatMesh, camera_centre: Floats, shape: tuple[int, ...], dpi: float) -> Mask:
    """(h, w) True where the page is turned away from the camera, seen edge-on, or occluded by itself (z-buffer)."""
    assert fine.texcoords is not None and fine.texture is not None
    distance = np.linalg.norm(fine.vertices - camera_centre, axis=1)
    turned_away = _turned_away(fine, camera_centre)
    height, width = fine.texture.shape[:2]
    depth = distance - distance.min()  # single precision holds it, also from far away
    nearest_depth = rasterise(fine.texcoords, fine.faces, depth[:, None], height, width, 1.0 / distance)[..., 0]
    on_page = rasterise_on_page(fine, np.column_stack([fine.texcoords, depth]), shape, dpi)
    front_depth = cv2.remap(
        np.where(np.isnan(nearest_depth), np.float32(np.inf), nearest_depth),
        np.ascontiguousarray(on_page[..., 0]),
        np.ascontiguousarray(on_page[..., 1]),
        cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=float("inf"),
    )
    margin = max(OCCLUSION_MARGIN_MM, OCCLUSION_MARGIN_SHARE * float(depth.max()))
    hidden = on_page[..., 2] - front_depth > margin
    if not turned_away.any():
        return np.asarray(hidden)
    corner_flags = np.repeat(turned_away.astype(np.float64)[:, None], 3, axis=0)
    corners = np.arange(3 * len(fine.faces)).reshape(-1, 3)
    flags = page_map(fine.flat[fine.faces].reshape(-1, 2), corners, corner_flags, dpi)
    return np.asarray(hidden | (_crop_or_pad(flags, shape)[..., 0] > 0.5))


def _turned_away(fine: FlatMesh, camera_centre: Floats) -> Mask:
    """(m,) True for faces that the camera at a centre (3,) mm sees from behind or edge-on.

    Of a picture that is mirrored to the surface, it is the other side of the faces that the camera saw.
    """
    cosine = _cosines(fine, camera_centre)
    seen = -cosine if _is_mirrored(cosine) else cosine
    return np.asarray(seen < STEEPEST_COSINE)


def _cosines(fine: FlatMesh, camera_centre: Floats) -> Floats:
    """(m,) cosines of the angles between the normals of the faces and the way to the camera at a centre (3,) mm."""
    a, b, c = (fine.vertices[fine.faces[:, k]] for k in range(3))
    normals, to_camera = face_normals(fine.vertices, fine.faces), camera_centre - (a + b + c) / 3
    scale = np.linalg.norm(normals, axis=1) * np.linalg.norm(to_camera, axis=1)
    return np.asarray(np.einsum("ij,ij->i", normals, to_camera) / np.maximum(scale, TINY))


def _is_mirrored(cosines: Floats) -> bool:
    """Whether most faces are turned away from the camera that took their picture: none can see them so."""
    return bool((cosines < 0.0).mean() > 0.5)


def mirror_warnings(page: FlatMesh) -> list[str]:
    """What an operator must know of a page whose picture and surface are mirror images of each other.

    A camera near the page tells it by the side of the faces that it was on; without one the way round that the faces
    ran in the file does, which `load_scan` and `prepare` note.
    """
    camera = _page_camera(page)
    if camera is not None and not _is_far(page, centre := _centre_of(camera)):
        return [MIRRORED] if _is_mirrored(_cosines(page, centre)) else []
    return [MIRRORED] if page.provenance.get("mirrored") else []
