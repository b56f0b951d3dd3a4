"""The pictures of a page, as rows.

A page of more pixels than are kept in memory is drawn by rows, wherever they are needed. What needs the whole page is
found on an overview of it: its findings, the holes that it encloses, its light, the colour of its paper. Pixels then
follow from that, the mesh and the picture.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.page import FlatMesh
from restore.prepared.prepared import KindsOfRows, Prepared
from restore.runtime.rows import Rows
from restore.scan import Bytes, Mask
from restore.settings import Settings
from restore.texture.coverage import UNSEEN, VISIBLE, WIDTH_DPI, Coverage, CoverageClass, of_kinds
from restore.texture.occlusion import occluded
from restore.texture.page import KEPT_PIXELS, PAPER, Painter, Painting, picture_size

OVERVIEW_DPI = WIDTH_DPI  # of the overview: widths on a page are measured no finer

# Rows (rows, w, 3) uint8 as painted, where they are seen (rows, w), and the first of them → in another light.
Relit = Callable[[Bytes, Mask, int], Bytes]


def seen_at(fine: FlatMesh, settings: Settings) -> float:
    """Return the resolution at which a page is looked at, dpi.

    It is below its own where the page is drawn by rows. One without a texture is not, and one that is inpainted needs
    all of its pixels at once. Raises BadInput when the page would be too large.
    """
    width, height = picture_size(fine.flat, settings.dpi)
    is_whole = width * height <= KEPT_PIXELS or fine.texture is None or settings.inpaint_mm
    return settings.dpi if is_whole else min(settings.dpi, OVERVIEW_DPI)


def whole_pictures(image: Bytes, painted: Painting, seen: Painting, coverage: Coverage) -> dict[str, Rows]:
    """Return the pictures of a page that is painted whole.

    image: (h, w, 3), in its light.
    painted, seen: all of it, and what the camera saw.
    """
    erased = coverage.seen == CoverageClass.ERASED
    pictures = {
        "image": image,
        "mask": coverage.mask,
        "master": seen.image,
        "coverage": coverage.seen,
        "page_source": seen.page_source,
        "uncropped": np.where(erased[..., None], painted.image, seen.image) if erased.any() else None,
    }
    return {"page_map": seen.source, **{name: Rows.of(one) for name, one in pictures.items() if one is not None}}


@dataclass(frozen=True, eq=False)
class LargePage:
    """A page that is drawn by rows.

    kinds     how the shape of rows is known.
    hidden    (h, w) where the camera does not see it; None where the texture is not one camera's picture.
    overview  its coverage at OVERVIEW_DPI.
    all_seen  whether the camera saw all of it there: then rows are not looked at again for what it did not see.
    relit     removes the light.
    """

    painter: Painter
    kinds: KindsOfRows
    hidden: Rows | None
    overview: Coverage
    all_seen: bool
    relit: Relit

    @classmethod
    def of(
        cls, prepared: Prepared, fine: FlatMesh, dpi: float, painted: Mask, overview: Coverage, relit: Relit
    ) -> LargePage:
        """Make the pictures of a prepared page at `dpi`.

        painted: (h, w), where its overview has a texture.
        """
        all_seen = np.array_equal(painted, overview.mask)
        painter, centre = Painter.of(fine, dpi), prepared.camera_centre(fine)
        hidden = None if centre is None else occluded(fine, centre, painter.shape, dpi)
        return cls(painter, prepared.kinds_by_rows(fine, dpi), hidden, overview, all_seen, relit)

    def pictures(self) -> dict[str, Rows]:
        """Return the pictures of a `RestoredPage`."""
        fields: dict[str, tuple[Callable[[slice], NDArray[Any]], Any, tuple[int, ...]]] = {
            "image": (self._relit, np.uint8, (3,)),
            "master": (lambda rows: self._painted(rows, UNSEEN)[0], np.uint8, (3,)),
            "mask": (lambda rows: of_kinds(self._seen(rows), VISIBLE), bool, ()),
            "coverage": (self._seen, np.uint8, ()),
            "page_map": (self._map, np.float32, (2,)),
        }
        if (self.overview.seen == CoverageClass.ERASED).any():
            blank = tuple(kind for kind in UNSEEN if kind != CoverageClass.ERASED)
            fields["uncropped"] = (lambda rows: self._painted(rows, blank)[0], np.uint8, (3,))
        return {name: Rows((*self.painter.shape, *rest), kind, draw) for name, (draw, kind, rest) in fields.items()}

    def _painted(self, rows: slice, blank: Sequence[CoverageClass]) -> tuple[Bytes, Bytes]:
        """Return rows (rows, w, 3) of the page, blank where they are of some kinds.

        Returns also their kinds (rows, w).
        """
        image, source = self.painter.paint(rows)
        page = np.isfinite(source[..., 0])
        kinds = page.astype(np.uint8) * np.uint8(CoverageClass.MEASURED) if self.all_seen else self._kinds(rows, page)
        image[of_kinds(kinds, blank)] = PAPER
        return image, kinds

    def _relit(self, rows: slice) -> Bytes:
        """Return rows (rows, w, 3) of the page without its light."""
        image, kinds = self._painted(rows, UNSEEN)
        return self.relit(image, of_kinds(kinds, VISIBLE), rows.start)

    def _kinds(self, rows: slice, page: Mask) -> Bytes:
        """Return the kinds (rows, w) of the pixels that are on the page."""
        kinds = self.kinds(page, rows.start)
        if self.hidden is not None:
            kinds[self.hidden.rows(rows) & (kinds != CoverageClass.OUTSIDE)] = CoverageClass.OCCLUDED
        return kinds

    def _seen(self, rows: slice) -> Bytes:
        """Return the coverage (rows, w)."""
        page = np.isfinite(self.painter.source(rows)[..., 0])
        kinds = self._kinds(rows, page)
        if self._gaps is not None:
            height, width = self.painter.shape
            at = (np.arange(rows.start, rows.stop) * len(self._gaps)) // height
            across = (np.arange(width) * self._gaps.shape[1]) // width
            kinds[self._gaps[np.ix_(at, across)] & ~page] = CoverageClass.OCCLUDED
        return kinds

    def _map(self, rows: slice) -> NDArray[np.float32]:
        source = self.painter.source(rows)
        kinds = self.kinds(np.isfinite(source[..., 0]), rows.start)
        source[kinds == CoverageClass.OUTSIDE] = np.nan
        return source

    @cached_property
    def _gaps(self) -> Mask | None:
        """The holes that the page encloses, on the overview, with a pixel more for their rims."""
        gaps = self.overview.gaps
        return None if gaps is None else cv2.dilate(gaps.view(np.uint8), np.ones((3, 3), np.uint8)).view(bool)
