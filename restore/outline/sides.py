"""Straighten the sides of a flat page.

The outline of a scan is known to half a sample, so it is ragged. A cut side is straight, and the line that separates
the samples on the page from those beyond is far more accurate than single outline points. The border of the flat page
moves onto that line: faces beyond it are removed, and up to it the surface is extrapolated as between two samples.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import cv2
import numpy as np

from restore.mesh.measures import signed_areas
from restore.mesh.topology import Topology
from restore.mesh.triangulate import compact
from restore.numerics.lines import MIN_POINTS
from restore.outline.crossings import WRONG, Crossings, crossings_of, separate, where
from restore.outline.picture_edge import PictureSteps, edge_in_picture, steps_in_picture
from restore.outline.rectangle import CORNER_FRACTION, has_straight_sides
from restore.range_image.facets.sheet import WIDEST_STRIDE, PageOnGrid, Sheet
from restore.runtime.threads import in_threads
from restore.scan import Floats, Ints, Mask

OUTLINE_ERROR = 0.5  # samples: a surface that ends between two of them is assumed to end midway
INLIER_DISTANCE = 0.75  # samples: OUTLINE_ERROR, and the error of the line itself
MAX_SHIFT = INLIER_DISTANCE + 1.0  # samples: and one that the border lost or gained
MIN_INLIERS = 0.75  # fraction of a side's outline points near its line; torn or curved sides have fewer
MIN_AREA_RATIO = 0.1  # least area of a face after the move, as a fraction of its area before
GRID_ITERATIONS = 6  # of the grid positions of moved vertices; the sixth hardly changes them
MAX_UNDO_ROUNDS = 8  # of undoing moves that collapse faces; each round leaves fewer


@dataclass(frozen=True)
class Line:
    """Line normal · (x, y) = offset along one side of the page, mm.

    normal: (2,), unit vector that points outwards.
    steps: those of the image by which it was placed, if any.
    """

    normal: Floats
    offset: float
    steps: PictureSteps | None = None

    def signed_distance(self, points: Floats) -> Floats:
        """Return signed distances (n,) mm of points (n, 2) from the line, positive outside."""
        return np.asarray(points @ self.normal - self.offset)


Side = tuple[int, int]
"""An axis, 0 for x, and −1 for its low or 1 for its high end."""
SIDES: tuple[Side, ...] = ((0, -1), (1, -1), (0, 1), (1, 1))
NO_SIDES: Mapping[Side, Line] = MappingProxyType({})


def straighten(sheet: Sheet, page: PageOnGrid, given: Mapping[Side, Line] = NO_SIDES) -> PageOnGrid:
    """Return an axis-aligned page with its border moved onto its sides.

    Some are given, others fitted. A side that is torn, curved or has a protrusion is left unchanged, and so is a page
    without sides of a rectangle.
    """
    border = page.topology.border
    outline = page.flat[border]
    area = float(signed_areas(page.flat, page.faces).sum())
    if not has_straight_sides(outline, area):
        return page
    jacobians = _grid_jacobians(page, border)
    crossings = crossings_of(sheet, page, border, jacobians[border])
    lines = in_threads(lambda side: given.get(side) or _fit_side(sheet, crossings, *side), SIDES)
    scraps = _scraps(sheet, page, lines)
    if scraps.any():
        return straighten(sheet, _of_faces(page, page.faces[~scraps]), given)
    target = np.full_like(page.flat, np.nan)
    target[border] = _project_to_sides(outline, jacobians[border], lines)
    flat, faces = _move_border(page.flat, page.faces, target)
    nodes = _update_grid_positions(sheet, page.nodes, jacobians, page.flat, flat, Topology(faces).edges)
    return _of_faces(PageOnGrid(flat, faces, nodes), faces)


def _of_faces(page: PageOnGrid, faces: Ints) -> PageOnGrid:
    """The page of some of its faces (m, 3)."""
    used, numbered = compact(np.arange(len(page.flat)), faces)
    return PageOnGrid(page.flat[used], numbered, page.nodes[used])


def _scraps(sheet: Sheet, page: PageOnGrid, lines: list[Line | None]) -> Mask:
    """Return the faces (m,) beyond a side that show what lies there.

    A mesh was cut out with them; the image shows it.
    """
    scraps = np.zeros(len(page.faces), bool)
    middles, nodes = page.flat[page.faces].mean(axis=1), page.nodes[page.faces].mean(axis=1)
    for line in lines:
        if line is not None and line.steps is not None and sheet.scan.texture is not None:
            beyond = np.flatnonzero(line.signed_distance(middles) > 0.0)
            scraps[beyond] |= line.steps.shows_table(sheet.scan.texture, sheet.texcoords(nodes[beyond]))
    return scraps


def _update_grid_positions(
    sheet: Sheet, nodes: Floats, jacobians: Floats, before: Floats, after: Floats, edges: Ints
) -> Floats:
    """Grid positions (n, 2) of vertices after their flat positions (n, 2) mm changed.

    They are corrected iteratively until the edges (e, 2) to the neighbours have on the surface the lengths that
    they have on the page. Each vertex gets the position at which its edges missed them least: on a steep wall, where
    a fraction of a sample is millimetres of paper, the iteration can diverge, but no farther than the next image.
    """
    moved = (before != after).any(axis=1)
    size = np.array(sheet.inside.shape)
    nodes = np.clip(nodes + np.einsum("nij,nj->ni", jacobians, after - before), -size, 2 * size)
    edges = edges[moved[edges].any(axis=1)]
    start, end = edges.T
    direction = after[end] - after[start]
    length = np.linalg.norm(direction, axis=1)
    direction /= length[:, None]
    gram = np.zeros((len(nodes), 2, 2))
    for one in (start, end):
        np.add.at(gram, one, direction[:, :, None] * direction[:, None, :])
    solve = jacobians[moved] @ np.linalg.pinv(gram[moved])
    best, least = nodes.copy(), np.full(len(nodes), np.inf)
    for _ in range(GRID_ITERATIONS):
        shortfall = length - sheet.lengths(nodes, edges)
        missed = np.bincount(start, shortfall**2, len(nodes)) + np.bincount(end, shortfall**2, len(nodes))
        better = missed < least
        best[better], least[better] = nodes[better], missed[better]
        step, pull = np.zeros_like(nodes), (shortfall / 2)[:, None] * direction
        np.add.at(step, end, pull)
        np.add.at(step, start, -pull)
        nodes[moved] += np.einsum("nij,nj->ni", solve, step[moved])
        nodes = np.clip(nodes, -size, 2 * size)  # a path takes as long as it is
    return best


def _grid_jacobians(page: PageOnGrid, border: Ints) -> Floats:
    """Return the Jacobian of grid position by flat position at the border.

    It is fitted to the edges of its vertices. Returns (n, 2, 2) samples/mm, 0 at other vertices.
    """
    flat, nodes, edges = page.flat, page.nodes, page.topology.edges
    edges = edges[np.isin(edges, border).any(axis=1)]
    start, end = edges.T
    on_page, on_grid = flat[end] - flat[start], nodes[end] - nodes[start]
    mixed, gram = np.zeros((len(nodes), 2, 2)), np.zeros((len(nodes), 2, 2))
    for one in (start, end):  # both outer products are the same from either end
        np.add.at(mixed, one, on_grid[:, :, None] * on_page[:, None, :])
        np.add.at(gram, one, on_page[:, :, None] * on_page[:, None, :])
    jacobians = np.zeros((len(nodes), 2, 2))
    jacobians[border] = mixed[border] @ np.linalg.pinv(gram[border])
    return jacobians


def _fit_side(sheet: Sheet, crossings: Crossings, axis: int, sign: int) -> Line | None:
    """Fit the line of the side at the low (−1) or high (1) end of an axis.

    Returns None when the side is not straight.
    """
    on_side = _along_side(crossings, axis, sign)
    steps = steps_in_picture(sheet, on_side, sign * np.eye(2)[axis]) if sheet.cut_out else None
    if steps is not None:
        # The cut of a mesh says nothing of where the paper ends; a piece of what lies beyond is not part of the page.
        on_side = where(steps.places, _near_line(steps.places, axis, sign))
    if len(on_side.nodes) < MIN_POINTS:
        return None
    near = where(on_side, _near_line(on_side, axis, sign))
    # Least squares over the inliers: an outline runs in steps of a sample, and a median would be one of the steps.
    lines = _fit_line(near.places, axis, sign, cv2.DIST_L2), _axis_aligned_line(near.places, axis, sign)
    distance, aligned_distance = (_sample_distances(line, on_side.places, on_side.jacobians) for line in lines)
    if not _is_straight(distance):
        return None
    # Pages are cut at right angles: an oblique side must differ from the axis by more than the outline's error.
    oblique = bool(np.abs(distance - aligned_distance).max() > OUTLINE_ERROR or not _is_straight(aligned_distance))
    if steps is not None:
        return replace(lines[not oblique], steps=steps)
    return _separating(sheet, near, *lines, oblique=oblique)


def _along_side(crossings: Crossings, axis: int, sign: int) -> Crossings:
    """Return the crossings of a side without those next to its corners.

    The side is at the low (−1) or high (1) end of an axis.
    """
    outline = crossings.places
    low, high = outline.min(axis=0), outline.max(axis=0)
    from_middle = (outline - (low + high) / 2) / (high - low)
    along = np.abs(from_middle[:, 1 - axis])
    return where(crossings, (sign * from_middle[:, axis] > along) & (along < 0.5 - CORNER_FRACTION))


def _near_line(crossings: Crossings, axis: int, sign: int) -> Mask:
    """Return which crossings are within MAX_SHIFT of their common line.

    Most of them lie along that. Returns (k,) bool.
    """
    line = _fit_line(crossings.places, axis, sign, cv2.DIST_L1)
    return np.asarray(np.abs(_sample_distances(line, crossings.places, crossings.jacobians)) <= MAX_SHIFT)


def _separating(sheet: Sheet, near: Crossings, fitted: Line, aligned: Line, *, oblique: bool) -> Line:
    """Return the line of a side, moved to where it separates the samples.

    Of two lines the likelier moves the centre of the line. It stays oblique only if that is the likelier: lost samples
    may have rotated it. Unchanged where too many samples would be on its wrong side: they do not lie along a line.
    """
    normals = [fitted.normal, aligned.normal]
    seen = [edge_in_picture(sheet, near, normal) for normal in normals]
    if None in seen:  # likelihoods with a picture and without cannot be compared
        seen = [None, None]
    separations = [(separate(near, normal, edge), normal) for normal, edge in zip(normals, seen, strict=True)]
    best, normal = max(separations, key=lambda found: found[0].log_likelihood)
    if best.right < 1.0 - WRONG:
        return fitted if oblique else aligned
    middle = near.samples.mean(axis=(0, 1))
    middle = middle - Line(normal, best.offset).signed_distance(middle) * normal
    direction = normal if oblique else aligned.normal
    return Line(direction, float(middle @ direction))


def _axis_aligned_line(side: Floats, axis: int, sign: int) -> Line:
    normal = sign * np.eye(2)[axis]
    return Line(normal, float((side @ normal).mean()))


def _fit_line(points: Floats, axis: int, sign: int, metric: int) -> Line:
    """The line fitted to points (n, 2) mm with one of OpenCV's distance types."""
    vx, vy, x, y = cv2.fitLine(points.astype(np.float32), metric, 0, 1e-4, 1e-5).ravel().astype(float)
    normal = np.array([vy, -vx]) * np.sign(vy if axis == 0 else -vx) * sign
    return Line(normal, float(normal @ [x, y]))


