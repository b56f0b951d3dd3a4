"""Least-squares conformal map of a surface into the plane.

Source: Brown & Pisula, "Conformal deskewing of non-planar documents", CVPR 2005. The flat page is the map that changes
    angles least (Lévy, Petitjean, Ray & Maillot, SIGGRAPH 2002), by one linear solve with two vertices fixed. It knows
    no lengths: the area of the surface gives the true scale.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from restore.errors import BadInput
from restore.flattening.solution import Follow, Solution
from restore.mesh.measures import face_shapes, signed_areas
from restore.mesh.network import Network
from restore.mesh.pose import PosedSheet
from restore.numerics.limits import SMALL
from restore.scan import Floats, Ints

Complex = NDArray[np.complex128]
LOOSE = "parts of the surface hang together by single points", "use the method isometric, or clean the mesh"


def flatten_conformal(posed: PosedSheet, network: Network, follow: Follow | None = None) -> Solution:
    """Flat positions (n, 2) mm of a sheet laid over the table, after one linear solve.

    follow(step, positions (n, 3) mm) is called after it. Raises BadInput for a sheet that hangs together by single
    points, whose parts could turn and grow as they like, and for one that is closed, whose map covers nothing.
    """
    corners = unfolded(network)
    area = float(corners[:, 2].imag @ corners[:, 1].real / 2.0)
    mapped = conformal_map(network.faces, corners, far_apart(posed.positions))
    flat = np.stack([mapped.real, mapped.imag], axis=1)
    covered = abs(float(signed_areas(flat, network.faces).sum()))
    if covered < SMALL:  # of the square between the held vertices
        raise BadInput("a part of the surface is closed all round", "use the method isometric, or clean the mesh")
    flat *= sqrt(area / covered)
    if follow:
        follow(1, np.column_stack([flat, np.zeros(len(flat))]))
    return Solution(flat, 1)


def unfolded(network: Network) -> Complex:
    """Unfold every face into the plane on its own.

    Returns (m, 3) corners x + iy mm, the first at 0 and the second on the x axis.
    """
    base, along, height = face_shapes(network.faces, network.edges, network.lengths)
    return np.stack([np.zeros(len(base)), base, along + 1j * height], axis=1)


def far_apart(positions: Floats) -> tuple[int, int]:
    """Return two vertices far from each other.

    They are the farthest from the centre of positions (n, 3), and the farthest from that.
    """
    first = int(np.argmax(np.linalg.norm(positions - positions.mean(axis=0), axis=1)))
    return first, int(np.argmax(np.linalg.norm(positions - positions[first], axis=1)))


def conformal_map(faces: Ints, corners: Complex, held: tuple[int, int]) -> Complex:
    """Solve the least-squares conformal map with the held vertices at 0 and 1.

    A map u of a face with corners z is conformal where Σ uⱼ (zⱼ₊₂ − zⱼ₊₁) = 0 (Lévy et al. eq. 5); the squared residual
    over the face's doubled area is least over the whole sheet.
    Returns x + iy of every vertex, (n,). Raises BadInput when the map is not unique.
    """
    sides = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    weights = 1.0 / np.sqrt(corners[:, 1].real * corners[:, 2].imag)
    count = int(faces.max()) + 1
    rows = np.repeat(np.arange(len(faces)), 3)
    angles = csc_matrix(((sides * weights[:, None]).ravel(), (rows, faces.ravel())), shape=(len(faces), count))
    free = np.setdiff1d(np.arange(count), held)
    mapped = np.zeros(count, complex)
    mapped[held[1]] = 1.0
    adjoint = angles[:, free].conj().T.tocsc()
    matrix, right = (adjoint @ angles[:, free]).tocsc(), -(adjoint @ angles[:, [held[1]]]).toarray().ravel()
    try:
        factors = splu(matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise BadInput(*LOOSE) from error
    pivots = np.abs(factors.U.diagonal())
    if not pivots.min(initial=np.inf) > SMALL * pivots.max(initial=0.0):  # sound meshes of 100,000 points have 1e-8
        raise BadInput(*LOOSE)
    mapped[free] = factors.solve(right)
    return mapped
