"""The default method: the page whose edges are nearest to their lengths on the surface.

A start from the lengths alone (`angle_synchronisation.py`), exact where the lengths are those of a developable surface;
Gauss–Newton on the edge strains to convergence; repair of faces that inverted without being folded in space.
"""

from __future__ import annotations

import numpy as np

from restore.flattening.angle_synchronisation import flat_from_lengths
from restore.flattening.fans import angle_fans, face_signs
from restore.flattening.least_distortion import is_disc, least_distorted_page
from restore.flattening.repair import least_strain_page
from restore.flattening.solution import Follow, Solution
from restore.mesh.measures import rms_strain
from restore.mesh.network import Network
from restore.mesh.pose import PosedSheet

MOST_STRAIN = 0.03  # rms: no paper stretches so far; what does is not developable, or not a mesh of one sheet

CAP = 0.1  # of the strain of an edge that counts there: a few edges of slivers do not make a surface undevelopable


def flatten_isometric(posed: PosedSheet, network: Network, follow: Follow | None = None) -> Solution:
    """Flat positions (n, 2) mm of a connected sheet with its convergence; the global start counts as an iteration.

    follow(step, positions (n, 3) mm) is called with the start and with the result.
    """
    faces, sides, lengths, count = network.faces, network.sides, network.lengths, len(posed.positions)
    signs = face_signs(posed.positions, faces)
    start = flat_from_lengths(angle_fans(faces, sides, lengths, signs), lengths, count)
    found = least_strain_page(start, network, signs)
    if follow:
        for step, flat in enumerate((start, found.flat), 1):
            follow(step, np.column_stack([flat, np.zeros(count)]))
    return found._replace(iterations=1 + found.iterations)


def flatten_least_distorted(posed: PosedSheet, network: Network, follow: Follow | None = None) -> Solution:
    """As `flatten_isometric`, and a disc that is strained by more than MOST_STRAIN the least distorted page instead."""
    found = flatten_isometric(posed, network, follow)
    strain = rms_strain(found.flat, network.edges, network.lengths, CAP)
    return least_distorted_page(posed.positions, network) if strain > MOST_STRAIN and is_disc(network) else found
