"""Refines the flattening of a coarse mesh to a lattice over the grid.

Between the vertices of the coarse mesh the sheet still bends. A fine lattice gets its initial flat positions by
interpolation from the coarse mesh and is relaxed until its edges have the lengths that they have on the surface.
The picture is mapped linearly within a face. On a steep side a cell of the lattice covers many millimetres of the page,
and their scale changes within it. There edges are split at their midpoints on the page. The normals at both ends
determine where those are in the picture: noise turns them far less than it moves points along a flat line of sight.
"""

from __future__ import annotations

from dataclasses import replace
from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates

from restore.flattening.isometric.page import least_absolute_page
from restore.mesh.measures import straight_lengths
from restore.mesh.network import make_network
from restore.mesh.raster import rasterise
from restore.mesh.topology import Topology
from restore.mesh.triangulate import lattice
from restore.page import FlatMesh
from restore.range_image.facets.sheet import WIDEST_STRIDE, PageOnGrid, Sheet
from restore.scan import Floats, Ints, Mask

SLOPE_STRIDE = 8  # lines of the grid: the mean slope of a page needs no more
# Samples from node to node, up to WIDEST_STRIDE. A cell over a crease or a bend is shown as plane: finer lattices err
# less. Their solution takes as long as they have nodes: a page that fills the picture has as many in either mode.
FINEST_STRIDE = 2
NODES = 15_000
NONLINEAR_MM = 0.005  # as much as the noise of a scan moves the places of a smooth page
# of an edge: no surface that bends evenly moves the middle farther within a few samples; a crease does
MAX_APART = 0.05
SPLITS = 2  # of splitting: a quarter of a cell is a sample, or half of one


def refine(sheet: Sheet, coarse: FlatMesh, nodes: Floats) -> tuple[FlatMesh, Floats]:
    """Return the flat mesh of a lattice over the whole sheet.

    Its initial positions are those of a coarse mesh.
    nodes: (n, 2), grid positions of the coarse mesh's vertices.
    Returns also the grid positions (k, 2) of its vertices.
    """
    fine_nodes, faces = lattice_over(sheet, stride_of(sheet.inside))
    topology, vertices = Topology(faces), sheet.points(fine_nodes)
    network = make_network(vertices, topology, sheet.lengths(fine_nodes, topology.edges))
    flat = interpolate_flat_positions(sheet.inside.shape, nodes, coarse.faces, coarse.flat, fine_nodes)
    found = least_absolute_page(flat, network)
    texcoords = sheet.texcoords(fine_nodes)
    fine = replace(
        coarse,
        vertices=vertices,
        faces=faces,
        texcoords=texcoords,
        flat=found.flat,
        lengths=network.lengths,
        residual=max(coarse.residual, found.residual),
        converged=coarse.converged and found.converged,
    )
    return fine, fine_nodes


def stride_of(inside: Mask) -> int:
    """Choose the finest stride over inside (rows, cols) with about NODES nodes at most.

    >>> [stride_of(np.ones(size, bool)) for size in ((100, 100), (200, 300), (300, 400), (480, 640))]
    [2, 2, 3, 4]
    """
    return int(np.clip(ceil(sqrt(inside.sum() / NODES)), FINEST_STRIDE, WIDEST_STRIDE))


def lattice_over(sheet: Sheet, stride: int) -> tuple[Floats, Ints]:
    """Triangulate a sheet so that its border can be moved onto sides.

    stride: samples from node to node.
    Returns grid positions (n, 2) and faces (m, 3).
    """
    # Sides are moved by nearly as much, and a narrower cell at the border would collapse.
    return lattice(sheet.inside, stride, FINEST_STRIDE)


def interpolate_flat_positions(
    shape: tuple[int, int], nodes: Floats, faces: Ints, flat: Floats, queries: Floats
) -> Floats:
    """Interpolate flat positions over a flattened mesh.

    Beyond its border the positions are extrapolated.
    shape: (rows, cols), of the grid.
    nodes, faces, flat: (n, 2) grid positions, (m, 3) and (n, 2) mm, of the mesh.
    queries: (k, 2), grid positions.
    Returns (k, 2) mm.
    """
    field = rasterise(np.ascontiguousarray(nodes[:, ::-1]), faces, flat, *shape).astype(np.float64)
    known = np.isfinite(field[..., 0])
    beyond = _neighbours(queries, shape) & ~known
    field[beyond] = _extrapolated(field, known, beyond)
    return np.stack([map_coordinates(field[..., k], queries.T, order=1, mode="nearest") for k in (0, 1)], axis=1)


