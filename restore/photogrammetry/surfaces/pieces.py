"""Smooth pieces of a page that creases part, from the points on it.

Neighbouring points belong to one piece when the quadratic next to the one predicts the other.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay, cKDTree

from restore.photogrammetry.surfaces.discs import Discs, fit_discs
from restore.scan import Floats, Ints, Mask

NEAREST = 8  # points determine how far points are apart
RADIUS = 3.2  # of a disc, in distances between points: thirty points, five to an unknown
CLEAN_FRACTION = 0.2  # of the discs hold no crease, even on a crumpled sheet: they determine the noise
LINKED = 2.5  # standard deviations, up to which a point is predicted
NEAR = 2.2  # distances between points: farther, a quadratic predicts nothing reliably
BEND = 0.006  # of their distance, by which points without a crease between them miss a quadratic: 6 µm to a millimetre
FAR = 4.0  # distances between points, over which a piece goes on: a line of print may be missing
MIN_NEIGHBOURS = 2  # neighbours on a piece that a point needs to be added to it
GROWN_FROM = 16  # points of the piece next to it
GROWTH_BEND = 0.02  # of the distance: half of what a crease of MIN_TURN leaves
MIN_TURN = 0.1  # radians, 6°: a crease that turns by less is as well rounded
CORE = 15  # points that make a piece
WINDOW = 4.0  # radius of those in which two pieces are compared, in distances between points
WINDOWS = 20  # along the border of two pieces
MIN_ON_EACH_SIDE = 8  # points of a window on either side of the border: more than unknowns
WORSE = 1.15  # a median of twenty such ratios of noise alone is 1 to some hundredths
CONTINUED = 3.0  # median of the predictions, where no window holds points of both pieces
CUBIC = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))  # powers of x and y
KINK = 0.018  # standard deviation that a cubic leaves of a kink of a radian with a gap of a fifth, in radii


def find_pieces(points: Floats, places: Floats) -> Ints:
    """Return the piece (n,) that each point lies on: all zero where no crease is found.

    −1 for points on none: outliers, and those on pieces that are too small.
    points: (n, 3) mm.
    places: (n, 2) mm, of the page.
    """
    spacing = _spacing(places)
    near = cKDTree(places).query_ball_point(places, RADIUS * spacing)
    starts = np.concatenate([[0], np.cumsum([len(one) for one in near])])
    members = np.concatenate([np.asarray(one, np.int64) for one in near])
    discs = Discs(*fit_discs(points, starts, members))
    if not np.isfinite(discs.misfits).any():
        return np.zeros(len(points), np.int64)
    edges = neighbours(places)
    length = np.linalg.norm(places[edges[:, 0]] - places[edges[:, 1]], axis=1)
    off = _discrepancies(discs, discs.best(starts, members), points, edges, BEND * length)
    labels = _cores(edges[(off < LINKED) & (length < NEAR * spacing)], len(points))
    labels = _grown(points, places, labels, edges[length < FAR * spacing])
    return _merged(points, places, labels, edges, off, WINDOW * spacing)


def _spacing(places: Floats) -> float:
    """Return the spacing of places (n, 2), were they a square lattice, mm."""
    distance = cKDTree(places).query(places, k=min(NEAREST + 1, len(places)))[0][:, -1]
    return float(np.median(distance) * np.sqrt(np.pi / NEAREST))


def _discrepancies(discs: Discs, best: Ints, points: Floats, edges: Ints, bends: Floats) -> Floats:
    """Return how badly the ends of edges predict each other, (k,).

    Each by its best disc (n,): the worse of the two.
    edges: (k, 2).
    """
    sigma = float(np.quantile(discs.misfits[np.isfinite(discs.misfits)], CLEAN_FRACTION))
    ways = ((edges[:, 0], edges[:, 1]), (edges[:, 1], edges[:, 0]))
    return np.maximum(*(discs.discrepancies(best[one], points[other], bends, sigma) for one, other in ways))


def neighbours(places: Floats) -> Ints:
    """Return the pairs (k, 2) of neighbouring places (n, 2), once, lower number first."""
    faces = Delaunay(places).simplices
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return np.unique(edges, axis=0)


def _cores(links: Ints, count: int) -> Ints:
    """Return labels (n,) of the points that links (k, 2) join, −1 for those of small groups."""
    graph = coo_matrix((np.ones(len(links)), (links[:, 0], links[:, 1])), (count, count))
    _, group = connected_components(graph, directed=False)
    large = np.bincount(group) >= CORE
    return np.where(large, np.cumsum(large) - 1, -1)[group]


def _grown(points: Floats, places: Floats, labels: Ints, edges: Ints) -> Ints:
    """Return labels (n,), with pieces grown by the points they predict.

    The nearest points of the piece predict them, from its rim on. Where paper bends ever more, as towards a spine, a
    disc of the usual size holds more than a quadratic.
    """
    both, labels = np.concatenate([edges, edges[:, ::-1]]), labels.copy()
    refused: set[tuple[int, int, int]] = set()
    while True:
        rim = both[(labels[both[:, 0]] < 0) & (labels[both[:, 1]] >= 0)]
        pairs, counts = np.unique(np.stack([rim[:, 0], labels[rim[:, 1]]], axis=1), axis=0, return_counts=True)
        added = labels.copy()
        for (point, piece), count in zip(pairs.tolist(), counts.tolist(), strict=True):
            if count < MIN_NEIGHBOURS or (point, piece, count) in refused:
                continue
            own = np.flatnonzero(labels == piece)
            near = own[np.argsort(((places[own] - places[point]) ** 2).sum(axis=1))[:GROWN_FROM]]
            if _predicted(points[near], points[point]):
                added[point] = piece
            else:
                refused.add((point, piece, count))
        if (added == labels).all():
            return labels
        labels = added


def _predicted(points: Floats, point: Floats) -> bool:
    """Return whether a quadratic through points predicts another point.

    points: (n, 3) mm.
    point: (3,).
    """
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    x, y, height = ((np.vstack([points, point]) - middle) @ axes.T).T
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    gram = terms[:-1].T @ terms[:-1]
    solution = np.linalg.lstsq(terms[:-1], height[:-1], rcond=None)[0]
    off = height - terms @ solution
    variance = (off[:-1] ** 2).sum() / (len(points) - terms.shape[1])
    leverage = float(terms[-1] @ np.linalg.pinv(gram) @ terms[-1])
    distance = float(np.sqrt(((points - point) ** 2).sum(axis=1)).min())
    return bool(abs(off[-1]) < 3.0 * np.sqrt(variance * (1.0 + leverage)) + GROWTH_BEND * distance)


def _merged(points: Floats, places: Floats, labels: Ints, edges: Ints, off: Floats, radius: float) -> Ints:
    """Labels (n,) with those pieces made one that one cubic follows across their border."""
    tree, misfits = cKDTree(places), dict[tuple[int, int], float]()
    while True:
        pairs = np.sort(labels[edges], axis=1)
        across = (pairs[:, 0] >= 0) & (pairs[:, 0] != pairs[:, 1])
        for a, b in np.unique(pairs[across], axis=0).tolist():
            if (a, b) not in misfits:
                between = across & (pairs == [a, b]).all(axis=1)
                border = places[edges[between]].mean(axis=1)
                windows = tree.query_ball_point(border[:: len(border) // WINDOWS + 1], radius)
                own = [np.array([i for i in window if labels[i] in (a, b)], int) for window in windows]
                found = [_misfit(points[one], labels[one] == a, radius) for one in own if _both(labels[one] == a)]
                # Across a blank area no window has points on both sides: their predictions have to do.
                misfits[a, b] = float(np.median(found) if found else np.median(off[between]) / CONTINUED)
        if not misfits or min(misfits.values()) > 1.0:
            return _numbered(labels)
        keep, gone = min(misfits, key=lambda pair: misfits[pair])
        labels = np.where(labels == gone, keep, labels)
        misfits = {pair: value for pair, value in misfits.items() if not {keep, gone} & set(pair)}


def _numbered(labels: Ints) -> Ints:
    """Labels (n,) from 0 on without gaps, −1 as it is."""
    return np.where(labels >= 0, np.unique(labels, return_inverse=True)[1] - (labels < 0).any(), -1)


def _both(first: Mask) -> bool:
    """Whether a window holds enough points of both pieces to compare them."""
    return bool(min(first.sum(), (~first).sum()) >= MIN_ON_EACH_SIDE)


def _misfit(points: Floats, first: Mask, radius: float) -> float:
    """Return a cubic's misfit of two pieces' points over that of two quadratics and bends.

    points: (n, 3) mm.
    """
    off = points - points.mean(axis=0)
    x, y, height = (off @ np.linalg.svd(off, full_matrices=False)[2].T / radius).T
    terms = np.stack([x**p * y**q for p, q in CUBIC], axis=1)
    two = np.concatenate([terms[:, :6] * first[:, None], terms[:, :6] * ~first[:, None]], axis=1)
    return _rms(terms, height) / float(np.hypot(WORSE * _rms(two, height), KINK * MIN_TURN))


def _rms(terms: Floats, values: Floats) -> float:
    """Standard deviation that a linear fit of terms (n, k) leaves of values (n,)."""
    rest = values - terms @ np.linalg.lstsq(terms, values, rcond=None)[0]
    return float(np.sqrt((rest**2).sum() / max(len(values) - terms.shape[1], 1)))
