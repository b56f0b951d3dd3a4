"""Where the camera of the texture does not see the page.

The page occludes itself, or is turned away.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from restore.camera.pinhole import centre_of, pinhole_camera, projected
from restore.camera.rays import MAX_SLOPE
from restore.findings import Finding
from restore.mesh.measures import face_normals, signed_areas
from restore.mesh.raster import rasterise
from restore.numerics.limits import TINY
from restore.page import FlatMesh
from restore.runtime.rows import Rows
from restore.scan import Floats, Ints, Mask
from restore.texture.page import rasterise_on_page

# A surface nearer on the same line of sight occludes by at least this much: more than noise and half a face's depth.
OCCLUSION_MARGIN_MM = 3.0
OCCLUSION_MARGIN_FRACTION = 0.01  # of the range of distances, for surfaces of unknown size
FAR = 50.0  # sizes of the page: a relief of a tenth of it changes a picture of 640 pixels by one
BY_FAR = 2.0  # times nearer to the areas in the texture: then a camera saw them
SAME_AREA = 1e-3  # of the mean face in the picture: what rounding makes of the area of a face
STEEPEST_COSINE = 1.0 / np.hypot(1.0, MAX_SLOPE)


def viewpoint(page: FlatMesh) -> Floats | None:
    """Return the centre (3,) mm of the texture's camera, None unless it was one pinhole.

    A picture that was drawn, of charts or of the colours of vertices, is not a camera's, however like one's it is. Nor
    is a chart that the surface was flattened to, though a camera before or behind the page may come near to it. Of a
    camera as good as at infinity the projection does not determine on which side of the page it was: on the side that
    most faces are turned to.
    """
    camera = _page_camera(page)
    if camera is None:
        return None
    centre = centre_of(camera)
    mirrored = _is_mirrored(_cosines(page, centre))
    return 2.0 * page.vertices.mean(axis=0) - centre if mirrored and _is_far(page, centre) else centre


def _page_camera(page: FlatMesh) -> Floats | None:
    """Return the pinhole camera (3, 4) that took a page's texture, or None."""
    if page.texcoords is None or "oversampling" in page.provenance:
        return None
    camera = pinhole_camera(page.vertices, page.texcoords)
    return None if camera is None or _is_chart(page, page.texcoords, camera) else camera


def _is_far(page: FlatMesh, centre: Floats) -> bool:
    return bool(np.linalg.norm(centre - page.vertices.mean(axis=0)) > FAR * np.ptp(page.vertices, axis=0).max())


def _is_chart(page: FlatMesh, texcoords: Floats, camera: Floats) -> bool:
    """Return whether the texture was flattened, and not photographed.

    Then the areas of faces in the texture are those on the surface rather than those that a camera (3, 4) sees. A
    camera that took it explains them better by far, as noise lies along its rays.
    texcoords: (n, 2) pixels.
    """
    on_surface = np.linalg.norm(face_normals(page.vertices, page.faces), axis=1)
    in_texture, in_view = (
        np.abs(signed_areas(pixels, page.faces)) for pixels in (texcoords, projected(page.vertices, camera))
    )
    least = TINY + SAME_AREA * in_texture.mean()
    as_flattened, as_seen = (
        np.log((in_texture + least) / (areas * (in_texture.sum() / max(areas.sum(), TINY)) + least))
        for areas in (on_surface, in_view)
    )
    return bool(on_surface @ np.abs(as_flattened) < BY_FAR * (on_surface @ np.abs(as_seen)))


def occluded(fine: FlatMesh, camera_centre: Floats, shape: tuple[int, ...], dpi: float) -> Rows:
    """Return where the page is turned away, edge-on, or occluded by itself, by a z-buffer.

    (h, w) bool.
    """
    assert fine.texcoords is not None and fine.texture is not None
    distance = np.linalg.norm(fine.vertices - camera_centre, axis=1)
    turned_away = _turned_away(fine, camera_centre)
    height, width = fine.texture.shape[:2]
    depth = distance - distance.min()  # single precision holds it, also from far away
    nearest_depth = rasterise(fine.texcoords, fine.faces, depth[:, None], height, width, 1.0 / distance)[..., 0]
    front = np.where(np.isnan(nearest_depth), np.float32(np.inf), nearest_depth)
    margin = max(OCCLUSION_MARGIN_MM, OCCLUSION_MARGIN_FRACTION * float(depth.max()))
    corners = _corners_alone(fine) if turned_away.any() else None
    flags = np.repeat(turned_away.astype(np.float64)[:, None], 3, axis=0)
    values = np.column_stack([fine.texcoords, depth])

    def find(rows: slice) -> Mask:
        on_page = rasterise_on_page(fine, values, shape, dpi, rows)
        x, y = (np.ascontiguousarray(on_page[..., k]) for k in (0, 1))
        at = cv2.remap(front, x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=float("inf"))
        hidden: Mask = on_page[..., 2] - at > margin
        if corners is not None:
            hidden |= rasterise_on_page(corners, flags, shape, dpi, rows)[..., 0] > 0.5
        return hidden

    return Rows(shape[:2], bool, find)


def _corners_alone(fine: FlatMesh) -> FlatMesh:
    faces: Ints = np.arange(3 * len(fine.faces)).reshape(-1, 3)
    return replace(fine, faces=faces, flat=fine.flat[fine.faces].reshape(-1, 2))


def _turned_away(fine: FlatMesh, camera_centre: Floats) -> Mask:
    """Return the faces (m,) that the camera sees from behind or edge-on.

    Of a picture that is mirrored to the surface, it is the other side of the faces that the camera saw.
    camera_centre: (3,) mm.
    """
    cosine = _cosines(fine, camera_centre)
    seen = -cosine if _is_mirrored(cosine) else cosine
    return np.asarray(seen < STEEPEST_COSINE)


def _cosines(fine: FlatMesh, camera_centre: Floats) -> Floats:
    """Return cosines (m,) between face normals and the camera direction.

    camera_centre: (3,) mm.
    """
    a, b, c = (fine.vertices[fine.faces[:, k]] for k in range(3))
    normals, to_camera = face_normals(fine.vertices, fine.faces), camera_centre - (a + b + c) / 3
    scale = np.linalg.norm(normals, axis=1) * np.linalg.norm(to_camera, axis=1)
    return np.asarray(np.einsum("ij,ij->i", normals, to_camera) / np.maximum(scale, TINY))


def _is_mirrored(cosines: Floats) -> bool:
    """Return whether most faces are turned away from their camera.

    No camera can see them so.
    """
    return bool((cosines < 0.0).mean() > 0.5)


def mirror_findings(page: FlatMesh) -> list[Finding]:
    """Return the findings on a mirrored page.

    Its picture and surface are mirror images of each other. A camera near the page shows it by the side of the faces
    that it was on; without one the orientation of the faces in the file does, which `load_scan` and `prepare` note.
    """
    camera = _page_camera(page)
    if camera is not None and not _is_far(page, centre := centre_of(camera)):
        return [Finding.of("mirrored")] if _is_mirrored(_cosines(page, centre)) else []
    return [Finding.of("mirrored")] if page.provenance.get("mirrored") else []
