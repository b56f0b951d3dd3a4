"""Coverage: which pixels of the page the camera saw, and where shape was measured.

The colour of a page pixel is true where nothing occludes it from the camera. The surface there may still be
interpolated: dark ink absorbs the laser, and photographs of blank paper show nothing to measure. There the shape is
filled in from its neighbourhood. Where the page occludes itself (behind a fold, on a wall seen edge-on, on a side
turned away) the texture has the colour of another place, and where the surface has a hole it has none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property, partial
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from restore.findings import Finding
from restore.page import FlatMesh
from restore.report import CoverageReport
from restore.runtime.rows import Rows
from restore.runtime.threads import in_picture_bands
from restore.scan import Bytes, Floats, Mask
from restore.texture.occlusion import occluded
from restore.texture.page import MM_PER_INCH, PAPER, Painting

MAX_HIDDEN = 0.1  # of the page: the gutter of a book hides less, even with the letters that are lost there
MAX_FILLED_MM = 20.0  # across: between two lines of text a page bends little, over a hand's breadth of a book too much
WIDTH_DPI = 150  # at which widths are measured at least: a pixel is a hundredth of MAX_FILLED_MM
EDGE_PX = 3.0  # of the picture: the page is painted by interpolation, so its last pixel lies within two of the edge
# of the outline of a page that is said to be cut off: the presets of the station are amber from there
MAX_CUT = 0.02
NO_PICTURE = 255  # in page_source, off the page


class CoverageClass(IntEnum):
    """The kind of a page pixel, as `RestoredPage.coverage` has it.

    >>> coverage = np.array([[0, 1, 1], [0, 2, 3]], np.uint8)
    >>> int((coverage == CoverageClass.MEASURED).sum())
    2
    """

    OUTSIDE = 0  # off the page
    MEASURED = 1  # seen by the camera, its shape measured
    INTERPOLATED = 2  # seen by the camera, its shape filled in
    OCCLUDED = 3  # on the page and not seen by the camera
    INPAINTED = 4  # hidden, and inpainted from its neighbourhood
    OBSTRUCTED = 5  # seen, but covered by something in a photograph, and painted from another picture
    FACING = 6  # seen, of the facing page: a strip next to the spine of an opened book
    ERASED = 7  # on the page, and removed by hand


UNSEEN = (CoverageClass.OUTSIDE, CoverageClass.OCCLUDED, CoverageClass.ERASED)
VISIBLE = (CoverageClass.MEASURED, CoverageClass.INTERPOLATED, CoverageClass.OBSTRUCTED, CoverageClass.FACING)


@dataclass(frozen=True, eq=False)
class Coverage:
    """The kinds of the pixels of a page.

    seen  (h, w) uint8, values of `CoverageClass`.
    cut   fraction of the page's outline that is at the edge of the source's picture; None where the page may fill that.
    gaps  (h, w) True in the holes that the page encloses, which are OCCLUDED or INPAINTED; None for none.
    """

    seen: Bytes
    cut: float | None = None
    gaps: Mask | None = None

    @cached_property
    def mask(self) -> Mask:
        """Return where the camera saw the page, (h, w) bool."""
        return of_kinds(self.seen, VISIBLE)

    def fractions(self) -> dict[str, float]:
        """The fraction of the page's area of each kind, 0 to 1."""
        count = {
            kind: np.count_nonzero(self.seen == kind) for kind in CoverageClass if kind is not CoverageClass.OUTSIDE
        }
        page = max(sum(count.values()), 1)
        return {kind.name.lower(): number / page for kind, number in count.items()}

    def described(self) -> CoverageReport:
        """Return the coverage as the report has it: the fractions of the kinds, and `cut`."""
        return cast(CoverageReport, {**self.fractions(), "cropped_fraction": self.cut})

    def findings(self, dpi: float) -> list[Finding]:
        """What is to be reported of a page that is white in large part, or has a broad hole."""
        missing = self.seen == CoverageClass.OCCLUDED
        page = max(int(np.count_nonzero(self.seen != CoverageClass.OUTSIDE)), 1)
        gaps = None if self.gaps is None else self.gaps & missing
        hidden = float((np.count_nonzero(missing) - (0 if gaps is None else np.count_nonzero(gaps))) / page)
        erased = float(np.count_nonzero(self.seen == CoverageClass.ERASED) / page)
        across = 0.0 if gaps is None else _across_mm(gaps, dpi)
        found = [Finding.of("hidden", hidden)] if hidden > MAX_HIDDEN else []
        found += [Finding.of("gap", across_mm=across)] if across > MAX_FILLED_MM else []
        return [*found, Finding.of("removed_by_hand", erased)] if erased else found


def cover(
    fine: FlatMesh,
    painting: Painting,
    kinds: Bytes,
    camera_centre: Floats | None,
    dpi: float,
    *,
    may_be_cut: bool = True,
) -> Coverage:
    """The coverage of a painted page at a resolution of dpi.

    kinds (h, w) are how the shape of its pixels is known: MEASURED, INTERPOLATED, or OUTSIDE in holes and off the page.
    camera_centre (3,) mm: of the camera that took the texture; None where it is not one camera's picture.
    may_be_cut: whether the edge of the texture can cut the page off, as it does in a scanner's picture; a chart ends
    there by rights.
    """
    seen, on_page = kinds.copy(), painting.mask & (kinds != CoverageClass.OUTSIDE)
    gaps = _enclosed_holes(painting.mask)
    if gaps is not None:
        seen[gaps] = CoverageClass.OCCLUDED
    if painting.covered is not None:
        seen[painting.covered & on_page] = CoverageClass.OBSTRUCTED
    if camera_centre is not None and fine.texcoords is not None and fine.texture is not None:
        hidden = occluded(fine, camera_centre, on_page.shape, dpi)() & on_page
        # Pixels painted from a photograph need not be visible to the scanner's camera.
        seen[hidden if painting.page_source is None else hidden & (painting.page_source == 0)] = CoverageClass.OCCLUDED
    cut = None
    if fine.texture is not None and may_be_cut:
        cut = cropped_fraction(seen != CoverageClass.OUTSIDE, painting.source.rows, fine.texture.shape[:2])
    return Coverage(seen, cut, gaps)


