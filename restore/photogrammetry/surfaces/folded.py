"""A page of several smooth pieces that meet at creases: a smooth surface rounds a crease.

Each piece is fitted by itself instead and prolonged as paper is; at every place the page is the piece that is nearest
to the smooth surface there, and the nearest changes where two pieces meet.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from restore.mesh.ordered_grid import grid_faces
from restore.photogrammetry.cameras.align import Similarity
from restore.photogrammetry.errors import SheetLost
from restore.photogrammetry.surfaces.crease import find_crease
from restore.photogrammetry.surfaces.lattice import Cloud
from restore.photogrammetry.surfaces.pieces import CORE, find_pieces, neighbours
from restore.photogrammetry.surfaces.surface import (
    REFINING_MM,
    STIFFNESSES,
    Paper,
    Surface,
    choose_paper,
    fit_paper,
    fit_surface,
    grid_places,
    through_places,
)
from restore.report import SurfaceReport
from restore.scan import Floats, Ints, Mask

PROLONGED_MM = 12.0  # beyond the points of a piece: a crease is as far where print ends before it
CANDIDATES_MM = 8.0  # beyond the nearest point: pieces with points so near may reach a place
FILLED_MM = 4.0  # lattice of the pieces through which the smooth surface is fitted again
SMOOTH_STIFFNESS = 10.0  # mm⁴: of the smooth surface, which is to round the creases as little as its knots allow
FILLINGS = 2  # the first leaves the smooth surface a few millimetres off next to a crease, the second half of one
UNCREASED = 1.0  # strain: a piece resists all of it, because it has no crease
RULED = 1e6  # next to a straight crease paper is ruled along it, or flat: there the points of all rows count for each
PAPERS = tuple(Paper(stiffness, along, UNCREASED) for along in (RULED, 1.0) for stiffness in (*STIFFNESSES, 1.0))
PAIRS = 6  # of points on either side that determine the direction of a crease
MIN_CREASE = 0.12  # radians, 7°: pieces that meet at less are one
MIN_FRACTION = 0.08  # of the points: a page folded in three both ways has facets of 0.11
MIN_COVERED = 0.8  # of the points, by pieces as large
CREASE_MM = 20.0  # from a crease: as far as the gutter of a book bends
GUTTER_MM = PROLONGED_MM + CREASE_MM  # from the print behind a crease: there the crease may be as far before it
ROW_MM = 1.0  # of the points along a row across a crease, and of the rows
CREASE_COUNT = 5  # ends of two lines of a ruled sheet, against the rows of print on the rest of each
MEETING_STEPS = 5  # of Newton's method to a crease
MIN_MEETING = 0.1  # of the largest singular value: pieces that meet at less than 11° leave the place along them open


@dataclass(frozen=True, eq=False)
class Piece:
    """Smooth surface over places that are rotated.

    turn: (2, 2), takes the page's places to the surface's.
    """

    surface: Surface
    turn: Floats

    def points(self, places: Floats) -> Floats:
        """Return points (n, 3) mm at places (n, 2) mm of the page."""
        return self.surface.points(places @ self.turn.T)

    def normals(self, places: Floats) -> Floats:
        """Return unit normals (n, 3) at places (n, 2) mm of the page."""
        return self.surface.normals(places @ self.turn.T)

    def frames(self, places: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return points, tangents, normals and curvatures at places (n, 2) mm.

        They are (n, 3) mm, (n, 2, 3), (n, 3) and (n, 3) 1/mm.
        """
        return self.surface.frames(places @ self.turn.T)

    def feet(self, points: Floats, start: Floats) -> Floats:
        """Return places (n, 2) mm of the page next to points (n, 3) mm.

        start: (n, 2), places to search from.
        """
        return np.asarray(self.surface.feet(points, start @ self.turn.T) @ self.turn)

    def moved(self, similarity: Similarity) -> Piece:
        """The piece in another frame; its places stay as they are."""
        return replace(self, surface=self.surface.moved(similarity))