def _is_straight(distance: Floats) -> bool:
    """Return whether outline points agree with a line.

    distance: (n,) samples, signed, up to the outline's error.
    """
    return bool((np.abs(distance) <= INLIER_DISTANCE).mean() >= MIN_INLIERS and distance.max() <= MAX_SHIFT)


def _sample_distances(line: Line, outline: Floats, jacobians: Floats) -> Floats:
    """Return the signed distances (n,) of points from a line, samples, positive outside.

    outline: (n, 2) mm.
    """
    return np.asarray(line.signed_distance(outline) * np.linalg.norm(jacobians @ line.normal, axis=1))


def _project_to_sides(outline: Floats, jacobians: Floats, lines: list[Line | None]) -> Floats:
    """Project outline points onto the nearest side, one onto each corner.

    Returns (n, 2) mm, NaN for unchanged ones.
    """
    target, smallest = np.full_like(outline, np.nan), np.full(len(outline), MAX_SHIFT)
    for line in lines:
        if line is not None:
            distance = np.abs(_sample_distances(line, outline, jacobians))
            closer = distance <= smallest
            target[closer] = outline[closer] - line.signed_distance(outline[closer])[:, None] * line.normal
            smallest[closer] = distance[closer]
    for one, other in zip(lines, lines[1:] + lines[:1], strict=True):
        if one is not None and other is not None:
            corner = np.linalg.solve([one.normal, other.normal], [one.offset, other.offset])
            shift = np.linalg.norm(np.einsum("nij,nj->ni", jacobians, corner - outline), axis=1)
            nearest = int(np.argmin(shift))
            if shift[nearest] <= WIDEST_STRIDE:  # morphology has rounded the corners, and nodes are as far apart
                target[nearest] = corner
    return target