def seen_part(painting: Painting, coverage: Coverage) -> Painting:
    """Return the textured page, blank where the camera did not see it.

    In holes it ends, and has no source.
    """
    # Off the painted part, and in the holes that it encloses, the image is blank already.
    blank = of_kinds(coverage.seen, UNSEEN) & painting.mask
    if not blank.any():
        return replace(painting, mask=coverage.mask)
    holes = painting.mask & (coverage.seen == CoverageClass.OUTSIDE)
    image, source, page_source = painting.image, painting.source, painting.page_source
    image = image.copy()
    image[blank] = PAPER
    if holes.any():
        source = replace(source, kept=None, draw=partial(_with_holes, source, holes))
        page_source = None if page_source is None else np.where(holes, np.uint8(NO_PICTURE), page_source)
    return replace(painting, image=image, mask=coverage.mask, source=source, page_source=page_source)


def _with_holes(source: Rows, holes: Mask, rows: slice) -> NDArray[np.float32]:
    return np.where(holes[rows][..., None], np.float32(np.nan), source.rows(rows))


def of_kinds(seen: Bytes, kinds: Iterable[CoverageClass]) -> Mask:
    """Mark the pixels (h, w) of a page that are of one of some kinds."""
    table = np.zeros(256, np.uint8)
    table[list(kinds)] = 1
    return np.asarray(cv2.LUT(seen, table)).view(bool)


def hole_findings(page: Mask, kinds: Bytes, dpi: float) -> list[Finding]:
    """Return the findings on the holes of a page (h, w).

    Its kinds (h, w) are OUTSIDE in them.
    """
    area = float((page & (kinds == CoverageClass.OUTSIDE)).sum()) * (MM_PER_INCH / dpi) ** 2
    return [Finding.of("holes", area_mm2=area)] if area else []


def distance_to(measured: Floats, points: Floats) -> Floats:
    """Return distances (n,) mm to the nearest measured point.

    inf without any.
    measured: (k, 3).
    points: (n, 3).
    """
    return np.asarray(cKDTree(measured).query(points)[0]) if len(measured) else np.full(len(points), np.inf)


def _enclosed_holes(covered: Mask) -> Mask | None:
    """Return the holes (h, w) of a mask (h, w), None without any.

    They are outside it and not connected to the border.
    """
    outside = np.pad(covered.view(np.uint8), 1)
    cv2.floodFill(outside, None, (0, 0), 1)
    return None if outside.all() else outside[1:-1, 1:-1] == 0


def cropped_fraction(page: Mask, page_map: Callable[[slice], NDArray[np.float32]], size: tuple[int, int]) -> float:
    """Return the fraction of a page's outline at the edge of the picture.

    page_map: gives (rows, w, 2) texture pixels of a slice of its rows. size: height and width of the texture.
    """
    counts: list[tuple[int, int]] = []

    def count(rows: slice) -> None:
        x, y = page_map(rows)[_outline(page, rows)].T
        inside = (x > EDGE_PX) & (y > EDGE_PX) & (x < size[1] - 1 - EDGE_PX) & (y < size[0] - 1 - EDGE_PX)
        known = np.isfinite(x) & np.isfinite(y)
        counts.append((int((known & ~inside).sum()), int(known.sum())))

    in_picture_bands(count, *page.shape)
    outside, known = (sum(one) for one in zip(*counts, strict=True))
    return outside / max(known, 1)


def _outline(page: Mask, rows: slice) -> Mask:
    """Mark the outermost pixels of a page (h, w) in a slice of its rows."""
    first = max(rows.start - 1, 0)
    near = page[first : rows.stop + 1].view(np.uint8)
    inner = cv2.erode(near, np.ones((3, 3), np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=0).view(bool)
    return np.asarray(page[rows] & ~inner[rows.start - first :][: rows.stop - rows.start])


def cut_findings(fraction: float) -> list[Finding]:
    """Return the findings on a page that is cut off.

    A fraction of its outline is at the edge of the picture.
    """
    return [Finding.of("cut_off", fraction)] if fraction > MAX_CUT else []


def filled_findings(seen: Bytes, dpi: float) -> list[Finding]:
    """Return the findings on a page that gave no range over a broad area.

    seen: (h, w), values of `CoverageClass`.
    """
    across = _across_mm(seen == CoverageClass.INTERPOLATED, dpi)
    return [Finding.of("filled", across_mm=across)] if across > MAX_FILLED_MM else []


def _across_mm(places: Mask, dpi: float) -> float:
    """The diameter in mm of the largest circle within places (h, w) of a page."""
    if not places.any():
        return 0.0
    step = max(1, int(dpi / WIDTH_DPI))
    rows, cols = (max(1, size // step) for size in places.shape)
    # A block counts where all of it does: lines of any length are not an area.
    blocks = places[: rows * step, : cols * step].reshape(rows, -1, cols, min(step, places.shape[1])).all(axis=(1, 3))
    padded = np.pad(blocks, 1).astype(np.uint8)
    return 2.0 * float(cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_5).max()) * MM_PER_INCH * step / dpi
