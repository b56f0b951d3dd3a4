"""Paint the texture on the flat page, true to scale."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from restore.errors import BadInput
from restore.mesh.measures import signed_areas, vertex_normals
from restore.mesh.raster import rasterise
from restore.numerics.limits import TINY
from restore.page import FlatMesh
from restore.runtime.rows import Rows
from restore.runtime.threads import in_picture_bands
from restore.scan import Bytes, Floats, Ints, Mask
from restore.texture.resolution import Resolution, print_or_outline_mtf50
from restore.texture.sampling import sample_scaled

MM_PER_INCH = 25.4
PAPER = 255  # outside the page: white, as a copier leaves it
OVERSAMPLING_TOLERANCE = 0.05  # a source finer than the page by so small a fraction is sampled once for each pixel
LIGHT_DIRECTION = np.array([-0.4, 0.4, 0.825])  # a unit vector
MAX_PIXELS = 1_000_000_000  # a larger page is an error in units or dpi: 600 × 400 mm at 1,200 dpi has 536 million
KEPT_PIXELS = 2**24  # of a page whose map is kept, 128 MB; that of a larger one is drawn again where it is needed

PageMap = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Painting:
    """A textured page: image (h, w, 3) uint8, mask (h, w), and the source's resolution.

    source: rows (h, w, 2) float32 of the texture pixel that each pixel shows, NaN off the page.
    page_source (h, w) uint8 is the index of the picture that these are pixels of. covered (h, w) is True where
    something covers the page in a photograph. Both are None with the texture alone.
    """

    image: Bytes
    mask: Mask
    source: Rows
    resolution: Resolution
    page_source: Bytes | None = None
    covered: Mask | None = None


def paint_page(page: FlatMesh, dpi: float) -> Painting:
    """Texture a flat page at `dpi`.

    A page without texture shows the relief of its surface. The image is (h, w, 3).
    """
    if page.texture is None or page.texcoords is None:
        return _paint_relief(page, dpi)
    painter = Painter.of(page, dpi)
    height, width = painter.shape
    kept = np.empty((height, width, 2), np.float32) if height * width <= KEPT_PIXELS else None
    image, mask = np.empty((height, width, 3), np.uint8), np.empty((height, width), bool)

    def paint_band(rows: slice) -> None:
        image[rows], source = painter.paint(rows)
        mask[rows] = np.isfinite(source[..., 0])
        if kept is not None:
            kept[rows] = source

    in_picture_bands(paint_band, height, width * painter.factor**2)
    source = Rows((height, width, 2), np.float32, painter.source) if kept is None else Rows.of(kept)
    finer = float(page.provenance.get("oversampling", 1.0))  # than the picture that it was painted from

    def measured() -> float | None:
        mtf50 = texture_mtf50(page)
        return None if mtf50 is None else finer * mtf50

    return Painting(image, mask, source, Resolution(painter.ppi / finer, measured))


@dataclass(frozen=True, eq=False)
class Painter:
    """Paints the texture on a flat page at `dpi`, some rows at a time.

    shape    (h, w) of the page, pixels.
    ppi      texture pixels to the inch of paper.
    factor   by which the sides of its pixels are divided: the texture is sampled once for each part of one.
    texture  (H, W, 3) uint8, its colours continued past the sheet's edge.
    """

    page: FlatMesh
    dpi: float
    shape: tuple[int, int]
    ppi: float
    factor: int
    texture: Bytes

    @classmethod
    def of(cls, page: FlatMesh, dpi: float) -> Painter:
        """Make the painter of a page with a texture.

        Raises BadInput when the page would be too large.
        """
        assert page.texture is not None and page.texcoords is not None
        width, height = picture_size(page.flat, dpi)
        # A page coarser than its source is oversampled and block-averaged, so that no texture pixel is skipped.
        ppi = sampling_ppi(page.flat, page.faces, page.texcoords)
        factor = max(1, ceil(ppi / dpi - OVERSAMPLING_TOLERANCE))
        mixed = _mixed_edge_pixels(page)
        texture = extend_edge_colours(page.texture, page.texcoords, page.faces, mixed_pixels=mixed)
        return cls(page, dpi, (height, width), ppi, factor, np.ascontiguousarray(texture))

    def paint(self, rows: slice) -> tuple[Bytes, PageMap]:
        """Return some rows of the page (rows, w, 3), white off it, and their source (rows, w, 2)."""
        factor, middle = self.factor, self.factor // 2
        fine = slice(rows.start * factor, rows.stop * factor)
        first, end = max(fine.start - 1, 0), min(fine.stop + 1, self.shape[0] * factor)
        source = self._drawn(slice(first, end))
        own = slice(fine.start - first, fine.stop - first)
        painted, source = sample(self.texture, source, own), source[own]
        return painted if factor == 1 else _block_average(painted, factor), source[middle::factor, middle::factor]

    def source(self, rows: slice) -> PageMap:
        """Return the texture pixels (rows, w, 2) that some rows of the page show."""
        factor, middle = self.factor, self.factor // 2
        return self._drawn(slice(rows.start * factor, rows.stop * factor))[middle::factor, middle::factor]

    def _drawn(self, rows: slice) -> PageMap:
        page = self.page
        assert page.texcoords is not None
        return page_map(page.flat, page.faces, page.texcoords, self.dpi, oversampling=self.factor, rows=rows)


def texture_mtf50(page: FlatMesh) -> float | None:
    """Return the MTF50 of a page's texture, cycles per pixel.

    By the edges of print and paper; None with too few.
    """
    assert page.texture is not None and page.texcoords is not None
    covered = rasterise(page.texcoords, page.faces, np.zeros((len(page.texcoords), 1)), *page.texture.shape[:2])
    return print_or_outline_mtf50(page.texture, np.isfinite(covered[..., 0]))


def _mixed_edge_pixels(page: FlatMesh) -> int:
    """The width in pixels of the band at the sheet's edge that is mixed with the table.

    It is one, half of which is table; after super-resolution the step to the table rings as far again.
    """
    factor = int(page.provenance.get("super_resolution", {}).get("factor", 1))
    return 1 if factor == 1 else 2 * factor


def picture_size(flat: Floats, dpi: float, *, oversampling: int = 1) -> tuple[int, int]:
    """Return width and height, pixels, of a page's picture at `dpi` times `oversampling`.

    flat: (n, 2) mm.
    Raises BadInput when the page would be too large for any memory.
    """
    extents = np.ptp(flat, axis=0) * dpi / MM_PER_INCH
    width, height = (max(1, floor(extent + 0.5)) * oversampling for extent in extents)
    if width * height > MAX_PIXELS:
        raise BadInput(
            f"the page would have {width} × {height} pixels",
            "lower --dpi, or give the unit of the file with --unit, where the command has it",
        )
    return width, height


def page_map(
    flat: Floats, faces: Ints, values: Floats, dpi: float, *, oversampling: int = 1, rows: slice | None = None
) -> PageMap:
    """Interpolate values (n, k) of the vertices, such as texture pixels, on a page.

    Returns (h, w, k) float32, NaN off the page.
    flat (n, 2) mm with y up, faces (m, 3). Pixel (row, col) of the page has its centre (col + ½, row + ½) pixels from
    the upper left corner of the page's bounding box. The picture ends with the last pixels whose centres are on the
    page; `oversampling` divides the side of each of them. rows: a slice of them, all by default.
    Raises BadInput when the page would be too large for any memory.
    """
    width, height = picture_size(flat, dpi, oversampling=oversampling)
    rows = slice(0, height) if rows is None else rows
    return _drawn(flat, faces, values, dpi * oversampling, rows, width)


def _drawn(flat: Floats, faces: Ints, values: Floats, dpi: float, rows: slice, width: int) -> PageMap:
    corner = np.array([flat[:, 0].min(), flat[:, 1].max()])
    page = (flat - corner) * (np.array([1.0, -1.0]) * dpi / MM_PER_INCH) - 0.5
    picture: PageMap = rasterise(page, faces, values, rows.stop - rows.start, width, first=rows.start)
    return picture


def sampling_ppi(flat: Floats, faces: Ints, pixels: Floats) -> float:
    """The texture pixels per inch of paper, median over the area of the page.

    flat (n, 2) mm, faces (m, 3), pixels (n, 2) texture pixels.
    """
    page, source = np.abs(signed_areas(flat, faces)), np.abs(signed_areas(pixels, faces))
    return sqrt(median_over_area(source / np.maximum(page, TINY), page)) * MM_PER_INCH


def median_over_area(values: Floats, areas: Floats, *, fraction: float = 0.5) -> float:
    """Return the value that half of the area does not exceed.

    values, areas: (m,).
    fraction: of the area, the median for a half.
    """
    order = np.argsort(values)
    middle = np.searchsorted(np.cumsum(areas[order]), areas.sum() * fraction)
    return float(values[order][min(middle, len(order) - 1)])


def extend_edge_colours(texture: Bytes, texcoords: Floats, faces: Ints, *, mixed_pixels: int = 1) -> Bytes:
    """Extend the colour of the sheet past its edge in the texture.

    Pixels there are mixed with the table.
    texture: (h, w, 3).
    texcoords, faces: (n, 2) texture pixels and (m, 3), delimit the sheet.
    mixed_pixels: width of the mixed band at its edge: more than one after super-resolution, 0 where the colour is pure
        up to the edge.
    """
    covered = rasterise(texcoords, faces, np.zeros((len(texcoords), 1)), *texture.shape[:2])[..., 0]
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    pure = cv2.erode(np.isfinite(covered).astype(np.uint8), cross, iterations=mixed_pixels, borderValue=1).astype(bool)
    return nearest_colours(texture, pure) if pure.any() else texture


def nearest_colours(texture: Bytes, known: Mask) -> Bytes:
    """Fill unknown texture with the colour of the nearest known pixel.

    texture: (h, w, 3).
    known: (h, w).
    """
    nearest, unknown = distance_transform_edt(~known, return_distances=False, return_indices=True), np.nonzero(~known)
    extended = texture.copy()
    extended[unknown] = texture[tuple(nearest[:, *unknown])]
    return extended


def _paint_relief(page: FlatMesh, dpi: float) -> Painting:
    """The page as white paper lit from the upper left."""
    normals = vertex_normals(page.vertices, page.faces)
    grey = page_map(page.flat, page.faces, PAPER * np.abs(normals @ LIGHT_DIRECTION)[:, None], dpi)
    image = np.where(np.isfinite(grey), grey, PAPER).astype(np.uint8).repeat(3, axis=2)
    no_source = np.full((*grey.shape[:2], 2), np.nan, np.float32)
    return Painting(image, np.isfinite(grey[..., 0]), Rows.of(no_source), Resolution(0.0))


def _block_average(image: Bytes, factor: int) -> Bytes:
    """Average blocks of `factor` × `factor` pixels, (h // factor, w // factor, 3)."""
    size = (image.shape[1] // factor, image.shape[0] // factor)
    smaller: Bytes = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return smaller


def sample(texture: Bytes, source: PageMap, rows: slice | None = None) -> Bytes:
    """Sample the texture at positions (h, w, 2); white where they are NaN.

    Returns (h, w, 3), rounded.
    rows: those that are wanted; the kernel is as wide as the step to the rows next to them.
    """
    rows = slice(0, len(source)) if rows is None else rows
    image = np.empty((rows.stop - rows.start, source.shape[1], 3), np.uint8)
    texture = np.ascontiguousarray(texture)

    def sample_band(band: slice) -> None:
        start, stop = rows.start + band.start, rows.start + band.stop
        first = max(start - 1, 0)
        codes = sample_scaled(texture, source[first : stop + 1])[start - first : stop - first]
        codes[np.isnan(source[start:stop, :, 0])] = PAPER
        image[band] = codes + np.float32(0.5)

    in_picture_bands(sample_band, *image.shape[:2])
    return image


def rasterise_on_page(
    fine: FlatMesh, values: Floats, shape: tuple[int, ...], dpi: float, rows: slice | None = None
) -> NDArray[np.float32]:
    """Interpolate values (n, k) of the vertices on a page of a shape (h, w).

    Returns (h, w, k) float32, NaN outside.
    rows: a slice of them, all by default.
    """
    rows = slice(0, shape[0]) if rows is None else rows
    return _drawn(fine.flat, fine.faces, values, dpi, rows, shape[1])