def _move_border(flat: Floats, faces: Ints, target: Floats) -> tuple[Floats, Ints]:
    """Move flat positions to their targets unless that collapses a face.

    Faces beyond a side would have all their corners on it; they are removed. Returns (n, 2) mm and the remaining faces
    (k, 3).
    """
    moves: Mask = np.isfinite(target[:, 0])
    before = signed_areas(flat, faces)
    target = np.where(moves[:, None], target, flat)
    removed = moves[faces].all(axis=1) & _collapsed(before, signed_areas(target, faces))
    faces, before = faces[~removed], before[~removed]
    outwards = ((target - flat) * (flat - flat.mean(axis=0))).sum(axis=1) > 0
    for _ in range(MAX_UNDO_ROUNDS):
        moved = np.where(moves[:, None], target, flat)
        collapsed = _collapsed(before, signed_areas(moved, faces))
        if not collapsed.any():
            return moved, faces
        collapsing = np.isin(np.arange(len(flat)), faces[collapsed]) & moves
        # Outward moves are undone first: a notch in the side is better than a tip beyond it.
        moves &= ~(collapsing & outwards if (collapsing & outwards).any() else collapsing)
    return flat, faces


def _collapsed(before: Floats, after: Floats) -> Mask:
    """Return the faces (m,) whose area fell below MIN_AREA_RATIO.

    before, after: (m,), signed areas.
    """
    return np.asarray((after < MIN_AREA_RATIO * before) & (before > 0))
