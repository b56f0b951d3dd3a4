"""The page of an ordered grid: a CT segment that winds round.

No view sees all of it. Its points are dense and their noise is a good part of their spacing: straight lengths would be
too long by a tenth. So a quadratic patch is fitted round every few points, and the page is that of these nodes, with
lengths along the surface (`surface_lengths.bent_lengths`). The points between follow the nodes. Where the segment jumps
to another winding, links between neighbours are far longer than others: no patch reaches over them, and on the page
they get the length of an ordinary link, so that the grid keeps its order. The strain there shows the jump.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, sqrt

import numpy as np
from scipy.ndimage import distance_transform_edt

from restore.errors import NotEnoughSurface
from restore.flattening.isometric.least_distortion import embedded
from restore.flattening.isometric.page import flatten_isometric
from restore.flattening.methods import flatten_with
from restore.mesh.adjacency import components
from restore.mesh.measures import straight_lengths, surface_area
from restore.mesh.ordered_grid import GridMesh, fit_patches, grid_faces
from restore.mesh.surface_lengths import bent_lengths
from restore.mesh.topology import Topology
from restore.mesh.validate import validated
from restore.numerics.limits import SINGLE_PRECISION, SMALL, TINY
from restore.numerics.robust import MAJORITY, NEVER, robust_sigma
from restore.page import FlatMesh
from restore.scan import Floats, Ints, Mask, SurfaceMesh

MAX_NODES = 20_000  # solved in seconds; a page of two million points is smooth between these
MAX_SLOPE = 3e-3  # of a link between nodes, from noise: it is too long by half the square, 5 µm in a metre
MIN_REACH = 2  # points to either side of a node: fewer do not determine a quadratic patch at the border
MIN_JUMP = 1.25  # of the median link, on a regular grid: the next winding is three quarters of a link away
SAMPLED_ROWS = 200  # enough for the noise, by fourth differences: the bend of the surface is gone in them
FOURTH = sqrt(1.0 + 16.0 + 36.0 + 16.0 + 1.0)  # standard deviations of the noise, in a fourth difference
NO_LENGTH = 1e-3  # of the usual edge: none


@dataclass(frozen=True, eq=False)
class Nodes:
    """The nodes of a coarser grid over a grid of points, with patches of the surface.

    rows (k,), cols (l,)  lines of the grid of points on which they lie, from its first to its last.
    positions, normals    (k, l, 3) mm on the surface; NaN for a node without enough points near it.
    pieces                (k, l) piece of the grid, as jumps part it, that a node belongs to; −1 for none.
    """

    rows: Ints
    cols: Ints
    positions: Floats
    normals: Floats
    pieces: Ints

    def typical_steps(self) -> tuple[float, float]:
        """Return the median noise-free steps along rows and along columns, mm."""
        along = np.linalg.norm(np.diff(self.positions, axis=1), axis=2) / np.diff(self.cols)
        down = np.linalg.norm(np.diff(self.positions, axis=0), axis=2) / np.diff(self.rows)[:, None]
        return float(np.nanmedian(along)), float(np.nanmedian(down))

    def of_sheet(self) -> Mask:
        """Return the nodes of the sheet, (k, l) bool.

        They are those of the pieces that span the grid, or of the largest, that are in a triangle. A piece that jumped
        to another winding is wider or narrower than its place; solved together with the others it would push them
        apart.
        """
        known = self.pieces >= 0
        if not known.any():
            return known
        pieces = np.unique(self.pieces[known], return_inverse=True)[1]
        spanning = np.bincount(pieces) == np.bincount(pieces).max()
        for axis, at in enumerate(np.nonzero(known)):
            low, high = np.full(len(spanning), known.shape[axis]), np.zeros(len(spanning), np.int64)
            np.minimum.at(low, pieces, at)
            np.maximum.at(high, pieces, at + 1)
            spanning |= high - low > MAJORITY * known.shape[axis]
        chosen = known.copy()
        chosen[known] = spanning[pieces]
        used = np.zeros(int(chosen.sum()), bool)
        used[grid_faces(chosen)] = True
        chosen[chosen] = used
        return chosen


def flatten_grid(mesh: GridMesh, *most: int) -> list[FlatMesh]:
    """Flatten an ordered grid, to pages with the grid's rows and columns.

    Each has about the given number of points. The points are moved onto the surface, and the rest lengths are those
    between them; over a jump those in space.
    Raises NotEnoughSurface for a grid without area, and where no node has enough points round it.
    """
    if surface_area(mesh.vertices, mesh.faces) <= SMALL * np.ptp(mesh.vertices) ** 2:
        raise NotEnoughSurface("the points of the grid lie on a line", "export the segment as a surface")
    points = points_on_grid(mesh)
    links = typical_links(points)
    pieces = _pieces(points, *links)
    nodes = _fitted(points, pieces, node_step(points, min(link[0] for link in links)))
    sheet = nodes.of_sheet()
    if not sheet.any():
        raise NotEnoughSurface("the grid has no patch of neighbouring points", "export a larger segment")
    along, down = nodes.typical_steps()
    page = _page_of(nodes, sheet, along, down)
    displacement = _harmonic(sheet, page.flat - page.vertices[:, :2])
    flat = _between(nodes, displacement, mesh.shape) + _plane(mesh.shape, along, down)
    surface = _moved_onto_surface(points, pieces, nodes)
    return [_page_at(thinned(mesh, count), page, flat, surface) for count in most]


def _page_at(mesh: GridMesh, solved: FlatMesh, flat: Floats, surface: Floats) -> FlatMesh:
    """Return the page at the points of a grid, as it was solved.

    flat: (rows, cols, 2) mm.
    surface: (rows, cols, 3) mm.
    """
    mesh = replace(mesh, vertices=surface.reshape(-1, 3)[mesh.places])
    edges, on_page = Topology(mesh.faces).edges, flat.reshape(-1, 2)[mesh.places]
    lengths = straight_lengths(mesh.vertices, edges)
    empty = lengths < NO_LENGTH * lengths.mean()  # a repeated point: the distance of its places is unknown
    lengths[empty] = np.maximum(straight_lengths(on_page, edges)[empty], SINGLE_PRECISION * lengths.mean())
    return FlatMesh.of(mesh, on_page, lengths, solved.iterations, **solved.convergence)


def points_on_grid(mesh: GridMesh) -> Floats:
    """Return the vertices in their places on the grid.

    Returns (rows, cols, 3) mm, NaN in the other places.
    """
    points: Floats = np.full((mesh.shape[0] * mesh.shape[1], 3), np.nan)
    points[mesh.places] = mesh.vertices
    return points.reshape(*mesh.shape, 3)


def thinned(mesh: GridMesh, most: int) -> GridMesh:
    """Return every k-th row and column of a grid, and the last ones.

    About `most` points are left.
    """
    step = max(sqrt(len(mesh.vertices) / max(most, 1)), 1.0)
    kept = np.zeros(mesh.shape, bool)
    kept[np.ix_(_lines(mesh.shape[0], step), _lines(mesh.shape[1], step))] = True
    valid = np.zeros(kept.size, bool)
    valid[mesh.places] = True
    chosen = (kept.ravel() & valid)[mesh.places]
    lines = np.ix_(kept.any(axis=1), kept.any(axis=0))
    faces = grid_faces(valid.reshape(mesh.shape)[lines])
    texcoords = None if mesh.texcoords is None else mesh.texcoords[chosen]
    return replace(mesh, vertices=mesh.vertices[chosen], faces=faces, texcoords=texcoords, places=mesh.places[chosen])


def typical_links(points: Floats) -> list[tuple[float, float]]:
    """Return median and limit of the links along rows and along columns, mm.

    points: (rows, cols, 3). Longer links jump to another winding.
    """
    found = []
    for axis in (1, 0):
        lengths = np.linalg.norm(np.diff(points, axis=axis), axis=2)
        lengths = lengths[np.isfinite(lengths)]
        middle = float(np.median(lengths)) if len(lengths) else 0.0
        spread = robust_sigma(lengths - middle) if len(lengths) else 0.0
        found.append((max(middle, TINY), max(middle + NEVER * spread, MIN_JUMP * middle)))
    return found


def _pieces(points: Floats, along: tuple[float, float], down: tuple[float, float]) -> Ints:
    """Return the piece (rows, cols) of each point.

    Points of a piece are connected by links that do not jump.
    """
    place = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    right = np.linalg.norm(np.diff(points, axis=1), axis=2) <= along[1]
    below = np.linalg.norm(np.diff(points, axis=0), axis=2) <= down[1]
    pairs = [np.stack([place[:, :-1][right], place[:, 1:][right]], axis=1)]
    pairs.append(np.stack([place[:-1][below], place[1:][below]], axis=1))
    return np.asarray(components(np.concatenate(pairs), place.size).reshape(place.shape))


def node_step(points: Floats, link: float) -> int:
    """Return how many points apart nodes are, so that noise bends no link beyond MAX_SLOPE.

    A patch over (2b + 1)² points has 1 / (2b + 1) of their noise, and the next node is b links away.
    points: (rows, cols, 3).
    """
    fourth = np.diff(points[:: max(len(points) // SAMPLED_ROWS, 1)], 4, axis=1)
    fourth = fourth[np.isfinite(fourth)]
    noise = robust_sigma(fourth) / FOURTH if len(fourth) else 0.0
    step = max(ceil(sqrt(points.shape[0] * points.shape[1] / MAX_NODES)), 1)
    while noise > MAX_SLOPE * step * (2 * step + 1) * link and 2 * step < min(points.shape[:2]):
        step += 1
    return step


def _lines(count: int, step: float) -> Ints:
    """Return lines of a grid, evenly spaced by about `step`, from its first to its last."""
    return np.unique(np.rint(np.linspace(0, count - 1, max(round((count - 1) / step), 1) + 1)).astype(np.int64))


def _fitted(points: Floats, pieces: Ints, step: int) -> Nodes:
    rows, cols = (_lines(count, step) for count in pieces.shape)
    sizes = np.bincount(pieces.ravel())[pieces]
    return Nodes(rows, cols, *fit_patches(points, pieces, sizes, rows, cols, max(step, MIN_REACH)))


def _page_of(nodes: Nodes, sheet: Mask, along: float, down: float) -> FlatMesh:
    """Return the page of the nodes of the sheet (k, l).

    Their mesh is oriented as the grid, with links of along and down mm.
    """
    lying = np.stack(np.meshgrid(along * nodes.cols, -down * nodes.rows), axis=-1)[sheet]
    mesh = validated(SurfaceMesh(np.column_stack([lying, np.zeros(len(lying))]), grid_faces(sheet)))
    edges, pieces = mesh.topology.edges, nodes.pieces[sheet]
    lengths = bent_lengths(nodes.positions[sheet], nodes.normals[sheet], edges)
    jumps = pieces[edges[:, 0]] != pieces[edges[:, 1]]
    lengths = np.where(jumps, straight_lengths(lying, edges), lengths)
    return flatten_with(mesh, flatten_isometric, lengths, None)


def _plane(shape: tuple[int, int], along: float, down: float) -> Floats:
    """Return where the points of a uniform grid lie, (rows, cols, 2) mm.

    All its links are along and down mm long.
    """
    return np.stack(np.meshgrid(along * np.arange(shape[1]), -down * np.arange(shape[0])), axis=-1)


def _harmonic(known: Mask, values: Floats) -> Floats:
    """Extend known values over a grid, each the mean of its neighbours.

    known: (k, l).
    values: (n, d), at the known nodes.
    Returns (k, l, d).
    """
    node = np.arange(known.size).reshape(known.shape)
    filled: Floats = np.zeros((known.size, values.shape[1]))
    filled[known.ravel()] = values
    if not known.all():
        pairs = [(node[:, :-1], node[:, 1:]), (node[:-1], node[1:])]
        edges = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in pairs])
        filled = embedded(edges, known.size, node[known], values)
    return filled.reshape(*known.shape, -1)


def _next_known(known: Mask) -> tuple[Ints, ...]:
    """Indices (2, k, l) of the known node that is next to each."""
    return tuple(distance_transform_edt(~known, return_distances=False, return_indices=True))


def _between(nodes: Nodes, values: Floats, shape: tuple[int, int]) -> Floats:
    """Interpolate values of the nodes linearly to all points of the grid.

    values: (k, l, d). Returns (rows, cols, d).
    """
    for axis, lines in enumerate((nodes.rows, nodes.cols)):
        at = np.interp(np.arange(shape[axis]), lines, np.arange(len(lines)))
        first = np.minimum(at.astype(np.int64), max(len(lines) - 2, 0))
        fraction = (at - first).reshape(-1, *[1] * (values.ndim - 1 - axis))
        last = np.minimum(first + 1, len(lines) - 1)
        values = (1.0 - fraction) * values.take(first, axis) + fraction * values.take(last, axis)
    return values


def _moved_onto_surface(points: Floats, pieces: Ints, nodes: Nodes) -> Floats:
    """Move the points between the nodes of their own piece.

    Points next to a jump stay as they are. Returns (rows, cols, 3) mm.
    """
    corners = [nodes.pieces[a:b, c:d] for a, b in ((0, -1), (1, None)) for c, d in ((0, -1), (1, None))]
    one = np.logical_and.reduce([corner == corners[0] for corner in corners])
    cell = np.where(one, corners[0], -1)
    row, col = (
        np.clip(np.searchsorted(lines, np.arange(count), "right") - 1, 0, max(len(lines) - 2, 0))
        for lines, count in zip((nodes.rows, nodes.cols), pieces.shape, strict=True)
    )
    own = cell[np.ix_(row, col)] == pieces if cell.size else np.zeros(pieces.shape, bool)
    surface = _between(nodes, nodes.positions[_next_known(nodes.pieces >= 0)], (pieces.shape[0], pieces.shape[1]))
    return np.where(own[..., None], surface, points)
