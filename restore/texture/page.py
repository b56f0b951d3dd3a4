"""Paint the colour image on the flat page, true to scale."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, distance_transform_edt

from restore.errors import BadInput
from restore.mesh.measures import signed_areas, vertex_normals
from restore.mesh.raster import rasterise
from restore.numerics import TINY
from restore.scan import Bytes, FlatMesh, Floats, Ints, Mask
from restore.texture.sampling import sample_scaled

MM_PER_INCH = 25.4
PAPER = 255  # outside the page: white, as a copier leaves it
SLACK = 0.05  # a source this little finer than the page loses nothing that shows
LIGHT = np.array([-0.4, 0.4, 0.825])  # a unit vector
MAX_PIXELS = 400_000_000  # a page map of 3 GB; larger pages are a slip in units or in dpi

PageMap = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Painting:
    """A painted page: image (h, w, 3) uint8, mask (h, w), source (h, w, 2) texture pixels, and its resolution.

    page_source (h, w) uint8 tells which picture these are pixels of; None when there is only the texture.
    """

    image: Bytes
    mask: Mask
    source: PageMap
    resolution_ppi: float
    page_source: Bytes | None = None


def paint_page(page: FlatMesh, dpi: float) -> Painting:
    """Paint the texture of a flat page at `dpi`; a page without texture shows the relief of its surface."""
    if page.texture is None or page.texcoords is None:
        return _paint_relief(page, dpi)
    resolved = resolution(page.flat, page.faces, page.texcoords)
    # A page coarser than its source is painted finer and shrunk, so that no texture pixel is skipped.
    factor = max(1, ceil(resolved / dpi - SLACK))
    source = page_map(page.flat, page.faces, page.texcoords, dpi, finer=factor)
    texture = bleed(page.texture, page.texcoords, page.faces, mixed=_mixed(page))
    image, mask = sample(texture, source), np.isfinite(source[..., 0])
    if factor > 1:
        middle = slice(factor // 2, None, factor)
        image, mask, source = _shrink(image, factor), mask[middle, middle], source[middle, middle]
    return Painting(image, mask, source, resolved)


def _mixed(page: FlatMesh) -> int:
    """Pixels at the edge of the sheet that are not its own: half of one is table; where several shots were joined to
    finer ones, the step to the table rings on for as far again."""
    factor = int(page.provenance.get("super", {}).get("factor", 1))
    return 1 if factor == 1 else 2 * factor


def picture_size(flat: Floats, dpi: float, *, finer: int = 1) -> tuple[int, int]:
    """Width and height in pixels of the picture of a page, flat (n, 2) mm, at `dpi` times `finer`.

    Raises BadInput when the page would be too large for any memory.
    """
    extents = np.ptp(flat, axis=0) * dpi / MM_PER_INCH
    width, height = (max(1, floor(extent + 0.5)) * finer for extent in extents)
    if width * height > MAX_PIXELS:
        raise BadInput(f"the page would have {width} × {height} pixels", "check the scan's unit (mm) or lower --dpi")
    return width, height


def page_map(flat: Floats, faces: Ints, values: Floats, dpi: float, *, finer: int = 1) -> PageMap:
    """Spread values (n, k), such as texture pixels, over the page: (h, w, k) float32, NaN outside.

    flat (n, 2) mm with y up, faces (m, 3). Pixel (row, col) of the page has its centre (col + ½, row + ½) pixels from
    the upper left corner of the page's bounding box. The picture ends with the last pixels whose centres are on the
    page; `finer` divides the side of each of them.
    Raises BadInput when the page would be too large for any memory.
    """
    width, height = picture_size(flat, dpi, finer=finer)
    corner = np.array([flat[:, 0].min(), flat[:, 1].max()])
    page = (flat - corner) * (np.array([1.0, -1.0]) * dpi * finer / MM_PER_INCH) - 0.5
    picture: PageMap = rasterise(page, faces, values, height, width)
    return picture


def resolution(flat: Floats, faces: Ints, pixels: Floats) -> float:
    """What the texture really resolves on the paper: its pixels per inch, median over the page's area."""
    page, source = np.abs(signed_areas(flat, faces)), np.abs(signed_areas(pixels, faces))
    order = np.argsort(ratio := source / np.maximum(page, TINY))
    middle = np.searchsorted(np.cumsum(page[order]), page.sum() / 2)
    return float(np.sqrt(ratio[order][min(middle, len(order) - 1)]) * MM_PER_INCH)


def bleed(texture: Bytes, texcoords: Floats, faces: Ints, *, mixed: int = 1) -> Bytes:
    """The texture (h, w, 3), the colour of the sheet carried on past its edge, where half of a pixel is table.

    texcoords (n, 2) texture pixels and faces (m, 3) tell what of the texture is the sheet; `mixed` is how many pixels
    at its edge are not its own, more than one where several shots made them finer.
    """
    covered = rasterise(texcoords, faces, np.zeros((len(texcoords), 1)), *texture.shape[:2])[..., 0]
    whole = binary_erosion(np.isfinite(covered), iterations=mixed, border_value=1)
    if not whole.any():
        return texture
    rows, cols = distance_transform_edt(~whole, return_distances=False, return_indices=True)
    return texture[rows, cols]


def _paint_relief(page: FlatMesh, dpi: float) -> Painting:
    """The page as white paper lit from the upper left."""
    normals = vertex_normals(page.vertices, page.faces)
    grey = page_map(page.flat, page.faces, PAPER * np.abs(normals @ LIGHT)[:, None], dpi)
    image = np.where(np.isfinite(grey), grey, PAPER).astype(np.uint8).repeat(3, axis=2)
    nowhere = np.full((*grey.shape[:2], 2), np.nan, np.float32)
    return Painting(image, np.isfinite(grey[..., 0]), nowhere, 0.0)


def _shrink(image: Bytes, factor: int) -> Bytes:
    """Average blocks of `factor` × `factor` pixels."""
    size = (image.shape[1] // factor, image.shape[0] // factor)
    smaller: Bytes = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return smaller


def sample(texture: Bytes, source: PageMap) -> Bytes:
    """(rows, cols, 3) the texture (h, w, 3) at positions (rows, cols, 2), rounded; white where they are NaN."""
    codes = sample_scaled(np.ascontiguousarray(texture), source)
    codes[np.isnan(source[..., 0])] = PAPER
    return np.asarray(codes + np.float32(0.5)).astype(np.uint8)
