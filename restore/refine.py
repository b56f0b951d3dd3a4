"""Carry the flattening from its thousand points to the whole range grid.

The points settle where everything lies; between them the sheet still bends. Here a fine lattice takes its place from
the points and is relaxed until its edges have the lengths that they have on the surface.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from restore.flattening.finish import finish
from restore.mesh.network import edges_of
from restore.mesh.raster import rasterise
from restore.mesh.triangulate import lattice
from restore.range_image.sheet import Sheet
from restore.scan import FlatMesh, Floats, Ints, Mask

STRIDE = 4  # samples: 15,000 nodes for a page that fills the picture; half of it changes no corner by 0.01 mm


def refine(sheet: Sheet, coarse: FlatMesh, nodes: Floats) -> tuple[FlatMesh, Floats]:
    """Spread the flat positions of a coarse mesh, grid positions nodes (n, 2), over the whole sheet.

    Returns the fine mesh and the grid positions (k, 2) of its vertices.
    """
    fine_nodes, faces = lattice(sheet.inside, STRIDE)
    edges = edges_of(faces)
    lengths = sheet.lengths(fine_nodes, edges)
    flat = carry(sheet.inside.shape, nodes, coarse.faces, coarse.flat, fine_nodes)
    flat = finish(flat, faces, edges, lengths)
    vertices, texcoords = sheet.points(fine_nodes), sheet.texcoords(fine_nodes)
    fine = replace(coarse, vertices=vertices, faces=faces, texcoords=texcoords, flat=flat, lengths=lengths)
    return fine, fine_nodes


def carry(shape: tuple[int, int], nodes: Floats, faces: Ints, flat: Floats, wanted: Floats) -> Floats:
    """Read flat positions for wanted (k, 2) grid positions off a mesh with flat (n, 2) at grid positions nodes (n, 2).

    Past the border of the mesh they go on as they come to it.
    """
    field = rasterise(np.ascontiguousarray(nodes[:, ::-1]), faces, flat, *shape).astype(np.float64)
    field = _continued(field, np.isfinite(field[..., 0]))
    return np.stack([map_coordinates(field[..., k], wanted.T, order=1, mode="nearest") for k in (0, 1)], axis=1)


def _continued(field: Floats, known: Mask) -> Floats:
    """Fill the unknown part of a field (rows, cols, 2): past the border it goes on as it comes to it."""
    position = np.array(np.indices(known.shape))
    border = distance_transform_edt(~known, return_distances=False, return_indices=True)
    inner = 2 * border - position  # as far inside the border as the unknown sample lies outside
    within = np.all((inner >= 0) & (inner < np.array(known.shape)[:, None, None]), axis=0)
    inner = np.where(within, inner, border)
    inner = np.where(known[tuple(inner)], inner, border)
    down, right = (np.nanmean(np.diff(field, axis=axis), axis=(0, 1)) for axis in (0, 1))
    # Where nothing lies inside either, the page's mean slope has to do.
    beyond = (position - border + inner - border).astype(np.float64)
    return 2 * field[tuple(border)] - field[tuple(inner)] + beyond[0, ..., None] * down + beyond[1, ..., None] * right
