"""Refine the flattening of a coarse mesh to a lattice over the whole range grid.

Between the vertices of the coarse mesh the sheet still bends. A fine lattice gets its initial flat positions by
interpolation from the coarse mesh and is relaxed until its edges have the lengths that they have on the surface.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from restore.flattening.near_page import least_absolute_page
from restore.mesh.adjacency import sides_of
from restore.mesh.network import make_network
from restore.mesh.raster import rasterise
from restore.mesh.triangulate import lattice
from restore.range_image.facets.sheet import Sheet
from restore.scan import FlatMesh, Floats, Ints, Mask

SLOPE_STRIDE = 8  # lines of the grid: the mean slope of a page needs no more
STRIDE = 4  # samples: 15,000 nodes for a page that fills the picture; half of it changes no corner by 0.01 mm


def refine(sheet: Sheet, coarse: FlatMesh, nodes: Floats) -> tuple[FlatMesh, Floats]:
    """The flat mesh of a lattice over the whole sheet, and the grid positions (k, 2) of its vertices.

    Its initial positions are those of a coarse mesh, whose vertices have grid positions nodes (n, 2).
    """
    fine_nodes, faces = lattice(sheet.inside, STRIDE)
    sides, vertices = sides_of(faces), sheet.points(fine_nodes)
    network = make_network(vertices, faces, sheet.lengths(fine_nodes, sides.edges), sides)
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


def interpolate_flat_positions(
    shape: tuple[int, int], nodes: Floats, faces: Ints, flat: Floats, queries: Floats
) -> Floats:
    """(k, 2) mm: flat positions at grid positions queries (k, 2), interpolated over a flattened mesh.

    The mesh has faces (m, 3) and flat (n, 2) mm at grid positions nodes (n, 2) of a grid of a shape (rows, cols).
    Beyond its border the positions are extrapolated.
    """
    field = rasterise(np.ascontiguousarray(nodes[:, ::-1]), faces, flat, *shape).astype(np.float64)
    known = np.isfinite(field[..., 0])
    beyond = _neighbours(queries, shape) & ~known
    field[beyond] = _extrapolated(field, known, beyond)
    return np.stack([map_coordinates(field[..., k], queries.T, order=1, mode="nearest") for k in (0, 1)], axis=1)


def _neighbours(queries: Floats, shape: tuple[int, int]) -> Mask:
    """(rows, cols) True at the four samples round each grid position (k, 2)."""
    mask = np.zeros(shape, bool)
    row, col = np.floor(queries).astype(int).T
    for i in (row, row + 1):
        for j in (col, col + 1):
            mask[np.clip(i, 0, shape[0] - 1), np.clip(j, 0, shape[1] - 1)] = True
    return mask


def _extrapolated(field: Floats, known: Mask, wanted: Mask) -> Floats:
    """(k, 2): the field (rows, cols, 2) at wanted samples that are not known, by point reflection at the border."""
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
