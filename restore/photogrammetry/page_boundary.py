"""The page's edge as a curve in space, a step from paper to table.

It is found in the photographs. Where a page ends print to track is missing, and a surface prolonged from the print is
off by millimetres at the edge of a wave. But the edge itself is seen in every view. Across it, the place of the step in
a view gives one equation for how far the edge is from where it was assumed, outwards and out of the page; three views
determine both. What no view shows is drawn from the measured parts next to it (`boundary_gaps`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from restore.camera.photo_camera import PhotoCamera, project_with_jacobian
from restore.numerics.limits import TINY
from restore.photogrammetry.boundary_gaps import SPACING_MM, at_corners, bridged, scattered, straightened
from restore.photogrammetry.page import PaperMasks
from restore.photogrammetry.surfaces.page_surface import PageSurface
from restore.photogrammetry.track import Picture
from restore.scan import Floats, Ints, Mask

SMOOTH_MM = 3.0  # standard deviation, along the edge, of what is assumed at first: cells of a millimetre are ragged
# How far is searched on both sides, mm, and the fraction of it from the median of its neighbours beyond which a step is
# rejected. A margin that a crease turns away from its page is off by as much as is searched in
# the masks, which are off by some of their pixels. The zigzag of a page of many creases is far from its median, too,
# until it has been followed.
MASK_SEARCH = (16.0, 0.25)
SEARCHES = ((5.0, 0.5), (1.5, 0.25), (1.5, 0.25))
SAMPLES = 41  # across the edge
ALONG = (-1.0, -0.5, 0.0, 0.5, 1.0)  # mm along the edge, over which the picture is averaged
FACING = 0.2  # cosine of 78° between the normal and the line of sight
MIN_STEP = 0.12  # of the light of the paper, that the table gives less
MIN_VIEWS = 2  # as many equations as unknowns: a side that stands upright may have no more
MISFIT = 0.25  # of the reach: a view whose step is further from the others' shows something else
MAX_SIGMA = 0.5  # of the reach, out of the page: views from one side do not determine it
OUT_OF_PAGE = 0.3  # of a view whose step moves as far as the edge moves out of the page: each reach begins near it
NEIGHBOURS = 15  # points: 30 mm of the edge


@dataclass(frozen=True, eq=False)
class Edge:
    """Points round the page, counter-clockwise.

    points: (n, 3) mm.
    places: (n, 2) mm, on the page.
    measured: (n,), which are measured.
    """

    points: Floats
    places: Floats
    measured: Mask


def find_edge(
    masks: PaperMasks, greys: Picture, cameras: Sequence[PhotoCamera], surface: PageSurface, outline: Floats
) -> Edge:
    """Find the edge of a page near an outline (n, 2) mm on its surface.

    Masks distinguish paper from table, where a crease may be as dark a step in greys. No view shows an edge next to
    which the card may lie.
    greys: (v, h, w), may be smaller copies of what the cameras took.
    """
    edge = find_rough_edge(masks, cameras, surface, outline)
    for search in SEARCHES:
        edge = _refined(greys, masks.unknown, cameras, surface, edge, *search)
    measured = edge.measured & ~scattered(edge.points, edge.measured)
    measured &= ~at_corners(edge.points)
    points = bridged(edge.points, measured)
    places, straight = straightened(surface.feet(points, edge.places), measured)
    return Edge(np.where(straight[:, None], surface.points(places), points), places, measured)


def find_rough_edge(masks: PaperMasks, cameras: Sequence[PhotoCamera], surface: PageSurface, outline: Floats) -> Edge:
    """Find the edge of a page in masks alone, near an outline (n, 2) mm.

    It is good to a part of their pixels.
    """
    places = _smoothed(_resampled(outline, SPACING_MM), SMOOTH_MM / SPACING_MM)
    edge = Edge(surface.points(places), places, np.zeros(len(places), bool))
    return _refined(masks.masks, masks.unknown, cameras, surface, edge, *MASK_SEARCH)


def _refined(
    greys: Floats | Picture,
    unknown: Mask,
    cameras: Sequence[PhotoCamera],
    surface: PageSurface,
    edge: Edge,
    reach: float,
    lonely: float,
) -> Edge:
    """Measure the edge again, within a reach, mm.

    Steps that are lonely by a fraction of it are dropped.
    unknown: (v, h, w), where views do not count, as in `PaperMasks`.
    """
    points = edge.points
    along, outwards, normals = _directions(edge, surface)
    steps, weights, rows = [], [], []
    for grey, hidden, camera in zip(greys, unknown, cameras, strict=True):
        ends = _first_unknown(hidden, camera.scaled(hidden.shape[::-1]), points, outwards, reach)
        place, certain = _step_places(grey, camera.scaled(grey.shape[::-1]), points, along, outwards, reach, ends)
        out_of_page, away = _sensitivities(camera, points, along, outwards, normals)
        ways = camera.position - points
        facing = (ways * normals).sum(axis=1) / np.linalg.norm(ways, axis=1)
        steps.append(place)
        weights.append(certain & (facing > FACING))
        rows.append(np.stack([out_of_page / np.where(np.abs(away) > TINY, away, TINY), np.ones(len(points))], axis=1))
    moves, good = _solved(np.stack(rows), np.stack(steps), np.stack(weights), reach)
    usual = _usual(moves, good)
    good &= (np.abs(moves - usual) < lonely * reach).all(axis=1)
    moves = _filled(np.where(good[:, None], moves, usual), np.asarray(np.isfinite(usual).all(axis=1)))
    moved = points + moves[:, :1] * normals + moves[:, 1:] * outwards
    return replace(edge, points=moved, places=surface.feet(moved, edge.places), measured=good)


def _directions(edge: Edge, surface: PageSurface) -> tuple[Floats, Floats, Floats]:
    """Unit vectors (n, 3) along the edge, outwards on the surface, and out of the page."""
    points, normals = edge.points, surface.normals(edge.places)
    along = np.roll(points, -2, axis=0) - np.roll(points, 2, axis=0)
    along -= normals * (along * normals).sum(axis=1, keepdims=True)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), TINY)
    return along, np.cross(along, normals), normals


def _step_places(
    grey: Floats | Picture,
    camera: PhotoCamera,
    points: Floats,
    along: Floats,
    outwards: Floats,
    reach: float,
    ends: Ints,
) -> tuple[Floats, Mask]:
    """Return where the picture steps most from light to dark, (n,) mm.

    Outwards from points (n, 3), and whether it does, (n,). Of the SAMPLES across the edge those before the ends (n,)
    count.
    """
    across = np.linspace(-reach, reach, SAMPLES)
    profile = np.zeros((len(points), SAMPLES))
    for shift in ALONG:
        at = points[:, None] + shift * along[:, None] + across[:, None] * outwards[:, None]
        pixels = camera.project(at.reshape(-1, 3))
        values = ndimage.map_coordinates(grey, pixels[:, ::-1].T, order=1, mode="constant", cval=np.nan)
        profile += values.reshape(profile.shape) / len(ALONG)
    last = np.minimum(np.arange(SAMPLES), np.maximum(ends - 1, 0)[:, None])
    profile = np.take_along_axis(profile, last, axis=1)  # what lies beyond is not a step
    slope = ndimage.gaussian_filter1d(profile, 1.0, axis=1, order=1, mode="nearest")
    known = np.isfinite(slope).all(axis=1)
    slope = np.where(known[:, None], slope, 0.0)
    best = np.clip(slope.argmin(axis=1), 1, SAMPLES - 2)
    number = np.arange(len(points))
    left, middle, right = (slope[number, best + k] for k in (-1, 0, 1))
    curved = left - 2 * middle + right
    fraction = np.where(curved > TINY, 0.5 * (left - right) / np.where(curved > TINY, curved, 1.0), 0.0)
    light = np.where(known[:, None], profile, 0.0)
    inside = np.array([row[: k + 1].max() for row, k in zip(light, best, strict=True)])
    outside = np.array([np.median(row[k + 1 :]) for row, k in zip(light, best, strict=True)])
    interior = (best > 1) & (best < ends - 2)
    certain = known & interior & (inside - outside > MIN_STEP * np.maximum(inside, TINY))
    return across[best] + np.clip(fraction, -1, 1) * (across[1] - across[0]), certain


def _first_unknown(unknown: Mask, camera: PhotoCamera, points: Floats, outwards: Floats, reach: float) -> Ints:
    """Return the first of the SAMPLES across the edge that is unknown, (n,).

    unknown: (h, w). points: (n, 3). SAMPLES where all are known.
    """
    if not unknown.any():
        return np.full(len(points), SAMPLES)
    at = points[:, None] + np.linspace(-reach, reach, SAMPLES)[:, None] * outwards[:, None]
    pixels = camera.project(at.reshape(-1, 3))
    met = ndimage.map_coordinates(unknown, pixels[:, ::-1].T, order=0, mode="constant", cval=False)
    met = met.reshape(len(points), SAMPLES)
    return np.where(met.any(axis=1), met.argmax(axis=1), SAMPLES)


def _sensitivities(
    camera: PhotoCamera, points: Floats, along: Floats, outwards: Floats, normals: Floats
) -> tuple[Floats, Floats]:
    """Return how far the edge's picture moves across itself, pixels.

    For a millimetre out of the page, and for one outwards, (n,) each.
    """
    _, jacobian = project_with_jacobian(camera.vector, points)
    by_point = jacobian[:, :, 3:6] @ camera.rotation
    ahead, out, away = (np.einsum("nij,nj->ni", by_point, vectors) for vectors in (along, normals, outwards))
    across = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), TINY)
    return (across * out).sum(axis=1), (across * away).sum(axis=1)


def _solved(rows: Floats, steps: Floats, usable: Mask, reach: float) -> tuple[Floats, Mask]:
    """Solve for the moves (n, 2) out of the page and outwards, mm.

    They explain the steps (v, n) of the views. Views that disagree are left out one after the other.
    rows: (v, n, 2), the equations.
    usable: (v, n).
    Returns also where they do, (n,).
    """
    usable = usable.copy()
    count = steps.shape[1]
    number = np.arange(count)
    for _ in range(len(steps)):
        weight = usable.astype(float)
        gram = np.einsum("vn,vni,vnj->nij", weight, rows, rows)
        side = np.einsum("vn,vni,vn->ni", weight, rows, steps)
        inverse = np.linalg.inv(gram + TINY * np.eye(2) + np.diag([OUT_OF_PAGE, 1e-6]))
        moves = np.einsum("nij,nj->ni", inverse, side)
        misfit = np.where(usable, np.abs(np.einsum("vni,ni->vn", rows, moves) - steps), 0.0)
        worst = misfit.argmax(axis=0)
        bad = (misfit[worst, number] > MISFIT * reach) & (usable.sum(axis=0) > MIN_VIEWS)
        if not bad.any():
            break
        usable[worst[bad], number[bad]] = False
    spread = np.sqrt((misfit**2).sum(axis=0) / np.maximum(usable.sum(axis=0) - 2, 1))
    sigma = np.sqrt(inverse[:, 0, 0]) * np.maximum(spread, 0.02 * reach)
    good = (usable.sum(axis=0) >= MIN_VIEWS) & (misfit.max(axis=0) <= MISFIT * reach) & (sigma < MAX_SIGMA * reach)
    return moves, good & (np.abs(moves) < 2 * reach).all(axis=1)


def _usual(moves: Floats, good: Mask) -> Floats:
    """Return the median (n, 2) of good moves about each.

    moves: (n, 2). NaN without good ones.
    """
    index = (np.arange(len(moves))[:, None] + np.arange(-(NEIGHBOURS // 2), NEIGHBOURS // 2 + 1)) % len(moves)
    near = np.where(good[index][..., None], moves[index], np.nan)
    some = good[index].any(axis=1)
    median = np.full_like(moves, np.nan)
    median[some] = np.nanmedian(near[some], axis=1)
    return median


def _filled(moves: Floats, known: Mask) -> Floats:
    """Moves (n, 2), those that are not known (n,) interpolated along the closed edge."""
    if not known.any():
        return np.zeros_like(moves)
    number, count = np.arange(len(moves)), len(moves)
    return np.stack([np.interp(number, number[known], column[known], period=count) for column in moves.T], axis=1)


def _resampled(outline: Floats, spacing: float) -> Floats:
    """Resample a closed outline (m, 2) at a spacing, (n, 2)."""
    closed = np.vstack([outline, outline[:1]])
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    at = np.linspace(0, length[-1], max(round(length[-1] / spacing), 8), endpoint=False)
    return np.stack([np.interp(at, length, column) for column in closed.T], axis=1)


def _smoothed(places: Floats, sigma: float) -> Floats:
    """Smooth a closed outline by sigma points, (n, 2)."""
    return np.asarray(ndimage.gaussian_filter1d(places, sigma, axis=0, mode="wrap"))