def _neighbours(queries: Floats, shape: tuple[int, int]) -> Mask:
    """Return the four samples round each grid position (k, 2), (rows, cols) bool."""
    mask = np.zeros(shape, bool)
    row, col = np.floor(queries).astype(int).T
    for i in (row, row + 1):
        for j in (col, col + 1):
            mask[np.clip(i, 0, shape[0] - 1), np.clip(j, 0, shape[1] - 1)] = True
    return mask


def _extrapolated(field: Floats, known: Mask, wanted: Mask) -> Floats:
    """Extrapolate a field by point reflection at the border.

    field: (rows, cols, 2). Returns (k, 2) at wanted samples that are not known.
    """
    position = np.array(np.nonzero(wanted))
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)[:, wanted]
    mirrored = 2 * nearest - position  # as far inside the border as the unknown sample lies outside
    in_grid = np.all((mirrored >= 0) & (mirrored < np.array(known.shape)[:, None]), axis=0)
    mirrored = np.where(in_grid, mirrored, nearest)
    mirrored = np.where(known[tuple(mirrored)], mirrored, nearest)
    down = np.nanmean(np.diff(field[:, ::SLOPE_STRIDE], axis=0), axis=(0, 1))
    right = np.nanmean(np.diff(field[::SLOPE_STRIDE], axis=1), axis=(0, 1))
    # Where the reflected sample is unknown too, the mean slope of the page is used.
    past = (position - nearest + mirrored - nearest).astype(np.float64)
    return 2 * field[tuple(nearest)] - field[tuple(mirrored)] + past[0, :, None] * down + past[1, :, None] * right


def subdivide(sheet: Sheet, page: PageOnGrid) -> PageOnGrid:
    """The page with split faces; its first vertices are those of the page.

    An edge is split where the middle of it in the picture would be shown more than NONLINEAR_MM off on the page.
    """
    normals = sheet.normals()
    for _ in range(SPLITS):
        flat, nodes, sides = page.flat, page.nodes, page.topology.sides
        start, end = sides.edges.T
        middles = _middles(sheet, normals, nodes, sides.edges)
        apart = np.hypot(*(middles - 0.5 * (nodes[start] + nodes[end])).T)
        off = apart / straight_lengths(nodes, sides.edges)  # fraction of an edge
        split = (off * straight_lengths(flat, sides.edges) > NONLINEAR_MM) & (off < MAX_APART)
        if not split.any():
            break
        faces = _split_faces(page.faces, sides.edge.reshape(-1, 3), split, len(nodes))
        flat = np.concatenate([flat, 0.5 * (flat[start[split]] + flat[end[split]])])
        page = PageOnGrid(flat, faces, np.concatenate([nodes, middles[split]]))
    return page


def _middles(sheet: Sheet, normals: NDArray[np.float32], nodes: Floats, edges: Ints) -> Floats:
    """Return the grid positions (e, 2) of the midpoints of edges.

    Of cubics (Hermite) over edges (e, 2), tangent to the facets at both ends.
    normals: (rows, cols, 3), of the facets.
    """
    points = sheet.points(nodes)
    normal = np.stack([map_coordinates(normals[..., k], nodes.T, order=1, mode="nearest") for k in range(3)], axis=1)
    start, end = edges.T
    chord, rise, sink = points[end] - points[start], normal[start], normal[end]
    falls, rises = (np.einsum("ij,ij->i", one, chord)[:, None] for one in (sink, rise))
    bulge = sink * falls - rise * rises
    middle = 0.5 * (points[start] + points[end]) + bulge / 8.0
    return np.stack(sheet.rays.grid(middle), axis=1)


def _split_faces(faces: Ints, edge: Ints, split: Mask, count: int) -> Ints:
    """Split faces at new vertices on their edges.

    Side k of a face runs from corner k to the next. The new vertices have the order of the split edges.
    faces, edge: (m, 3), the edges being those of the sides.
    split: (e,), edges to split; the new vertices are numbered from count on.
    Returns (k, 3).
    """
    number = np.where(split, count - 1 + np.cumsum(split), -1)[edge]
    broken = split[edge]
    parts = [faces[~broken.any(axis=1)]]
    for many in (1, 2, 3):
        chosen = broken.sum(axis=1) == many
        # Turned so that the first sides are the split ones, one after the other.
        first = np.argmax(broken[chosen] & ~np.roll(broken[chosen], 1, axis=1), axis=1) if many < 3 else 0
        order = np.broadcast_to((np.arange(3) + np.reshape(first, (-1, 1))) % 3, faces[chosen].shape)
        a, b, c = np.take_along_axis(faces[chosen], order, axis=1).T
        ab, bc, ca = np.take_along_axis(number[chosen], order, axis=1).T
        corners = {
            1: ((a, ab, c), (ab, b, c)),
            2: ((ab, b, bc), (a, ab, bc), (a, bc, c)),
            3: ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)),
        }[many]
        parts += [np.stack(corner, axis=1) for corner in corners]
    return np.concatenate(parts)
