"""Which points of a model lie on the page: table and card are left out.

In each photograph paper is what is bright and has little colour once its print is taken away, in one connected piece
that is not the card. What most photographs say of a point decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from restore.camera.photo_camera import PhotoCamera
from restore.mesh.raster import rasterise
from restore.numerics.limits import TINY
from restore.photogrammetry.surfaces.page_surface import PageSurface
from restore.photogrammetry.track import MIN_VIEWS
from restore.scan import Bytes, Floats, Ints, Mask

MASK_SIDE = 640  # pixels of the longer side: 0.7 mm on a page that fills most of the picture
STROKES = 9  # pixels there: wider than a stroke of a headline, with its shadow
CHROMA_WEIGHT = 1.5  # of colour against lightness: a pale wood is as light as shaded paper
GAPS = 15  # pixels: figures in the page, wider than strokes
RIM = 9  # pixels: twice what the outline of a mask is off by
CUT = np.ones((7, 7), np.uint8)  # pixels: as far as the mask is changed next to the card that is cut out of it
CARD_MARGIN = 1.03  # by which the card is drawn larger than it is
SURE = 0.8  # of the views that show a point call it paper
MAJORITY = 0.6
GRAZING = 0.1  # cosine of the angle of a line of sight to the normal: flatter, a pixel of a mask is a centimetre
CELL_MM = 1.0  # of the map in which the page's area is connected
OPENING = 2  # cells: bridges to what else is bright are as narrow
CLOSING = 8  # cells: notches where the card lies before the table behind the page's edge


class CardInView(NamedTuple):
    """Outlines (k, 2) pixels of the card in a photograph, None if unknown.

    markers: of those that are seen: nothing hides the card there.
    seen: the same with the paper round them, of which the page may hide a part.
    whole: of all of it: next to the markers seen lies the card, or the page over it.
    complete: whether all markers are seen.
    """

    markers: Floats | None = None
    seen: Floats | None = None
    whole: Floats | None = None
    complete: bool = False

    def scaled(self, ratio: float) -> CardInView:
        """Return the outlines in a copy of the photograph of relative size."""
        markers, seen, whole = (None if one is None else (one + 0.5) * ratio - 0.5 for one in self[:3])
        return self._replace(markers=markers, seen=seen, whole=whole)


@dataclass(frozen=True, eq=False)
class PaperMasks:
    """Fraction of paper (v, h, w), 0 to 1, in smaller copies.

    The photographs have a size (w, h).
    unknown: (v, h, w), True where the card lies and no marker of it is seen: the page may hide it there, and paper is
        as white as paper.
    shown: (v,), True for views that show all markers, so that little of the card is hidden.
    """

    masks: Floats
    size: tuple[int, int]
    unknown: Mask
    shown: Mask

    def votes(
        self,
        cameras: Sequence[PhotoCamera],
        points: Floats,
        normals: Floats | None = None,
        seen: Mask | None = None,
    ) -> tuple[Floats, Floats]:
        """Return the fraction of views that show points on paper, and how many.

        Where any view is certain, only such ones count, and else those that show all of the card.
        points: (n, 3) mm.
        normals: (n, 3); views from behind the surface do not count.
        seen: (v, n); only views that see a point count: in others the page may hide it.
        Returns (n,) both.
        """
        total, count = np.zeros((3, len(points))), np.zeros((3, len(points)))  # of views certain, showing the card, all
        height, width = self.masks.shape[1:]
        views = zip(self.masks, self.unknown, self.shown, cameras, strict=True)
        for view, (mask, unknown, shown, camera) in enumerate(views):
            pixels = camera.scaled((width, height)).project(points)
            inside = ((pixels > 0) & (pixels < [width - 1, height - 1])).all(axis=1)
            if seen is not None:
                inside &= seen[view]
            if normals is not None:
                ways = camera.position - points
                inside &= (ways * normals).sum(axis=1) > GRAZING * np.linalg.norm(ways, axis=1)
            cols, rows = np.rint(pixels[inside]).astype(int).T
            for row, counted in enumerate((~unknown[rows, cols], shown, True)):
                total[row, inside] += counted & (mask[rows, cols] > 0.5)
                count[row, inside] += counted
        fraction = total / np.maximum(count, 1)
        return np.select([count[0] > 0, count[1] > 0], [fraction[0], fraction[1]], fraction[2]), count[2]

    def uncovered(self, cameras: Sequence[PhotoCamera], vertices: Floats, faces: Ints) -> float:
        """Return the fraction of the paper that a mesh does not cover: the median of the views.

        vertices: (n, 3) mm.
        faces: (m, 3).
        """
        height, width = self.masks.shape[1:]
        fractions = []
        for mask, camera in zip(self.masks, cameras, strict=True):
            pixels = camera.scaled((width, height)).project(vertices)
            drawn = np.isfinite(rasterise(pixels, faces, np.zeros((len(vertices), 1)), height, width)[..., 0])
            paper, covered = mask > 0.5, cv2.dilate(drawn.astype(np.uint8), np.ones((RIM, RIM), np.uint8)) > 0
            fractions.append((paper & ~covered).sum() / max(paper.sum(), 1))
        return float(np.median(fractions))


def find_paper(images: Sequence[Bytes], cards: Sequence[CardInView]) -> PaperMasks:
    """Find the paper in photographs (h, w, 3) uint8 RGB.

    cards: what is known of the card in each.
    """
    height, width = images[0].shape[:2]
    ratio = MASK_SIDE / max(height, width)
    size = round(width * ratio), round(height * ratio)
    masks, unknown = [], []
    for image, card in zip(images, cards, strict=True):
        small, here = cv2.resize(image, size, interpolation=cv2.INTER_AREA), card.scaled(ratio)
        masks.append(_paper(small, here.seen))
        near = cv2.dilate((_filled(here.whole, size) | _filled(here.seen, size)).astype(np.uint8), CUT) > 0
        unknown.append(near & ~_filled(here.markers, size) & (here.whole is not None))
    shown = np.array([card.complete for card in cards])
    return PaperMasks(np.stack(masks).astype(np.float64), (width, height), np.stack(unknown), shown)


def _filled(outline: Floats | None, size: tuple[int, int]) -> Mask:
    """Fill an outline (k, 2) pixels, with its rim.

    The picture has a size (w, h); nowhere True for None.
    """
    mask = np.zeros(size[::-1], np.uint8)
    return np.asarray((mask if outline is None else cv2.fillPoly(mask, [_larger(outline)], 1)) > 0)


def _paper(image: Bytes, card: Floats | None) -> Mask:
    """Return the largest piece of paper in a small photograph (h, w, 3), (h, w) bool."""
    kernel = np.ones((STROKES, STROKES), np.uint8)
    blank = cv2.dilate(image, kernel)  # print is darker than the paper round it
    lab = cv2.cvtColor(blank, cv2.COLOR_RGB2LAB).astype(np.float32)
    chroma = np.hypot(lab[..., 1] - 128.0, lab[..., 2] - 128.0)
    light = np.clip(lab[..., 0] - CHROMA_WEIGHT * chroma, 0, 255).astype(np.uint8)
    _, paper = cv2.threshold(light, 0, 1, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    paper = cv2.erode(paper, kernel)
    if card is not None:
        cv2.fillPoly(paper, [_larger(card)], 0)
    return _largest(cv2.morphologyEx(paper, cv2.MORPH_CLOSE, np.ones((GAPS, GAPS), np.uint8)) > 0)


def _larger(card: Floats) -> NDArray[np.int32]:
    """Return the outline of a card with its rim, (k, 2) whole pixels."""
    return np.rint(card.mean(axis=0) + (card - card.mean(axis=0)) * CARD_MARGIN).astype(np.int32)


def without_card(grey: NDArray[np.float32], paper: Floats, card: Floats | None) -> NDArray[np.float32]:
    """Return a photograph's brightness with the card replaced by the table.

    Markers next to the page would be steeper steps than its edge.
    grey: (h, w).
    paper: its mask in a smaller copy.
    """
    if card is None:
        return grey
    small = cv2.resize(grey, paper.shape[::-1], interpolation=cv2.INTER_AREA)
    table = float(np.median(small[paper < 0.5]))
    return np.asarray(cv2.fillPoly(grey.copy(), [_larger(card)], table))


def _largest(mask: Mask) -> Mask:
    """Return the largest connected piece of a mask (h, w), holes filled."""
    labels, count = ndimage.label(mask)
    if not count:
        return mask
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.asarray(ndimage.binary_fill_holes(labels == sizes.argmax()))


@dataclass(frozen=True, eq=False)
class PageArea:
    """Area of the page: cells (rows, cols) of CELL_MM from a corner low (2,) mm, rows along y."""

    cells: Mask
    low: Floats

    def contains(self, places: Floats, margin_mm: float = 0.0) -> Mask:
        """Return which places (n, 2) mm are on the page, (n,) bool.

        A margin from its edge at least, or beyond it if negative.
        """
        room = 1 + int(np.ceil(max(-margin_mm, 0.0) / CELL_MM))
        inner = np.pad(self.cells, room)
        if margin_mm > 0:
            inner = ndimage.distance_transform_edt(inner) * CELL_MM > margin_mm
        elif margin_mm < 0:
            inner = ndimage.distance_transform_edt(~inner) * CELL_MM < -margin_mm
        index = np.floor((places - self.low) / CELL_MM).astype(int) + room
        valid = ((index >= 0) & (index < np.array(inner.shape)[::-1])).all(axis=1)
        found = np.zeros(len(places), bool)
        found[valid] = inner[index[valid, 1], index[valid, 0]]
        return found

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lower left and upper right corner (2,) mm."""
        rows, cols = np.nonzero(self.cells)
        low, high = np.array([cols.min(), rows.min()]), np.array([cols.max() + 1, rows.max() + 1])
        return self.low + low * CELL_MM, self.low + high * CELL_MM

    @property
    def outline(self) -> Floats:
        """Return the border (n, 2) mm, counter-clockwise, from cell to cell."""
        contours, _ = cv2.findContours(self.cells.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        border = max(contours, key=cv2.contourArea).reshape(-1, 2).astype(np.float64)
        x, y = border.T
        if (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() < 0:
            border = border[::-1]
        return self.low + (border + 0.5) * CELL_MM


def area_of_votes(
    masks: PaperMasks, cameras: Sequence[PhotoCamera], surface: PageSurface, low: Floats, high: Floats
) -> PageArea:
    """Return where a page is on a surface, by votes, between corners low and high (2,) mm."""
    x, y = (np.arange(start + CELL_MM / 2, end, CELL_MM) for start, end in zip(low, high, strict=True))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    fraction, count = masks.votes(cameras, surface.points(places), surface.normals(places))
    paper = ((fraction > MAJORITY) & (count >= MIN_VIEWS)).reshape(len(y), len(x))
    paper = ndimage.binary_opening(paper, iterations=OPENING)
    # Padded: closing would otherwise take from the border.
    paper = ndimage.binary_closing(np.pad(paper, CLOSING), iterations=CLOSING)[CLOSING:-CLOSING, CLOSING:-CLOSING]
    return PageArea(_largest(paper), np.asarray(low, float))


def on_page(masks: PaperMasks, cameras: Sequence[PhotoCamera], points: Floats) -> Mask:
    """Return which points (n, 3) mm of the model are reliably on the page, (n,) bool."""
    fraction, count = masks.votes(cameras, points)
    return np.asarray((fraction > SURE) & (count >= MIN_VIEWS))


def ground_sample(cameras: Sequence[PhotoCamera], points: Floats) -> float:
    """Return mm on the page per photograph pixel: median over points (n, 3) mm and cameras."""
    depths = [1.0 / np.maximum(camera.inverse_depth(points), TINY) / camera.focal_px for camera in cameras]
    return float(np.median(depths))
