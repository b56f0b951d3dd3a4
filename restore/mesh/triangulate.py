"""Triangulate masks and scans on a grid."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from restore.mesh.adjacency import components, piece_of_faces, sides_of, used_vertices
from restore.runtime.threads import in_threads
from restore.scan import Floats, Ints, Mask, RangeScan, SurfaceMesh

MAX_SNAP_DISTANCE = 0.5  # of the stride: nodes nearer to the outline move onto it, which avoids thin triangles
MIN_HEIGHT = 0.2  # of the stride; the shape of thinner triangles is mostly noise
MIN_PIECE_FRACTION = 0.02  # of the faces of the largest connected piece: smaller pieces are debris


def lattice(inside: Mask, stride: int, snap: float = 0.0) -> tuple[Floats, Ints]:
    """Triangulate the masked part of a grid, a node every `stride` samples.

    The border follows the outline, half a sample beyond the outermost samples, since the sheet ends somewhere between
    those and their neighbours: nodes just inside are moved out to it, and where they are missing, the next ones outside
    are moved in.
    snap: samples; nodes nearer than that to a sample outside are moved in any case.
    Returns nodes (n, 2) as (row, col) and faces (m, 3), counter-clockwise in the scanner's view.
    """
    padded = np.pad(inside, ((0, stride), (0, stride)))
    rows, cols = np.arange(0, padded.shape[0], stride)[:, None], np.arange(0, padded.shape[1], stride)[None, :]
    nodes = np.stack(np.broadcast_arrays(rows, cols), axis=-1).astype(float)
    kept = padded[rows, cols]
    # Vector to the nearest sample on the other side of the outline.
    beyond, within = in_threads(lambda wanted: _nearest(wanted, rows, cols), (~padded, padded))
    to_outline = np.where(kept[..., None], beyond, within) - nodes
    distance = np.linalg.norm(to_outline, axis=2)
    outline = nodes + to_outline * (1.0 - 0.5 / np.maximum(distance, 1.0))[..., None]
    snapped = np.where(kept, distance < max(MAX_SNAP_DISTANCE * stride, snap), True)
    usable = kept | (np.abs(to_outline).max(axis=2) <= stride)
    nodes, faces = _triangles(np.where(snapped[..., None], outline, nodes), usable, stride)
    return compact(nodes, faces[~_scraps(faces)])


def _scraps(faces: Ints) -> Mask:
    """Return the faces (m,) of pieces too small to belong to the sheet.

    faces: (m, 3). A few such faces lie next to a thin tip.
    """
    piece = piece_of_faces(faces)
    sizes = np.bincount(piece, minlength=1)
    return np.asarray(sizes[piece] < MIN_PIECE_FRACTION * sizes.max())


def _nearest(wanted: Mask, rows: Ints, cols: Ints) -> Floats:
    """Return the nearest wanted sample to each grid position, (…, 2), infinite without any."""
    if not wanted.any():
        return np.full((*np.broadcast_shapes(rows.shape, cols.shape), 2), np.inf)
    nearest = distance_transform_edt(~wanted, return_distances=False, return_indices=True)
    return np.moveaxis(nearest[:, rows, cols], 0, -1).astype(float)


def _triangles(nodes: Floats, usable: Mask, stride: int) -> tuple[Floats, Ints]:
    index = np.arange(usable.size).reshape(usable.shape)
    a, b = index[:-1, :-1], index[:-1, 1:]
    c, d = index[1:, :-1], index[1:, 1:]
    # Alternating diagonals make the mesh equally stiff in both diagonal directions.
    even = (np.add.outer(np.arange(a.shape[0]), np.arange(a.shape[1])) % 2 == 0)[..., None]
    first = np.where(even, np.stack([a, c, d], -1), np.stack([a, c, b], -1))
    second = np.where(even, np.stack([a, d, b], -1), np.stack([b, c, d], -1))
    faces = np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])
    faces = faces[usable.ravel()[faces].all(axis=1)]
    flat = nodes.reshape(-1, 2)
    faces = faces[_heights(flat, faces) > MIN_HEIGHT * stride]
    return compact(flat, faces[~_hanging(faces)])


def _hanging(faces: Ints) -> Mask:
    """Return the faces (m,) that only a corner joins to a larger part.

    faces: (m, 3). Nothing determines their rotation.
    """
    sides = sides_of(faces)
    shared = sides.first[:-1][np.diff(sides.first) == 2]
    part = components(np.stack([sides.at[shared], sides.at[shared + 1]], axis=1) // 3, len(faces))
    size = np.bincount(part, minlength=1)[part]
    largest = np.zeros(faces.max(initial=0) + 1, np.int64)
    np.maximum.at(largest, faces, size[:, None])
    return np.asarray(largest[faces].max(axis=1) > size)


def _heights(nodes: Floats, faces: Ints) -> Floats:
    """Return the least height (m,) of each triangle, samples, negative where clockwise."""
    p, q, r = (nodes[faces[:, k]] for k in range(3))
    doubled = (q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0])
    longest = np.max([np.linalg.norm(a - b, axis=1) for a, b in ((p, q), (q, r), (r, p))], axis=0)
    return np.divide(doubled, longest, out=np.zeros(len(faces)), where=longest > 0)


def compact(values: NDArray[Any], faces: Ints) -> tuple[NDArray[Any], Ints]:
    """The values (k, …) used by faces (m, 3), and the faces renumbered to them."""
    used = used_vertices(faces, len(values))
    return values[used], (np.cumsum(used) - 1)[faces]


def triangulate(scan: RangeScan) -> SurfaceMesh:
    """Triangulate neighbouring measured samples of a scan, without filling or smoothing."""
    measured = scan.measured
    rows, cols = np.indices(measured.shape)
    nodes, faces = _triangles(np.dstack([rows, cols]).astype(float), measured, 1)
    r, c = nodes.astype(int).T
    return SurfaceMesh(
        scan.points[r, c], faces, scan.texture_xy[r, c], scan.texture, scan.provenance, findings=scan.findings
    )
