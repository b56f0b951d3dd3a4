"""Make the straight sides of a page straight.

The outline of what was scanned is known to half a sample, and it is ragged by that much. A side that was cut with a
knife is straight, and a line through all of its raggedness tells where it ran far better. The border of the flat page
moves onto that line; what is beyond it is left out, and what is missing up to it the surface carried on by half a
sample or so tells, as it does between the samples.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from restore.align import CORNER_SHARE, border_of, fills_rectangle
from restore.flatten.network import edges_of
from restore.scan import FlatMesh, Floats, Ints, Mask
from restore.strain import signed_areas
from restore.surface import Sheet

REACH = 1.5  # samples: half a one of raggedness, and one that the border lost or gained
RAGGED = 0.5  # samples
CORNER_REACH = 4.0  # samples: closing and opening the outline have rounded the corner, and its nodes are as far apart
STRAIGHT = 0.75  # of a side's outline lies on its line; a torn one, or one with a dent, has less that does
LEAST_POINTS = 8  # of the outline that tell a line
THINNEST = 0.1  # of what it was: a face may lose no more of its area than leaves this
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
    to_grid = _to_grid(page, nodes)[border]
    lines = [_line(outline, to_grid, *side) for side in ((0, -1), (1, -1), (0, 1), (1, 1))]
    move = np.zeros_like(page.flat)
    move[border] = _onto(outline, to_grid, lines)
    flat, faces = _moved(page.flat, page.faces, move)
    nodes = nodes.copy()
    nodes[border] += np.einsum("nij,nj->ni", to_grid, flat[border] - outline)
    used = np.unique(faces)
    return _remade(sheet, page, flat[used], nodes[used], np.searchsorted(used, faces)), nodes[used]


def _remade(sheet: Sheet, page: FlatMesh, flat: Floats, nodes: Floats, faces: Ints) -> FlatMesh:
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
    leaning, square = _leaning(here, axis, sign), _square(here, axis, sign)
    off, off_square = _samples(leaning, here, there), _samples(square, here, there)
    if not _is_straight(off):
        return None
    # Pages are cut square: a side leans only where what was measured cannot be told from square otherwise.
    return square if np.abs(off - off_square).max() <= RAGGED and _is_straight(off_square) else leaning


def _square(side: Floats, axis: int, sign: int) -> Line:
    normal = sign * np.eye(2)[axis]
    return Line(normal, float(np.median(side @ normal)))


def _leaning(side: Floats, axis: int, sign: int) -> Line:
    vx, vy, x, y = cv2.fitLine(side.astype(np.float32), cv2.DIST_L1, 0, 1e-4, 1e-5).ravel().astype(float)
    normal = np.array([vy, -vx]) * np.sign(vy if axis == 0 else -vx) * sign
    return Line(normal, float(normal @ [x, y]))


def _is_straight(off: Floats) -> bool:
    """Whether an outline that lies so many samples (n,) beyond a line is that line, ragged."""
    return bool((np.abs(off) <= REACH).mean() >= STRAIGHT and off.max() <= REACH)


def _samples(line: Line, outline: Floats, to_grid: Floats) -> Floats:
    """(n,) samples by which points (n, 2) mm lie beyond a line."""
    return np.asarray(line.beyond(outline) * np.linalg.norm(to_grid @ line.normal, axis=1))


def _onto(outline: Floats, to_grid: Floats, lines: list[Line | None]) -> Floats:
    """(n, 2) mm: how every point of the outline gets onto its side, and one of them into every corner."""
    move, least = np.zeros_like(outline), np.full(len(outline), REACH)
    for line in lines:
        if line is not None:
            off = np.abs(_samples(line, outline, to_grid))
            nearer = off <= least
            move[nearer] = -line.beyond(outline[nearer])[:, None] * line.normal
            least[nearer] = off[nearer]
    for one, other in zip(lines, lines[1:] + lines[:1], strict=True):
        if one is not None and other is not None:
            corner = np.linalg.solve([one.normal, other.normal], [one.offset, other.offset])
            way = np.linalg.norm(np.einsum("nij,nj->ni", to_grid, corner - outline), axis=1)
            nearest = int(np.argmin(way))
            if way[nearest] <= CORNER_REACH:
                move[nearest] = corner - outline[nearest]
    return move


def _moved(flat: Floats, faces: Ints, move: Floats) -> tuple[Floats, Ints]:
    """Flat positions (n, 2) mm after a move, without those steps of it that would crush a face, and the faces (m, 3)
    that are left: those that lay beyond a side have all their corners on it now, and are gone."""
    moves, before = move.any(axis=1), signed_areas(flat, faces)
    gone = moves[faces].all(axis=1) & _crushed(before, signed_areas(flat + move, faces))
    faces, before = faces[~gone], before[~gone]
    for _ in range(TURNS):
        moved = np.where(moves[:, None], flat + move, flat)
        crushed = _crushed(before, signed_areas(moved, faces))
        if not crushed.any():
            return moved, faces
        moves[faces[crushed]] = False
    return flat, faces


def _crushed(before: Floats, after: Floats) -> Mask:
    return np.asarray((after < THINNEST * before) & (before > 0))
