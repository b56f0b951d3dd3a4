"""Make the straight sides of a page straight.

The outline of what was scanned is known to half a sample, and it is ragged by that much. A side that was cut with a
knife is straight, and a line through all of its raggedness tells where it ran far better. The border of the flat page
moves onto that line: what is beyond it is left out, and up to it the surface goes on as it does between two samples.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from restore.mesh.adjacency import border_of
from restore.mesh.measures import signed_areas
from restore.mesh.network import edges_of
from restore.outline.rectangle import CORNER_SHARE, fills_rectangle
from restore.range_image.sheet import Sheet
from restore.scan import FlatMesh, Floats, Ints, Mask

RAGGED = 0.5  # samples: what ends between two of them is taken to end midway
REACH = 1.5  # samples: the raggedness, and a sample that the border lost or gained; no more is cut off or added
NEAR = 0.75  # samples: the raggedness, and what the line itself may be off
STRAIGHT = 0.75  # of a side's outline is near its line; a torn side, or a bowed one, has less that is
CORNER_REACH = 4.0  # samples: closing and opening the outline have rounded the corner, and its nodes are as far apart
LEAST_POINTS = 8  # of the outline that tell a line
THINNEST = 0.1  # of what it was: a face may lose no more of its area than leaves this
CORRECTIONS = 5  # of the places of moved points; each leaves a half of what was wrong, or less
TURNS = 8  # of taking back moves that crush faces; each round leaves fewer


@dataclass(frozen=True)
class Line:
    """Points (x, y) mm on one side of the page: normal · (x, y) = offset, the normal pointing outwards."""

    normal: Floats
    offset: float

    def beyond(self, points: Floats) -> Floats:
        """(n,) mm by which points (n, 2) lie outside."""
        return np.asarray(points @ self.normal - self.offset)


def straighten(sheet: Sheet, page: FlatMesh, nodes: Floats) -> tuple[FlatMesh, Floats]:
    """Move the border of a flat page that lies square onto its straight sides; nodes (n, 2) are its grid positions.

    A side that is torn, dented or bulging, or has something sticking out of it, stays as it is, and so does a page that
    is no rectangle. Returns the page and its grid positions.
    """
    border = border_of(page.faces)
    outline = page.flat[border]
    area = float(signed_areas(page.flat, page.faces).sum())
    if not fills_rectangle(outline, area):
        return page, nodes
    to_grid = _to_grid(page, nodes)
    lines = [_line(outline, to_grid[border], *side) for side in ((0, -1), (1, -1), (0, 1), (1, 1))]
    goal = np.full_like(page.flat, np.nan)
    goal[border] = _onto(outline, to_grid[border], lines)
    flat, faces = _moved(page.flat, page.faces, goal)
    nodes = _followed(sheet, nodes, to_grid, page.flat, flat, edges_of(faces))
    used = np.unique(faces)
    return _remade(sheet, page, flat[used], nodes[used], np.searchsorted(used, faces)), nodes[used]


def _followed(sheet: Sheet, nodes: Floats, to_grid: Floats, before: Floats, after: Floats, edges: Ints) -> Floats:
    """Grid positions (n, 2) of vertices that went from one flat position (n, 2) mm to another: where the edges (e, 2)
    to their neighbours have on the surface the lengths that they have on the page."""
    moved = (before != after).any(axis=1)
    nodes = nodes + np.einsum("nij,nj->ni", to_grid, after - before)
    edges = edges[moved[edges].any(axis=1)]
    start, end = edges.T
    way = after[end] - after[start]
    length = np.linalg.norm(way, axis=1)
    way /= length[:, None]
    spread = np.zeros((len(nodes), 2, 2))
    for one in (start, end):
        np.add.at(spread, one, way[:, :, None] * way[:, None, :])
    solve = to_grid[moved] @ np.linalg.pinv(spread[moved])
    for _ in range(CORRECTIONS):
        short = ((length - sheet.lengths(nodes, edges)) / 2)[:, None] * way
        step = np.zeros_like(nodes)
        np.add.at(step, end, short)
        np.add.at(step, start, -short)
        nodes[moved] += np.einsum("nij,nj->ni", solve, step[moved])
    return nodes


def _remade(sheet: Sheet, page: FlatMesh, flat: Floats, nodes: Floats, faces: Ints) -> FlatMesh:
    """The page with other faces (m, 3), and flat (n, 2) mm at other grid positions nodes (n, 2)."""
    return replace(
        page,
        vertices=sheet.points(nodes),
        faces=faces,
        texcoords=sheet.texcoords(nodes),
        flat=flat,
        lengths=sheet.lengths(nodes, edges_of(faces)),
    )


def _to_grid(page: FlatMesh, nodes: Floats) -> Floats:
    """(n, 2, 2): what a step on the page, mm, is on the grid, samples, round every vertex, by its edges."""
    start, end = edges_of(page.faces).T
    on_page, on_grid = page.flat[end] - page.flat[start], nodes[end] - nodes[start]
    across, spread = np.zeros((len(nodes), 2, 2)), np.zeros((len(nodes), 2, 2))
    for one in (start, end):  # an edge is the same step from either end
        np.add.at(across, one, on_grid[:, :, None] * on_page[:, None, :])
        np.add.at(spread, one, on_page[:, :, None] * on_page[:, None, :])
    return np.asarray(across @ np.linalg.pinv(spread))


def _line(outline: Floats, to_grid: Floats, axis: int, sign: int) -> Line | None:
    """The line of the side that lies at the low (−1) or high (1) end of an axis, None where it is not straight."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    from_middle = (outline - (low + high) / 2) / (high - low)
    along = from_middle[:, 1 - axis]
    side = (sign * from_middle[:, axis] > np.abs(along)) & (np.abs(along) < 0.5 - CORNER_SHARE)
    if side.sum() < LEAST_POINTS:
        return None
    here, there = outline[side], to_grid[side]
    near = np.abs(_samples(_leaning(here, axis, sign, cv2.DIST_L1), here, there)) <= REACH
    # Among those the mean, not the median: an outline runs in steps of a sample, and the median is one of them.
    leaning, square = _leaning(here[near], axis, sign, cv2.DIST_L2), _square(here[near], axis, sign)
    off, off_square = _samples(leaning, here, there), _samples(square, here, there)
    if not _is_straight(off):
        return None
    # Pages are cut square: a side leans only where its outline does by more than its raggedness.
    return square if np.abs(off - off_square).max() <= RAGGED and _is_straight(off_square) else leaning