@dataclass(frozen=True, eq=False)
class FoldedSurface:
    """Smooth pieces over the places of one smooth surface.

    That surface rounds the creases between them.
    smooth: that surface.
    pieces: surfaces over places that are near those of the smooth one.
    places: (n, 2) mm, of points of the page.
    labels: (n,), the pieces that they lie on.
    members: (n,), which of all points these are.
    paper: of the pieces.
    """

    smooth: Surface
    pieces: tuple[Piece, ...]
    places: Floats
    labels: Ints
    members: Ints
    paper: Paper

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """The rectangle from low (2,) to high (2,) mm of the smooth surface."""
        return self.smooth.bounds

    @property
    def piece_count(self) -> int:
        """How many smooth pieces it has."""
        return len(self.pieces)

    def located(self, places: Floats) -> tuple[Ints, Floats]:
        """Return the nearest piece at places of the smooth surface.

        places: (n, 2) mm. Returns piece (n,) and the place (n, 2) mm on it.
        """
        return self.nearest(self.smooth.points(places), places)

    def nearest(self, points: Floats, places: Floats) -> tuple[Ints, Floats]:
        """Return the nearest piece to points, and the place next to each.

        points: (n, 3) mm, about places (n, 2) mm. Returns (n,) and (n, 2) mm.
        """
        least, label, feet = np.full(len(places), np.inf), np.zeros(len(places), np.int64), np.array(places, float)
        for k, near in enumerate(self._candidates(places).T):
            at = np.flatnonzero(near)
            found = self.pieces[k].feet(points[at], places[at])
            distance = np.linalg.norm(self.pieces[k].points(found) - points[at], axis=1)
            nearer = distance < least[at]
            chosen = at[nearer]
            least[chosen], label[chosen], feet[chosen] = distance[nearer], k, found[nearer]
        return label, feet

    def points(self, places: Floats) -> Floats:
        """Return points (n, 3) mm on the nearest pieces to places (n, 2) mm."""
        label, feet = self.located(places)
        return self._gathered(label, [piece.points(feet[label == k]) for k, piece in enumerate(self.pieces)])

    def normals(self, places: Floats) -> Floats:
        """Return unit normals (n, 3) at places (n, 2) mm, of the piece there."""
        label, feet = self.located(places)
        return self._gathered(label, [piece.normals(feet[label == k]) for k, piece in enumerate(self.pieces)])

    def frames(self, places: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return points, tangents, normals and curvatures at places (n, 2) mm.

        They are (n, 3) mm, (n, 2, 3), (n, 3) and (n, 3) 1/mm, as in `Surface.frames`.
        """
        label, feet = self.located(places)
        frames = [piece.frames(feet[label == k]) for k, piece in enumerate(self.pieces)]
        fields = zip(*frames, strict=True)
        point, tangents, normals, curvatures = (self._gathered(label, list(field)) for field in fields)
        return point, tangents, normals, curvatures

    def feet(self, points: Floats, start: Floats) -> Floats:
        """Return places (n, 2) mm next to points (n, 3) mm.

        start: (n, 2), places to search from.
        """
        return self.smooth.feet(points, start)

    def moved(self, similarity: Similarity) -> FoldedSurface:
        """The surface in another frame; its places stay as they are."""
        pieces = tuple(piece.moved(similarity) for piece in self.pieces)
        return replace(self, smooth=self.smooth.moved(similarity), pieces=pieces)

    def flattest_crease(self) -> tuple[int, int] | None:
        """Return the two pieces that meet at the least angle.

        The lower number comes first; None if all angles are creases.
        """
        edges = neighbours(self.places)
        pairs = np.sort(self.labels[edges], axis=1)
        across = pairs[:, 0] != pairs[:, 1]
        middles, pairs = self.places[edges[across]].mean(axis=1), pairs[across]
        least, found = MIN_CREASE, None
        for a, b in np.unique(pairs, axis=0).tolist():
            between = middles[(pairs == [a, b]).all(axis=1)]
            sides = [self.pieces[k].normals(between) for k in (a, b)]
            angle = float(np.median(np.linalg.norm(sides[0] - sides[1], axis=1)))
            if angle < least:
                least, found = angle, (a, b)
        return found

    def uncreased(self, places: Floats, half: float) -> Mask:
        """Return whether a square about each place lies on one piece.

        half: half a side, mm. places: (n, 2) mm. Returns (n,) bool.
        """
        own, _ = self.located(places)
        whole = np.ones(len(places), bool)
        for corner in half * np.array([[-1, -1], [0, -1], [1, -1], [1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0]]):
            whole &= self.located(places + corner)[0] == own
        return whole

    def creased(self, places: Floats, faces: Ints) -> Floats:
        """Return mesh vertices (n, 3) mm, some of them moved onto creases.

        Of two neighbours on different pieces, that on the first piece lies where the two meet.
        places: (n, 2) mm.
        faces: (m, 3).
        """
        label, feet = self.located(places)
        vertices = self._gathered(label, [piece.points(feet[label == k]) for k, piece in enumerate(self.pieces)])
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        edges = np.concatenate([edges, edges[:, ::-1]])
        edges = edges[label[edges[:, 0]] < label[edges[:, 1]]]
        meets = np.zeros((len(places), len(self.pieces)), bool)
        meets[edges[:, 0], label[edges[:, 1]]] = True
        at = np.flatnonzero(meets.any(axis=1))
        meets[at, label[at]] = True
        vertices[at] = self._meeting(vertices[at], meets[at], places[at])
        return vertices

    def flat_corners(self, vertices: Floats, faces: Ints, places: Floats) -> Floats:
        """Return the corners (m, 3, 2) mm of a creased mesh's faces on their pieces.

        Of a face across a crease, `creased` has moved the vertices of the first piece onto it: it lies on the last.
        vertices: (n, 3) mm, at places (n, 2) mm.
        faces: (m, 3).
        """
        of_face = self.located(places)[0][faces].max(axis=1)
        corners = places[faces]
        for k, piece in enumerate(self.pieces):
            used, index = np.unique(faces[of_face == k], return_inverse=True)
            corners[of_face == k] = piece.feet(vertices[used], places[used])[index.reshape(-1, 3)]
        return corners

    def gutter_widths(self) -> Floats:
        """Return the lengths (rows,) mm of the surface over the crease between two pieces.

        In rows across it, from GUTTER_MM before the crease to GUTTER_MM behind it: two lines along a crease are as far
        apart on the paper everywhere. Where the shape of a gutter was not found, each row has another width.
        """
        ends = neighbours(self.places)
        across = self.labels[ends[:, 0]] != self.labels[ends[:, 1]]
        turn = self.pieces[0].turn
        middles = self.places[ends[across]].mean(axis=1) @ turn.T
        x = np.median(middles[:, 0]) + np.arange(-GUTTER_MM, GUTTER_MM + ROW_MM / 2, ROW_MM)
        y = np.arange(middles[:, 1].max(), middles[:, 1].min(), -ROW_MM)
        rows = np.stack(np.meshgrid(x, y), axis=-1)
        faces = grid_faces(np.ones(rows.shape[:2], bool))
        points = self.creased(rows.reshape(-1, 2) @ turn, faces).reshape(*rows.shape[:2], 3)
        return np.asarray(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1))

    def described(self, stiffness: float) -> SurfaceReport:  # noqa: ARG002 (as of a smooth surface)
        """Return what a report says of it."""
        return {"shape": "pieces", "stiffness_mm4": self.paper.stiffness, "smooth_pieces": len(self.pieces)}

    def edge_counts(self, places: Floats, measured: Mask, spacing: float) -> Ints:
        """Return how often points of an edge count, (n,).

        Next to a crease, where nothing is printed, they alone show the paper.
        places: (n, 2) mm, round the page, a spacing apart.
        """
        label, _ = self.located(places)
        reach = round(CREASE_MM / spacing)
        near = ndimage.maximum_filter1d((label != np.roll(label, 1)).astype(int), 2 * reach + 1, mode="wrap")
        return np.where(measured, np.where(near > 0, CREASE_COUNT, 1), 0)

    def through(self, cloud: Cloud, stiffness: float = 0.0) -> FoldedSurface:  # noqa: ARG002 (as of a smooth surface)
        """Return the pieces of the same paper through points near them."""
        return refold(cloud.points, cloud.feet, self)

    def _meeting(self, points: Floats, meets: Mask, places: Floats) -> Floats:
        """Points (n, 3) mm moved to where the pieces meet that `meets` (n, pieces) says."""
        normals, heights = np.zeros((*meets.shape, 3)), np.zeros(meets.shape)
        for _ in range(MEETING_STEPS):
            for k, piece in enumerate(self.pieces):
                own = meets[:, k]
                feet = piece.feet(points[own], places[own])
                normals[own, k] = piece.normals(feet)
                heights[own, k] = ((piece.points(feet) - points[own]) * normals[own, k]).sum(axis=1)
            points = points + np.einsum("nij,nj->ni", np.linalg.pinv(normals, rcond=MIN_MEETING), heights)
        return points

    def _gathered(self, label: Ints, parts: list[Floats]) -> Floats:
        """Return the rows (n, …) of parts in the order of labels (n,).

        parts: one for each piece.
        """
        out = np.empty((len(label), *parts[0].shape[1:]))
        for k, part in enumerate(parts):
            out[label == k] = part
        return out

    def _candidates(self, places: Floats) -> Mask:
        """Return the pieces that may reach places (n, 2) mm, (n, pieces) bool."""
        trees = [cKDTree(self.places[self.labels == k]) for k in range(len(self.pieces))]
        distance = np.stack([tree.query(places)[0] for tree in trees], axis=1)
        return np.asarray(distance < distance.min(axis=1, keepdims=True) + CANDIDATES_MM)


def fold(points: Floats, feet: Floats, smooth: Surface) -> Surface | FoldedSurface:
    """Return the surface through points, folded where they show creases.

    It is the smooth one where the points show no crease, and where they show many: small pieces are prolonged by more
    than their points determine.
    points: (n, 3) mm.
    feet: (n, 2) mm, on the smooth surface through them.
    """
    labels = _large(find_pieces(points, feet))
    if (labels >= 0).mean() < MIN_COVERED:
        return smooth
    try:
        if labels.max() == 0:  # a gutter without print parts no points
            labels = find_crease(feet, smooth, MIN_FRACTION).sides(feet, smooth.step / 2)
            rough = Paper(SMOOTH_STIFFNESS, most_strain=UNCREASED)
            if _folded(points, feet, labels, smooth, rough).flattest_crease() is not None:
                return smooth
        return _creased(points, feet, labels, smooth) or smooth
    except SheetLost:  # not a real piece: a few points across several creases
        return smooth


def _creased(points: Floats, feet: Floats, labels: Ints, smooth: Surface) -> FoldedSurface | None:
    """Return the pieces through points, merged where no crease parts them.

    points: (n, 3) mm, with labels (n,). Returns None for one piece only. Raises SheetLost.
    """
    while labels.max(initial=0) > 0:
        folded = _folded(points, feet, labels, smooth)
        flattest = folded.flattest_crease()
        if flattest is None:
            return refold(points, feet, folded)
        kept, gone = flattest
        labels = np.full(len(points), -1)
        labels[folded.members] = np.where(folded.labels == gone, kept, folded.labels)
        labels = np.where(labels > gone, labels - 1, labels)
    return None


def _large(labels: Ints) -> Ints:
    """Labels (n,), −1 for points on none or on pieces of less than MIN_FRACTION of them."""
    large = np.bincount(labels[labels >= 0], minlength=1) >= MIN_FRACTION * len(labels)
    return np.where((labels >= 0) & large[labels], np.cumsum(large)[labels] - 1, -1)


def refold(points: Floats, feet: Floats, folded: FoldedSurface) -> FoldedSurface:
    """Fit a folded surface again to points.

    points: (n, 3) mm.
    feet: (n, 2) mm, on its smooth surface.
    """
    for _ in range(FILLINGS):
        places = grid_places(feet.min(axis=0) - FILLED_MM, feet.max(axis=0) + FILLED_MM, FILLED_MM)
        both, start = np.concatenate([points, folded.points(places)]), np.concatenate([feet, places])
        smooth, moved = fit_surface(both, start, folded.smooth, stiffness=SMOOTH_STIFFNESS)
        feet = moved[: len(points)]
        labels, _ = folded.nearest(points, feet)
        folded = _folded(points, feet, labels, smooth, folded.paper)
    return folded


def _folded(points: Floats, feet: Floats, labels: Ints, smooth: Surface, paper: Paper | None = None) -> FoldedSurface:
    """Return the pieces through points.

    points: (n, 3) mm.
    feet: (n, 2) mm.
    labels: (n,), −1 for none.
    paper: of the pieces; None for that of PAPERS with which they come nearest to points held out.
    """
    large = np.bincount(labels[labels >= 0]) >= CORE
    labels = np.where((labels >= 0) & large[labels], np.cumsum(large)[labels] - 1, -1)
    parts, turns = [], []
    for k in range(int(large.sum())):
        own = labels == k
        turn = _along_crease(feet[own], feet[(labels >= 0) & ~own])
        low, high = _prolonged(feet[own], feet, smooth)
        corners = np.array([[a, b] for a in (low[0], high[0]) for b in (low[1], high[1])]) @ turn.T
        start = through_places(feet[own] @ turn.T, points[own], corners.min(axis=0), corners.max(axis=0))
        parts.append((points[own], start.feet(points[own], feet[own] @ turn.T), start))
        turns.append(turn)
    paper = paper or choose_paper(parts, PAPERS)
    fitted = [fit_paper(*part, paper, reach=REFINING_MM)[0] for part in parts]
    pieces = tuple(Piece(surface, turn) for surface, turn in zip(fitted, turns, strict=True))
    members = np.flatnonzero(labels >= 0)
    return FoldedSurface(smooth, pieces, feet[members], labels[members], members, paper)


def _along_crease(own: Floats, others: Floats) -> Floats:
    """Return the rotation (2, 2) that makes a piece's longest crease upright.

    The points of both sides that are next to each other show the creases.
    own, others: (n, 2) and (m, 2), places of the points on either side.
    """
    across, back = cKDTree(others).query(own)[1], cKDTree(own).query(others)[1]
    mutual = np.flatnonzero(back[across] == np.arange(len(own)))
    middles = (own[mutual] + others[across[mutual]]) / 2
    if len(middles) < PAIRS:
        return np.eye(2)
    along = np.linalg.svd(middles - middles.mean(axis=0), full_matrices=False)[2][0]
    along *= np.sign(along[1]) or 1.0
    return np.array([[along[1], -along[0]], along])


def _prolonged(own: Floats, feet: Floats, smooth: Surface) -> tuple[Floats, Floats]:
    """Return the rectangle of a piece, prolonged to its creases.

    Next to the margin of the page it ends where the smooth surface does.
    own: (k, 2), its places, of all (n, 2).
    Returns low (2,) and high (2,).
    """
    low, high = own.min(axis=0) - PROLONGED_MM, own.max(axis=0) + PROLONGED_MM
    first, last = smooth.bounds
    low = np.where(low < feet.min(axis=0), first, low)
    return low, np.where(high > feet.max(axis=0), last, high)
