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
from scipy.spatial import cKDTree

from restore.camera.rays import Rays
from restore.findings import Finding, finding
from restore.mesh.ordered_grid import GridMesh
from restore.page import FlatMesh
from restore.range_image.facets.sheet import Sheet
from restore.scan import Bytes, Floats, InterpolatedMesh, Mask, SurfaceMesh
from restore.texture.occlusion import occluded, viewpoint
from restore.texture.page import MM_PER_INCH, Painting, rasterise_on_page

MAX_HIDDEN = 0.1  # of the page: the gutter of a book hides less, beside the letters that are lost there
MAX_FILLED_MM = 20.0  # across: between two lines of text a page bends little, over a hand's breadth of a book too much
EDGE_PX = 3.0  # of the picture: the page is painted by interpolation, so its last pixel lies within two of the edge
# of the outline of a page that is said to be cut off: the presets of the station are amber from there
MAX_CUT = 0.02


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

    def findings(self) -> list[Finding]:
        """What is to be reported of a page that is white in large part."""
        hidden = self.shares()["hidden"]
        return [finding("hidden", hidden)] if hidden > MAX_HIDDEN else []


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


def cut_findings(share: float) -> list[Finding]:
    """What is to be reported of a page that has a fraction of its outline at the edge of the picture."""
    return [finding("cut_off", share)] if share > MAX_CUT else []


def filled_findings(seen: Bytes, dpi: float) -> list[Finding]:
    """What is to be reported of a page (h, w), values of `Seen`, that gave no range over a broad area."""
    filled = np.pad(seen == Seen.FILLED, 1).astype(np.uint8)
    across = 2.0 * float(cv2.distanceTransform(filled, cv2.DIST_L2, cv2.DIST_MASK_5).max()) * MM_PER_INCH / dpi
    return [finding("filled", across_mm=across)] if across > MAX_FILLED_MM else []


def _camera_centre(surface: Sheet | SurfaceMesh, fine: FlatMesh) -> Floats | None:
    """The centre (3,) mm of the camera, or None when the texture is not the picture of one pinhole camera.

    That of a segment of a volume is none: it was drawn over the grid.
    """
    if isinstance(surface, GridMesh):
        return None
    if isinstance(surface, Sheet) and _is_scanner_camera(surface.rays):
        return surface.rays.origin
    return viewpoint(fine)


def _is_scanner_camera(rays: Rays) -> bool:
    """True when the rays are the scanner's own, and not those of a virtual camera for a mesh."""
    return not rays.origin.any()
