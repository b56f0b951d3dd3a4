"""Picture that each part of the page is textured from, decided on a coarse copy.

Source 0 is the scanner's colour image, source k the k-th photograph.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from restore.camera.photo_camera import PhotoCamera
from restore.mesh.measures import vertex_normals
from restore.numerics.limits import SINGLE_TINY
from restore.numerics.srgb import LINEAR
from restore.page import FlatMesh
from restore.photo.coarse import COARSE_DPI, CoarseView, Placed, blurred_widely
from restore.photo.consensus import consensus
from restore.photo.obstructions import MARGIN_MM, compare, covered_mask
from restore.photo.visible import clipped_fraction, glare_mask, visible_points
from restore.runtime.threads import in_threads
from restore.scan import Bytes, Floats, Mask
from restore.texture.occlusion import occluded, viewpoint
from restore.texture.page import MM_PER_INCH, page_map
from restore.texture.resolution import resolved_fraction

FEATHER_MM = 3.0  # of a seam: wide enough that light does not jump, narrow enough that print is not seen twice
MATCH_MM = 8.0  # light is matched over this, which is wider than a line of print
FAR_MM = 60.0  # where the pictures do not overlap, the match is carried from this far
GLARE_MM = 25.0  # surroundings of a glare
SETTLE_MM = 5.0  # changes of the better photograph over less than this are not worth a seam
MAX_GAIN = 8.0  # between the light of two pictures; more is a hole in one of them


@dataclass(frozen=True, eq=False)
class Source:
    """Picture and how the page lies in it.

    camera: of a photograph, None for the scanner's texture.
    mtf50: of a photograph's edges, cycles per pixel, None where it has too few to measure it.
    """

    image: Bytes
    camera: PhotoCamera | None = None
    mtf50: float | None = None

    @property
    def fraction(self) -> float:
        """The ideal pixels to one of its own."""
        return resolved_fraction(self.mtf50)


@dataclass(frozen=True, eq=False)
class Plan:
    """What to texture from, on a coarse page of COARSE_DPI.

    weights: (s, h, w) float32, fraction of each source, in sum 1.
    gains: (s, h, w, 3) float32, factor on the linear light of each source, so that seams do not show.
    ppi: (s, h, w), pixels per inch that each source has there.
    covered: (s, h, w), True where something covers the page in a source.
    """

    weights: NDArray[np.float32]
    gains: NDArray[np.float32]
    ppi: NDArray[np.float32]
    covered: Mask


def plan(page: FlatMesh, sources: Sequence[Source]) -> Plan:
    """Decide for each part of a page what it is textured from.

    sources[0] is the scanner's texture. The page is an image (h, w, 3).
    """
    assert page.texcoords is not None
    values = np.column_stack([page.vertices, vertex_normals(page.vertices, page.faces), page.texcoords])
    coarse = page_map(page.flat, page.faces, values, COARSE_DPI).astype(np.float64)
    inside = np.isfinite(coarse[..., 0])
    scanned = _coarse_view(Placed.at(sources[0].image, coarse[..., 6:], inside), inside)
    known = inside & ~_hidden_from_scanner(page, inside.shape)
    shown = in_threads(lambda source: _photographed(source, page, coarse, inside), sources[1:])
    normals = coarse[..., 3:6]
    usual = consensus([view for view, _ in shown], replace(scanned, good=known), normals)
    views = in_threads(lambda one: _without_covered(*one, usual, normals), shown)
    views = [scanned, *_without_contradictions(views, normals, inside & ~usual.good)]
    weights = _weights(views, [source.fraction for source in sources], inside)
    ppi = np.stack([view.ppi for view in views]).astype(np.float32)
    return Plan(weights.astype(np.float32), _gains(views, weights), ppi, np.stack([view.covered for view in views]))


def _hidden_from_scanner(page: FlatMesh, shape: tuple[int, ...]) -> Mask:
    """Return where the texture shows another part of the page: that part occludes it.

    Returns (h, w) bool, on the coarse page.
    """
    centre = viewpoint(page)
    return np.zeros(shape, bool) if centre is None else occluded(page, centre, shape, COARSE_DPI)()


def _without_contradictions(views: Sequence[CoarseView], normals: Floats, unknown: Mask) -> list[CoarseView]:
    """Return the views without the parts where photographs contradict.

    Neither view is good where two contradict each other and the scanner saw nothing. Views are (h, w).
    """
    good = [view.good.copy() for view in views]
    for j, k in combinations(range(len(views)), 2):
        both = views[j].good & views[k].good
        if not (both & unknown).any():
            continue
        resolved = views[j].resolved & views[k].resolved
        contradicted = compare(views[j].light, views[k].light, normals, both, resolved).contradicted & unknown
        reach = distance_transform_edt(~contradicted) <= MARGIN_MM / MM_PER_INCH * COARSE_DPI
        for n in (j, k):
            good[n] &= ~(reach & unknown)
    return [
        replace(view, good=kept, covered=view.covered | (view.good & ~kept))
        for view, kept in zip(views, good, strict=True)
    ]


def _coarse_view(placed: Placed, good: Mask) -> CoarseView:
    codes = placed.read(cv2.resize(placed.image, placed.size, interpolation=cv2.INTER_AREA))
    return CoarseView(good, placed.ppi, LINEAR[codes].astype(np.float64), np.zeros_like(good), placed.resolved)


def _photographed(source: Source, page: FlatMesh, coarse: Floats, inside: Mask) -> tuple[CoarseView, Floats]:
    """Return what a photograph shows of the coarse page, and the clipped fraction (h, w)."""
    camera = source.camera
    assert camera is not None
    points, normals = coarse[inside][:, :3], coarse[inside][:, 3:6]
    pixels, good = np.full((*inside.shape, 2), np.nan), np.zeros(inside.shape, bool)
    pixels[inside] = camera.project(points)
    good[inside] = visible_points(camera, page.vertices, page.faces, points, normals)
    placed = Placed.at(source.image, pixels, good)
    return _coarse_view(placed, good), placed.read(clipped_fraction(source.image, placed.size))


def _without_covered(view: CoarseView, clipped: Floats, usual: CoarseView, normals: Floats) -> CoarseView:
    """A view without what covers the page in it, or is mirrored there.

    clipped: (h, w), fraction of its pixels.
    usual: what the page is compared with.
    """
    reach = GLARE_MM / MM_PER_INCH * COARSE_DPI
    glare = glare_mask(clipped, view.light.mean(axis=2), usual.light.mean(axis=2), view.good, reach)
    glare = cv2.dilate(glare.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    resolved = view.resolved & usual.resolved
    covered = covered_mask(view.light, usual.light, normals, view.good, usual.good, resolved, glare)
    return replace(view, good=view.good & ~covered, covered=covered)


def _weights(views: Sequence[CoarseView], fractions: Sequence[float], inside: Mask) -> Floats:
    """Return the weight (s, h, w) of each source: the best-resolved photograph, or scanner.

    fractions: the ideal pixels to a pixel of each source.
    """
    pixels_per_mm = COARSE_DPI / MM_PER_INCH
    edges = [_feathered(view.good, inside, FEATHER_MM * pixels_per_mm) for view in views[1:]]
    smoothed = [
        cv2.GaussianBlur(np.where(view.good, fraction * view.ppi, 0.0), (0, 0), SETTLE_MM * pixels_per_mm)
        for view, fraction in zip(views[1:], fractions[1:], strict=True)
    ]
    best = np.argmax([np.where(edge > 0, ppi, -1.0) for edge, ppi in zip(edges, smoothed, strict=True)], axis=0)
    chosen = [
        edge * (cv2.GaussianBlur((best == k).astype(float), (0, 0), FEATHER_MM / 2 * pixels_per_mm) + SINGLE_TINY)
        for k, edge in enumerate(edges)
    ]
    covered = np.max(edges, axis=0)
    photographs = np.stack(chosen) / np.maximum(np.sum(chosen, axis=0), SINGLE_TINY**2) * covered
    weights = np.concatenate([1.0 - covered[None], photographs])
    rows, cols = distance_transform_edt(~inside, return_distances=False, return_indices=True)
    return np.asarray(weights[:, rows, cols])


def _feathered(good: Mask, inside: Mask, width: float) -> Floats:
    """Return 0 where a source is not good, rising to 1 within `width` pixels.

    The border of the page is not a seam.
    """
    away = distance_transform_edt(np.pad(good | ~inside, 1, constant_values=True))[1:-1, 1:-1]
    return np.where(good, np.clip((away - 1.0) / width, 0.0, 1.0), 0.0)


def _gains(views: Sequence[CoarseView], weights: Floats) -> NDArray[np.float32]:
    """Return the gains (s, h, w, 3) that match all sources.

    The light of the photograph that is used most stays.
    """
    main = 1 + int(np.argmax(weights[1:].sum(axis=(1, 2))))
    gains = np.ones((*weights.shape, 3), np.float32)
    known = views[main]
    if not known.good.any():
        return gains
    gains[0] = _gain(views[0].light, known.light, views[0].good & known.good)
    whole = np.where(known.good[..., None], known.light, views[0].light * gains[0])
    for k in range(1, len(views)):
        if k != main and views[k].good.any():
            gains[k] = _gain(views[k].light, whole, views[k].good)
    return gains


def _gain(light: Floats, wanted: Floats, both: Mask) -> Floats:
    """Return the gain (h, w, 3) from light to the wanted light, from where both are known."""
    total, given = np.zeros_like(light), np.zeros_like(light)
    mask = both[..., None].astype(float)
    for width, fraction in ((MATCH_MM, 1.0), (FAR_MM, 1e-3)):
        sigma = width / MM_PER_INCH * COARSE_DPI
        total += fraction * blurred_widely(wanted * mask, sigma)
        given += fraction * blurred_widely(light * mask, sigma)
    mean = (wanted * mask).sum(axis=(0, 1)) / np.maximum((light * mask).sum(axis=(0, 1)), SINGLE_TINY)
    return np.asarray(np.clip((total + SINGLE_TINY * mean) / (given + SINGLE_TINY), 1 / MAX_GAIN, MAX_GAIN))
