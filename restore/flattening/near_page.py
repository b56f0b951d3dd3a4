"""The page from a start that is near it: where the fall of the particles ends, or a lattice on a page that is known."""

from __future__ import annotations

import numpy as np

from restore.flattening.isometric.gauss_newton import least_absolute_strain, minimise_strain
from restore.flattening.isometric.repair import opened, repaired
from restore.flattening.solution import Solution
from restore.mesh.network import Network, pieces
from restore.scan import Floats


def least_strain_page(flat: Floats, network: Network, signs: Floats | None = None) -> Solution:
    """The flat positions (n, 2) mm of least strain near a start, without inverted faces where that can be had.

    signs (m,) are −1 for the faces that are folded in space; all are 1 when None.
    """
    signs = np.ones(len(network.faces)) if signs is None else signs
    found = opened(minimise_strain(flat, network), network, signs)
    return found._replace(flat=repaired(found.flat, network, signs))


def least_absolute_page(flat: Floats, network: Network) -> Solution:
    """The flat positions (n, 2) mm of least absolute strain near a start: a few wrong lengths hardly move them.

    Each connected piece by itself: lengths do not tell where one lies from another, and a common solution could put it
    anywhere.
    """
    whole = Solution(flat.copy(), 0)
    for piece in pieces(network):
        found = least_absolute_strain(minimise_strain(flat[piece.vertices], piece.network), piece.network)
        whole.flat[piece.vertices] = repaired(found.flat, piece.network, np.ones(len(piece.faces)))
        whole = whole.joined(found)
    return whole
