"""Paint the texture on the flat page, true to scale."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import ceil, floor, sqrt
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from restore.errors import BadInput
from restore.mesh.measures import signed_areas, vertex_normals
from restore.mesh.raster import rasterise
from restore.numerics.limits import TINY
from restore.page import FlatMesh
from restore.runtime.threads import in_bands, in_threads
from restore.scan import Bytes, Floats, Ints, Mask
from restore.texture.resolution import Resolution, print_or_outline_mtf50
from restore.texture.sampling import sample_scaled

MM_PER_INCH = 25.4
PAPER = 255  # outside the page: white, as a copier leaves it
OVERSAMPLING_TOLERANCE = 0.05  # a source finer than the page by so small a fraction is sampled once for each pixel
LIGHT_DIRECTION = np.array([-0.4, 0.4, 0.825])  # a unit vector
MAX_PIXELS = 400_000_000  # a page map of 3 GB; a larger page is an error in units or dpi

PageMap = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Painting:
    """Textured page.

    image: (h, w, 3) uint8.
    mask: (h, w).
    source: (h, w, 2), texture pixels, with the source's resolution.
    page_source: (h, w) uint8, index of the picture that these are pixels of; None with the texture alone.
    covered: (h, w), True where something covers the page in a photograph; None with the texture alone.
    """

    image: Bytes
    mask: Mask
    source: PageMap
    resolution: Resolution
    page_source: Bytes | None = None
    covered: Mask | None = None


def paint_page(page: FlatMesh, dpi: float) -> Painting:
    """Texture a flat page at `dpi`.

    A page without texture shows the relief of its surface. The image is (h, w, 3).
    """
    if page.texture is None or page.texcoords is None:
        return _paint_relief(page, dpi)
    tasks: tuple[Callable[[], Any], ...] = (partial(_paint_texture, page, dpi), partial(texture_mtf50, page))
    (image, mask, source, ppi), mtf50 = in_threads(lambda task: task(), tasks)
    finer = float(page.provenance.get("oversampling", 1.0))  # than the picture that it was painted from
    return Painting(image, mask, source, Resolution(ppi / finer, None if mtf50 is None else finer * mtf50))


def _paint_texture(page: FlatMesh, dpi: float) -> tuple[Bytes, Mask, PageMap, float]:
    """Draw the texture on a flat page at `dpi`.

    Returns image, mask and source as in `Painting`, pixels per inch.
    """
    assert page.texture is not None and page.texcoords is not None
    ppi = sampling_ppi(page.flat, page.faces, page.texcoords)
    # A page coarser than its source is oversampled and block-averaged, so that no texture pixel is skipped.
    factor = max(1, ceil(ppi / dpi - OVERSAMPLING_TOLERANCE))
    source = page_map(page.flat, page.faces, page.texcoords, dpi, oversampling=factor)
    texture = extend_edge_colours(page.texture, page.texcoords, page.faces, mixed_pixels=_mixed_edge_pixels(page))
    image, mask = sample(texture, source), np.isfinite(source[..., 0])
    if factor > 1:
        middle = slice(factor // 2, None, factor)
        image, mask, source = _block_average(image, factor), mask[middle, middle], source[middle, middle]
    return image, mask, source, ppi


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
    """Return width and height in pixels of the picture of a page.

    At `dpi` times `oversampling`.
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


def page_map(flat: Floats, faces: Ints, values: Floats, dpi: float, *, oversampling: int = 1) -> PageMap:
    """Interpolate values of the vertices over the page.

    Pixel (row, col) of the page has its centre (col + ½, row + ½) pixels from the upper left corner of the page's
    bounding box. The picture ends with the last pixels whose centres are on the page.
    flat: (n, 2) mm, y up.
    faces: (m, 3).
    values: (n, k), such as texture pixels.
    oversampling: divides the side of each pixel.
    Returns (h, w, k) float32, NaN off the page. Raises BadInput when the page would be too large for any memory.
    """
    width, height = picture_size(flat, dpi, oversampling=oversampling)
    corner = np.array([flat[:, 0].min(), flat[:, 1].max()])
    page = (flat - corner) * (np.array([1.0, -1.0]) * dpi * oversampling / MM_PER_INCH) - 0.5
    picture: PageMap = rasterise(page, faces, values, height, width)
    return picture


def sampling_ppi(flat: Floats, faces: Ints, pixels: Floats) -> float:
    """The texture pixels per inch of paper, median over the area of the page.

    flat (n, 2) mm, faces (m, 3), pixels (n, 2) texture pixels.
    """
    page, source = np.abs(signed_areas(flat, faces)), np.abs(signed_areas(pixels, faces))
    return sqrt(median_over_area(source / np.maximum(page, TINY), page)) * MM_PER_INCH


def median_over_area(values: Floats, areas: Floats, *, share: float = 0.5) -> float:
    """Return the value that half of the area does not exceed.

    values, areas: (m,).
    share: another fraction of the area.
    """
    order = np.argsort(values)
    middle = np.searchsorted(np.cumsum(areas[order]), areas.sum() * share)
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
    return Painting(image, np.isfinite(grey[..., 0]), no_source, Resolution(0.0))


def _block_average(image: Bytes, factor: int) -> Bytes:
    """Average blocks of `factor` × `factor` pixels.

    Returns (h // factor, w // factor, 3).
    """
    size = (image.shape[1] // factor, image.shape[0] // factor)
    smaller: Bytes = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return smaller


def sample(texture: Bytes, source: PageMap) -> Bytes:
    """Sample a texture at positions, rounded; white where they are NaN.

    texture: (h, w, 3).
    source: (rows, cols, 2).
    Returns (rows, cols, 3).
    """
    texture, image = np.ascontiguousarray(texture), np.empty((*source.shape[:2], 3), np.uint8)

    def sample_band(rows: slice) -> None:
        first = max(rows.start - 1, 0)  # the width of the kernel is that of the step to the neighbouring rows
        codes = sample_scaled(texture, source[first : rows.stop + 1])[rows.start - first : rows.stop - first]
        codes[np.isnan(source[rows, :, 0])] = PAPER
        image[rows] = codes + np.float32(0.5)

    in_bands(sample_band, len(source))
    return image


def rasterise_on_page(fine: FlatMesh, values: Floats, shape: tuple[int, ...], dpi: float) -> NDArray[np.float32]:
    """Interpolate values of the vertices at the pixels of a page.

    values: (n, k).
    Returns (h, w, k) float32 of a shape (h, w), NaN outside.
    """
    return crop_or_pad(page_map(fine.flat, fine.faces, values, dpi), shape)


def crop_or_pad(field: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Crop a field (h, w, k), or pad it with NaN, to a shape (h, w).

    The shape may have been rounded otherwise.
    """
    if field.shape[:2] == shape:
        return field
    more = [(0, max(0, wanted - size)) for wanted, size in zip(shape, field.shape, strict=False)]
    full = np.pad(field, [*more, (0, 0)], constant_values=np.nan)
    return np.ascontiguousarray(full[: shape[0], : shape[1]])