def _square(side: Floats, axis: int, sign: int) -> Line:
    normal = sign * np.eye(2)[axis]
    return Line(normal, float((side @ normal).mean()))


def _leaning(side: Floats, axis: int, sign: int, distance: int) -> Line:
    """The line through points (n, 2) mm, by one of OpenCV's distances."""
    vx, vy, x, y = cv2.fitLine(side.astype(np.float32), distance, 0, 1e-4, 1e-5).ravel().astype(float)
    normal = np.array([vy, -vx]) * np.sign(vy if axis == 0 else -vx) * sign
    return Line(normal, float(normal @ [x, y]))


def _is_straight(off: Floats) -> bool:
    """Whether an outline that lies so many samples (n,) beyond a line is that line, ragged."""
    return bool((np.abs(off) <= NEAR).mean() >= STRAIGHT and off.max() <= REACH)


def _samples(line: Line, outline: Floats, to_grid: Floats) -> Floats:
    """(n,) samples by which points (n, 2) mm lie beyond a line."""
    return np.asarray(line.beyond(outline) * np.linalg.norm(to_grid @ line.normal, axis=1))


def _onto(outline: Floats, to_grid: Floats, lines: list[Line | None]) -> Floats:
    """(n, 2) mm: where every point of the outline comes to lie on its side, and one of them in every corner; NaN for
    those that stay."""
    goal, least = np.full_like(outline, np.nan), np.full(len(outline), REACH)
    for line in lines:
        if line is not None:
            off = np.abs(_samples(line, outline, to_grid))
            nearer = off <= least
            goal[nearer] = outline[nearer] - line.beyond(outline[nearer])[:, None] * line.normal
            least[nearer] = off[nearer]
    for one, other in zip(lines, lines[1:] + lines[:1], strict=True):
        if one is not None and other is not None:
            corner = np.linalg.solve([one.normal, other.normal], [one.offset, other.offset])
            way = np.linalg.norm(np.einsum("nij,nj->ni", to_grid, corner - outline), axis=1)
            nearest = int(np.argmin(way))
            if way[nearest] <= CORNER_REACH:
                goal[nearest] = corner
    return goal


def _moved(flat: Floats, faces: Ints, goal: Floats) -> tuple[Floats, Ints]:
    """Flat positions (n, 2) mm, those with a goal there unless that would crush a face, and the faces (m, 3) that are
    left: those that lay beyond a side would have all their corners on it, and are gone."""
    moves: Mask = np.isfinite(goal[:, 0])
    before = signed_areas(flat, faces)
    goal = np.where(moves[:, None], goal, flat)
    gone = moves[faces].all(axis=1) & _crushed(before, signed_areas(goal, faces))
    faces, before = faces[~gone], before[~gone]
    outwards = ((goal - flat) * (flat - flat.mean(axis=0))).sum(axis=1) > 0
    for _ in range(TURNS):
        moved = np.where(moves[:, None], goal, flat)
        crushed = _crushed(before, signed_areas(moved, faces))
        if not crushed.any():
            return moved, faces
        crushing = np.isin(np.arange(len(flat)), faces[crushed]) & moves
        # Better a notch in the side than a tip beyond it.
        moves &= ~(crushing & outwards if (crushing & outwards).any() else crushing)
    return flat, faces


def _crushed(before: Floats, after: Floats) -> Mask:
    return np.asarray((after < THINNEST * before) & (before > 0))
